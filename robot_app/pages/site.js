"use strict";
const site = JSON.parse(document.getElementById("data").textContent);
const SVG = "http://www.w3.org/2000/svg", SHOWN = 200;
const plan = document.getElementById("plan"), list = document.getElementById("list"), detail = document.getElementById("detail");
const ask = document.getElementById("ask"), count = document.getElementById("count"), tabs = document.getElementById("tabs");
const things = new Map(site.objects.map((o) => [o.id, o]));
for (const o of site.objects) o.words = [o.label, o.room, ...o.concepts.flatMap((c) => c.phrases.map((p) => p[0]))].join(" ").toLowerCase();
let floor = 0, chosen = null, matches = new Set(), shapes = new Map(), box = null, home = null;

function make(tag, words, name) {
  const element = document.createElement(tag);
  if (words !== undefined) element.textContent = words;
  if (name) element.className = name;
  return element;
}
function draw(tag, attributes, parent) {
  const element = document.createElementNS(SVG, tag);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  parent.append(element);
  return element;
}
function look() { plan.setAttribute("viewBox", box.join(" ")); }

function drawFloor() {
  const f = site.floors[floor];
  plan.replaceChildren();
  shapes = new Map();
  home = f.box.slice(); box = home.slice();
  look();
  f.rooms.forEach((room, k) => {
    const shape = draw("polygon", { points: room.polygon.map(([x, y]) => `${x},${-y}`).join(" "), class: `room room${k % 8}` }, plan);
    draw("title", {}, shape).textContent = `${room.name}: ${room.because}`;
    shape.addEventListener("click", () => chooseRoom(room, f.id));
  });
  if (f.walls) draw("image", { href: f.walls.src, x: f.walls.x, y: f.walls.y, width: f.walls.width, height: f.walls.height, preserveAspectRatio: "none" }, plan);
  for (const walk of f.walks) draw("polyline", { points: walk.map(([x, y]) => `${x},${-y}`).join(" "), class: "walk" }, plan);
  for (const o of site.objects) {
    if (o.floor !== f.id || o.background) continue;
    const [x0, y0, x1, y1] = o.box;
    const shape = draw("rect", { x: x0, y: -y1, width: Math.max(x1 - x0, 0.05), height: Math.max(y1 - y0, 0.05), class: "thing" }, plan);
    draw("title", {}, shape).textContent = `${o.id} ${o.label}`;
    shape.addEventListener("click", () => choose(o.id));
    shapes.set(o.id, shape);
  }
  for (const room of f.rooms) {
    const xs = room.polygon.map((p) => p[0]), ys = room.polygon.map((p) => p[1]);
    const middle = [(Math.min(...xs) + Math.max(...xs)) / 2, -(Math.min(...ys) + Math.max(...ys)) / 2];
    draw("text", { x: middle[0], y: middle[1], class: "roomname" }, plan).textContent = room.name;
  }
  [...tabs.querySelectorAll("button")].forEach((b, k) => b.setAttribute("aria-pressed", String(k === floor)));
  mark();
}
function mark() {
  const asked = ask.value.trim() !== "";
  for (const [id, shape] of shapes) {
    shape.classList.toggle("match", asked && matches.has(id));
    shape.classList.toggle("faint", asked && !matches.has(id) && id !== chosen);
    shape.classList.toggle("chosen", id === chosen);
  }
}
function search() {
  const words = ask.value.toLowerCase().split(/\s+/).filter(Boolean);
  const found = site.objects.filter((o) => (words.length || !o.background) && words.every((w) => o.words.includes(w)));
  found.sort((a, b) => Number(b.label.toLowerCase() === words.join(" ")) - Number(a.label.toLowerCase() === words.join(" ")) || b.seen - a.seen || a.id - b.id);
  matches = new Set(found.map((o) => o.id));
  count.textContent = words.length ? `${found.length} objects whose label, room or phrases match` : `${found.length} objects, most seen first`;
  list.replaceChildren(...found.slice(0, SHOWN).map((o) => {
    const row = make("button", `${o.label}`, "row");
    row.type = "button";
    row.append(make("span", `  ${o.room || "no room"} · ${o.seen} × seen · ${o.id}`, "soft small"));
    row.setAttribute("aria-current", String(o.id === chosen));
    row.addEventListener("click", () => choose(o.id));
    const item = make("li");
    item.append(row);
    return item;
  }));
  if (found.length > SHOWN) list.append(make("li", `and ${found.length - SHOWN} more: type another word`, "soft small"));
  mark();
}
function concepts(said) {
  const t = make("table"), head = make("tr");
  for (const [words, name] of [["concept and its phrases", ""], ["belief", "n"], ["weight", "n"]]) head.append(make("th", words, name));
  t.append(head);
  const add = (cells, name) => {
    const row = make("tr", undefined, name);
    cells.forEach((c, k) => row.append(make("td", c, k ? "n" : "")));
    t.append(row);
  };
  for (const c of said) {
    add([c.label, c.belief.toFixed(3), c.support.toFixed(1)], "concept");
    for (const [phrase, weight] of c.phrases) add([phrase, "", weight.toFixed(1)], "phrase");
  }
  return t;
}
function chooseRoom(room, floorId) {
  const inside = site.objects.filter((o) => o.room === room.name && o.floor === floorId && !o.background);
  detail.replaceChildren(make("h2", room.name), make("p", room.because), make("p", `${inside.length} objects stand in it`, "soft small"));
  detail.scrollTop = 0;
}
function choose(id) {
  const o = things.get(id);
  if (!o) return;
  chosen = id;
  const index = site.floors.findIndex((f) => f.id === o.floor);
  if (index >= 0 && index !== floor) { floor = index; drawFloor(); }
  detail.replaceChildren(make("h2", `${o.label} (object ${o.id})`));
  detail.append(make("p", `in ${o.room || "no known room"}, centre ${o.centre.map((v) => v.toFixed(2)).join(" ")} m, ${o.trust}`));
  detail.append(make("p", `${o.seen} observations in ${o.frames} frames`, "soft small"));
  if (o.crop) { const image = make("img", undefined, "crop"); image.src = o.crop; image.alt = `crop of ${o.label} with its mask`; detail.append(image); }
  if (o.concepts.length) detail.append(concepts(o.concepts));
  const picture = site.pictures[o.view];
  if (picture) {
    const frame = make("figure", undefined, "view"), image = make("img", undefined, "crop");
    image.src = picture; image.alt = "best view";
    frame.append(image);
    const caption = `best view: ${site.views[o.view].recording} at ${site.views[o.view].stamp_ns} ns`;
    if (o.frame) {
      const mark = document.createElementNS(SVG, "svg");
      mark.setAttribute("viewBox", "0 0 1 1"); mark.setAttribute("preserveAspectRatio", "none"); mark.setAttribute("class", "over");
      const [x0, y0, x1, y1] = o.frame;
      draw("rect", { x: x0, y: y0, width: x1 - x0, height: y1 - y0, class: "frame" }, mark);
      const holder = make("div", undefined, "framed");
      holder.append(image, mark);
      frame.replaceChildren(holder);
    }
    frame.append(make("figcaption", caption, "soft"));
    detail.append(frame);
  }
  detail.scrollTop = 0;
  search();
}
plan.addEventListener("wheel", (event) => {
  event.preventDefault();
  const r = plan.getBoundingClientRect(), scale = Math.min(r.width / box[2], r.height / box[3]);
  const x = box[0] + box[2] / 2 + (event.clientX - r.left - r.width / 2) / scale, y = box[1] + box[3] / 2 + (event.clientY - r.top - r.height / 2) / scale;
  const k = event.deltaY > 0 ? 1.2 : 1 / 1.2;
  if (box[2] * k > home[2] * 4 || box[2] * k < home[2] / 60) return;
  box = [x + (box[0] - x) * k, y + (box[1] - y) * k, box[2] * k, box[3] * k];
  look();
}, { passive: false });
let from = null;
plan.addEventListener("pointerdown", (event) => { from = [event.clientX, event.clientY, box.slice()]; });
plan.addEventListener("pointermove", (event) => {
  if (!from) return;
  const r = plan.getBoundingClientRect(), scale = Math.min(r.width / box[2], r.height / box[3]);
  box = [from[2][0] - (event.clientX - from[0]) / scale, from[2][1] - (event.clientY - from[1]) / scale, box[2], box[3]];
  look();
});
for (const end of ["pointerup", "pointerleave", "pointercancel"]) plan.addEventListener(end, () => { from = null; });
site.floors.forEach((f, k) => {
  const tab = make("button", `floor ${f.id} (${f.height_m.toFixed(2)} m)`);
  tab.type = "button";
  tab.addEventListener("click", () => { floor = k; drawFloor(); });
  tabs.append(tab);
});
const whole = make("button", "whole floor");
whole.type = "button";
whole.addEventListener("click", () => { box = home.slice(); look(); });
tabs.append(whole);
ask.addEventListener("input", search);
drawFloor();
search();
