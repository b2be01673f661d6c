// What on the screen has less contrast than WCAG 2 AA asks: 4.5 for words, 3 for the edges of controls and for what is
// drawn on the plan (by the colours that it is drawn in).
(() => {
  const parse = (colour) => {
    const values = colour.startsWith("#") ? colour.match(/\w\w/g).map((hex) => parseInt(hex, 16)) : colour.match(/[\d.]+/g).map(Number);
    return values.length === 3 ? [...values, 1] : values;
  };
  const linear = (value) => (value / 255 <= 0.03928 ? value / 255 / 12.92 : ((value / 255 + 0.055) / 1.055) ** 2.4);
  const light = ([r, g, b]) => 0.2126 * linear(r) + 0.7152 * linear(g) + 0.0722 * linear(b);
  const over = ([r, g, b, a], ground) => [r, g, b].map((value, index) => a * value + (1 - a) * ground[index]);
  const ratio = (one, other) => {
    const [a, b] = [light(one), light(other)];
    return (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
  };
  const ground = (node) => {
    for (; node; node = node.parentElement) {
      const colour = parse(getComputedStyle(node).backgroundColor);
      if (colour[3] > 0.99) return colour;
    }
    return [255, 255, 255];
  };
  const shown = (node) => {
    const box = node.getBoundingClientRect();
    return box.width && box.bottom > 0 && box.top < innerHeight && node.checkVisibility() && !node.matches(":disabled, .hidden, .hidden *");
  };
  const called = (node) => `${node.tagName}#${node.id}.${node.className} ${node.textContent.trim().slice(0, 30)}`;
  const found = [];
  const need = (least, one, other, what) => { const got = ratio(over(one, other), other); if (got < least) found.push(`${what}: ${got.toFixed(2)}`); };
  for (const node of document.querySelectorAll("body *")) {
    if (!shown(node)) continue;
    const style = getComputedStyle(node), under = ground(node);
    if ([...node.childNodes].some((child) => child.nodeType === 3 && child.textContent.trim())) need(4.5, parse(style.color), under, called(node));
    if (node.placeholder && !node.value) need(4.5, parse(getComputedStyle(node, "::placeholder").color), under, `${called(node)} ${node.placeholder}`);
    if (node.matches("input, select, textarea, button:not(.plain, .name, .choice button, .steps button, .tabs button)")) {
      const outside = ground(node.parentElement);
      if (ratio(under, outside) < 3) need(3, parse(style.borderTopColor), outside, `the edge of ${called(node)}`);
    }
  }
  const colour = (name) => parse(getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim());
  for (const mark of ["way", "place", "confirmed", "rejected", "aside"]) need(4.5, colour(mark === "place" ? "on-place" : "panel"), colour(mark), `a number on ${mark}`);
  need(4.5, colour("room"), colour("free"), "a room's name");
  for (const drawn of ["way", "place", "confirmed", "rejected", "aside", "ink", "faint", "wall", "accent"]) need(3, colour(drawn), colour("free"), `${drawn} on the plan`);
  return found;
})()
