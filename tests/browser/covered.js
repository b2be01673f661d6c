// What of these elements is not whole on the screen: out of sight, clipped, covered, or STOP too small for a thumb.
(ids) => ids.flatMap((id) => {
  const node = document.getElementById(id), box = node.getBoundingClientRect();
  if (id === "reason" && !node.textContent) return [];
  const points = [[0.5, 0.5], [0.04, 0.5], [0.96, 0.5], [0.5, 0.15], [0.5, 0.85]].map(([x, y]) => [box.left + x * box.width, box.top + y * box.height]);
  const at = points.map(([x, y]) => document.elementFromPoint(x, y)).filter((found) => !found || !(node.contains(found) || found.contains(node) && id !== "stop"));
  const trouble = at.map((found) => `${id} is covered by ${found ? found.outerHTML.slice(0, 60) : "the screen's edge"}`);
  if (box.bottom > innerHeight + 0.5 || box.right > innerWidth + 0.5 || box.top < -0.5 || box.left < -0.5) trouble.push(`${id} ends at ${box.right}, ${box.bottom} of ${innerWidth}, ${innerHeight}`);
  if (id === "stop" && (box.width < 140 || box.height < 48)) trouble.push(`STOP is ${box.width} x ${box.height}`);
  return [...new Set(trouble)];
})
