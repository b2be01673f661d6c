// The controls on the page that a screen reader has no name for.
[...document.querySelectorAll("button, input, select, a, canvas, [role=list]")]
  .filter((each) => each.offsetParent !== null)
  .filter((each) => !(each.getAttribute("aria-label") || each.textContent.trim() || (each.labels && each.labels.length)))
  .map((each) => each.outerHTML);
