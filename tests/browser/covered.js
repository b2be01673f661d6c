// What is wrong with STOP: corners that another element lies over, too small, out of sight.
(() => {
  const box = document.getElementById("stop").getBoundingClientRect();
  const points = [[box.left + 8, box.top + 8], [box.right - 8, box.bottom - 8], [(box.left + box.right) / 2, (box.top + box.bottom) / 2]];
  const hidden = points.filter(([x, y]) => !document.elementFromPoint(x, y)?.closest("#stop"));
  const over = ([x, y]) => `${x}, ${y} is covered by ${document.elementFromPoint(x, y)?.outerHTML?.slice(0, 80)}`;
  const trouble = hidden.map(over);
  if (box.width < 300) trouble.push(`${box.width} pixels wide`);
  if (box.bottom > innerHeight + 0.5) trouble.push(`it ends at ${box.bottom} of ${innerHeight}`);
  return trouble;
})();
