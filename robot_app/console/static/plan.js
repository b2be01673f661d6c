// The plan: map, rooms, keep-out, objects, and over them robot, way, goal and numbered candidates.
// What stands still is painted once to a canvas of its own; a snapshot repaints only what moves.

import {attribute, measured} from "./dom.js";
import {statusKind} from "./words.js";

const MARGIN_M = 0.6;
const FOLLOW_M = 8;
const ROBOT_M = 0.28;
const CLEAR_PX = 44; // between a room's name and a candidate's number

export class Plan {
  constructor(canvas, {onPick} = {}) {
    this.canvas = canvas;
    this.site = {objects: [], rooms: [], keep_out: [], allowed: []};
    this.grid = null;
    this.scene = {};
    this.follow = false;
    this.view = null; // {x, y, scale}: map point at the centre, pixels per metre
    this.still = document.createElement("canvas");
    this.stillKey = "";
    new ResizeObserver(() => this.paint()).observe(canvas);
    this.listen(onPick || (() => {}));
  }

  setSite(site, grid, image) {
    this.site = site;
    this.grid = grid && image ? {...grid, image} : null;
    this.view = null;
    this.tinted = {};
    this.stillKey = "";
    this.known = this.grid ? knownExtent(this.grid) : null;
    this.paint();
  }

  // scene: {robot, track, path, goal, candidates, chosen, selected, objects}
  show(scene) {
    this.scene = scene;
    this.paint();
  }

  fit() { this.follow = false; this.view = null; this.paint(); }
  followRobot() { this.follow = true; this.view = null; this.paint(); }

  paint() {
    const start = performance.now();
    const ratio = window.devicePixelRatio || 1, {canvas} = this;
    const width = Math.round(canvas.clientWidth * ratio), height = Math.round(canvas.clientHeight * ratio);
    if (!width || !height) return;
    if (canvas.width !== width || canvas.height !== height) { Object.assign(canvas, {width, height}); if (!this.moved) this.view = null; }
    this.aim(width, height);
    this.paintStill(width, height, ratio);
    const pen = canvas.getContext("2d");
    pen.clearRect(0, 0, width, height);
    pen.drawImage(this.still, 0, 0);
    this.paintMoving(pen, ratio);
    this.describe();
    measured("plan-paint", start);
  }

  aim(width, height) {
    const robot = this.scene.robot;
    if (this.follow && robot) {
      this.view = {x: robot.x, y: robot.y, scale: Math.min(width, height) / FOLLOW_M};
      return;
    }
    if (this.view) return;
    const [x0, y0, x1, y1] = this.extent();
    const scale = Math.min(width / (x1 - x0 + 2 * MARGIN_M), height / (y1 - y0 + 2 * MARGIN_M));
    this.view = {x: (x0 + x1) / 2, y: (y0 + y1) / 2, scale};
    this.moved = false;
  }

  extent() {
    const {grid, site} = this;
    if (grid) return this.known;
    const xs = site.objects.flatMap((each) => [each.low[0], each.high[0]]), ys = site.objects.flatMap((each) => [each.low[1], each.high[1]]);
    return xs.length ? [Math.min(...xs), Math.min(...ys), Math.max(...xs), Math.max(...ys)] : [-5, -5, 5, 5];
  }

  at(x, y) {
    const {canvas, view} = this;
    return [canvas.width / 2 + (x - view.x) * view.scale, canvas.height / 2 - (y - view.y) * view.scale];
  }

  colours() {
    const theme = document.documentElement.dataset.theme;
    if (this.themeOf !== theme) {
      const style = getComputedStyle(document.documentElement);
      this.themeOf = theme;
      this.palette = new Proxy({}, {get: (_, name) => style.getPropertyValue(`--${String(name)}`).trim()});
      const names = ["free", "unknown", "wall", "room", "thing", "ink", "faint", "way", "place", "on-place", "confirmed", "rejected", "aside", "panel", "accent"];
      this.palette = Object.fromEntries(names.map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
    }
    return this.palette;
  }

  paintStill(width, height, ratio) {
    const colours = this.colours(), {view} = this, marks = (this.scene.candidates || []).map((each) => each.object_id);
    const key = [width, height, view.x, view.y, view.scale, this.themeOf, this.site.objects.length, Boolean(this.grid), marks].join();
    if (key === this.stillKey) return;
    this.stillKey = key;
    Object.assign(this.still, {width, height});
    const pen = this.still.getContext("2d");
    pen.fillStyle = colours.unknown;
    pen.fillRect(0, 0, width, height);
    if (this.grid) this.paintGrid(pen, colours);
    for (const polygon of this.site.keep_out) this.paintZone(pen, polygon, colours.rejected, ratio);
    pen.lineWidth = ratio;
    pen.strokeStyle = colours.thing;
    pen.beginPath();
    for (const each of this.site.objects) this.box(pen, each);
    pen.stroke();
    this.paintRooms(pen, colours, ratio, this.site.objects.filter((each) => marks.includes(each.id)));
  }

  paintGrid(pen, colours) {
    const {grid} = this, theme = this.themeOf;
    this.tinted[theme] ||= tinted(grid.image, colours);
    const [x, y] = this.at(grid.origin[0], grid.origin[1] + grid.height * grid.resolution_m);
    pen.imageSmoothingEnabled = this.view.scale * grid.resolution_m < 2;
    pen.drawImage(this.tinted[theme], x, y, grid.width * grid.resolution_m * this.view.scale, grid.height * grid.resolution_m * this.view.scale);
  }

  paintZone(pen, polygon, colour, ratio) {
    pen.save();
    pen.beginPath();
    polygon.forEach(([x, y], index) => pen[index ? "lineTo" : "moveTo"](...this.at(x, y)));
    pen.closePath();
    pen.strokeStyle = colour;
    pen.lineWidth = 2 * ratio;
    pen.stroke();
    pen.clip();
    pen.globalAlpha = 0.35;
    pen.beginPath();
    for (let d = -this.still.height; d < this.still.width; d += 10 * ratio) { pen.moveTo(d, 0); pen.lineTo(d + this.still.height, this.still.height); }
    pen.stroke();
    pen.restore();
  }

  // A room's name stands in its middle, or aside where a candidate's number would hide it.
  paintRooms(pen, colours, ratio, marked) {
    const numbers = marked.map((each) => this.at(each.centroid[0], each.centroid[1]));
    pen.font = `${13 * ratio}px system-ui, sans-serif`;
    pen.textAlign = "center";
    pen.textBaseline = "middle";
    pen.lineJoin = "round";
    for (const room of this.site.rooms) {
      const [x, y] = clearest(spots(room.polygon).map((spot) => this.at(...spot)), numbers, CLEAR_PX * ratio);
      pen.strokeStyle = colours.free;
      pen.lineWidth = 4 * ratio;
      pen.strokeText(room.name, x, y);
      pen.fillStyle = colours.room;
      pen.fillText(room.name, x, y);
    }
  }

  box(pen, each) {
    const [left, top] = this.at(each.low[0], each.high[1]);
    pen.rect(left, top, (each.high[0] - each.low[0]) * this.view.scale, (each.high[1] - each.low[1]) * this.view.scale);
  }

  paintMoving(pen, ratio) {
    const colours = this.colours(), {scene} = this;
    if (scene.objects) this.paintStates(pen, colours, scene.objects);
    line(pen, (scene.track || []).map(([x, y]) => this.at(x, y)), colours.faint, 2 * ratio, []);
    line(pen, (scene.path || []).map(([x, y]) => this.at(x, y)), colours.way, 3 * ratio, [9 * ratio, 6 * ratio]);
    if (scene.selected !== null && scene.selected !== undefined) this.paintSelected(pen, colours, ratio);
    if (scene.goal) this.arrow(pen, scene.goal, colours.way, ratio);
    this.paintCandidates(pen, colours, ratio);
    if (scene.robot) this.paintRobot(pen, scene.robot, colours, ratio);
  }

  // {id: level 0..1}: what changes about many objects at once.
  paintStates(pen, colours, states) {
    pen.fillStyle = colours.way;
    for (const each of this.site.objects) {
      const level = states[each.id];
      if (level === undefined) continue;
      pen.globalAlpha = 0.15 + 0.7 * level;
      const [left, top] = this.at(each.low[0], each.high[1]);
      pen.fillRect(left, top, (each.high[0] - each.low[0]) * this.view.scale, (each.high[1] - each.low[1]) * this.view.scale);
    }
    pen.globalAlpha = 1;
  }

  paintSelected(pen, colours, ratio) {
    const each = this.site.objects.find((object) => object.id === this.scene.selected);
    if (!each) return;
    pen.strokeStyle = colours.accent;
    pen.lineWidth = 3 * ratio;
    pen.beginPath();
    this.box(pen, each);
    pen.stroke();
  }

  paintCandidates(pen, colours, ratio) {
    const marks = {confirmed: colours.confirmed, rejected: colours.rejected, "set aside": colours.aside, declined: colours.aside, chosen: colours.place};
    for (const candidate of [...(this.scene.candidates || [])].reverse()) {
      const each = this.site.objects.find((object) => object.id === candidate.object_id);
      if (!each) continue;
      const kind = statusKind(candidate.status), colour = marks[kind] || colours.way;
      pen.strokeStyle = colour;
      pen.lineWidth = 2 * ratio;
      pen.beginPath();
      this.box(pen, each);
      pen.stroke();
      const [x, y] = this.at(each.centroid[0], each.centroid[1]), radius = 10 * ratio;
      pen.fillStyle = colour;
      pen.beginPath();
      if (kind === "rejected") pen.rect(x - radius, y - radius, 2 * radius, 2 * radius);
      else pen.arc(x, y, radius, 0, 2 * Math.PI);
      pen.fill();
      pen.fillStyle = kind === "chosen" ? colours["on-place"] : colours.panel;
      pen.font = `700 ${13 * ratio}px system-ui, sans-serif`;
      pen.textAlign = "center";
      pen.textBaseline = "middle";
      pen.fillText(candidate.number ? String(candidate.number) : {confirmed: "✓", rejected: "✕"}[kind] || "–", x, y + ratio);
    }
  }

  paintRobot(pen, robot, colours, ratio) {
    const [x, y] = this.at(robot.x, robot.y), radius = Math.max(ROBOT_M * this.view.scale, 8 * ratio);
    pen.fillStyle = colours.ink;
    pen.strokeStyle = colours.panel;
    pen.lineWidth = 2 * ratio;
    pen.beginPath();
    pen.arc(x, y, radius, 0, 2 * Math.PI);
    pen.fill();
    pen.stroke();
    pen.fillStyle = colours.panel;
    pen.beginPath();
    for (const [angle, reach] of [[0, 0.85], [2.4, 0.7], [-2.4, 0.7]]) pen.lineTo(x + Math.cos(robot.yaw + angle) * radius * reach, y - Math.sin(robot.yaw + angle) * radius * reach);
    pen.fill();
  }

  arrow(pen, pose, colour, ratio) {
    const [x, y] = this.at(pose.x, pose.y), long = Math.max(0.45 * this.view.scale, 16 * ratio);
    const tip = [x + Math.cos(pose.yaw) * long, y - Math.sin(pose.yaw) * long];
    pen.strokeStyle = pen.fillStyle = colour;
    pen.lineWidth = 3 * ratio;
    pen.beginPath();
    pen.arc(x, y, 5 * ratio, 0, 2 * Math.PI);
    pen.fill();
    pen.beginPath();
    pen.moveTo(x, y);
    pen.lineTo(...tip);
    pen.stroke();
    pen.beginPath();
    for (const turn of [0, 2.6, -2.6]) pen.lineTo(tip[0] + Math.cos(pose.yaw + turn) * 8 * ratio, tip[1] - Math.sin(pose.yaw + turn) * 8 * ratio);
    pen.fill();
  }

  describe() {
    const {robot, goal, candidates} = this.scene;
    const where = robot ? `The robot is at ${robot.x.toFixed(1)}, ${robot.y.toFixed(1)} metres.` : "Where the robot is, is not known.";
    const aim = goal ? ` It is to go to ${goal.x.toFixed(1)}, ${goal.y.toFixed(1)}.` : "";
    attribute(this.canvas, "aria-label", `Plan of the site. ${where}${aim} ${candidates?.length || 0} candidates.`);
  }

  listen(onPick) {
    const {canvas} = this, pointers = new Map();
    let travelled = 0, apart = 0;
    const local = (event) => { const box = canvas.getBoundingClientRect(), ratio = canvas.width / box.width; return [(event.clientX - box.left) * ratio, (event.clientY - box.top) * ratio]; };
    canvas.style.touchAction = "none";
    canvas.addEventListener("keydown", (event) => this.key(event, onPick));
    canvas.addEventListener("wheel", (event) => { event.preventDefault(); this.zoom(Math.exp(-event.deltaY * 0.0015), local(event)); }, {passive: false});
    canvas.addEventListener("pointerdown", (event) => { canvas.setPointerCapture(event.pointerId); pointers.set(event.pointerId, local(event)); travelled = 0; apart = 0; });
    canvas.addEventListener("pointermove", (event) => {
      const before = pointers.get(event.pointerId);
      if (!before || !this.view) return;
      const now = local(event);
      pointers.set(event.pointerId, now);
      travelled += Math.hypot(now[0] - before[0], now[1] - before[1]);
      if (pointers.size === 1) this.pan(now[0] - before[0], now[1] - before[1]);
      if (pointers.size === 2) {
        const [a, b] = [...pointers.values()], distance = Math.hypot(a[0] - b[0], a[1] - b[1]);
        if (apart) this.zoom(distance / apart, [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2]);
        apart = distance;
      }
    });
    const end = (event) => {
      if (event.type === "pointerup" && pointers.size === 1 && travelled < 8) this.pick(local(event), onPick);
      pointers.delete(event.pointerId);
      apart = 0;
    };
    canvas.addEventListener("pointerup", end);
    canvas.addEventListener("pointercancel", end);
  }

  key(event, onPick) {
    const {canvas} = this, middle = [canvas.width / 2, canvas.height / 2], step = Math.min(...middle) / 4;
    const act = {
      ArrowLeft: () => this.pan(step, 0), ArrowRight: () => this.pan(-step, 0), ArrowUp: () => this.pan(0, step), ArrowDown: () => this.pan(0, -step),
      "+": () => this.zoom(1.25, middle), "-": () => this.zoom(0.8, middle), Home: () => this.fit(), Enter: () => this.pickNearest(onPick),
    }[event.key];
    if (!act || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    act();
  }

  pickNearest(onPick) {
    const {x, y} = this.view, apart = (each) => Math.hypot(each.centroid[0] - x, each.centroid[1] - y);
    const nearest = this.site.objects.reduce((best, each) => (!best || apart(each) < apart(best) ? each : best), null);
    if (nearest) onPick(nearest.id);
  }

  pan(dx, dy) {
    if (Math.abs(dx) + Math.abs(dy) < 0.5) return;
    this.follow = false;
    this.moved = true;
    this.view = {...this.view, x: this.view.x - dx / this.view.scale, y: this.view.y + dy / this.view.scale};
    this.paint();
  }

  zoom(factor, [px, py]) {
    if (!this.view) return;
    const {view, canvas} = this, scale = Math.max(4, Math.min(600, view.scale * factor));
    const x = view.x + (px - canvas.width / 2) / view.scale, y = view.y - (py - canvas.height / 2) / view.scale;
    this.follow = false;
    this.moved = true;
    this.view = {scale, x: x - (px - canvas.width / 2) / scale, y: y + (py - canvas.height / 2) / scale};
    this.paint();
  }

  pick([px, py], onPick) {
    const {view, canvas} = this;
    const x = view.x + (px - canvas.width / 2) / view.scale, y = view.y - (py - canvas.height / 2) / view.scale;
    const reach = 12 / view.scale;
    const near = this.site.objects.filter((each) => x > each.low[0] - reach && x < each.high[0] + reach && y > each.low[1] - reach && y < each.high[1] + reach);
    near.sort((a, b) => area(a) - area(b));
    if (near.length) onPick(near[0].id);
  }
}

const area = (each) => (each.high[0] - each.low[0]) * (each.high[1] - each.low[1]);

function middle(polygon) {
  let x = 0, y = 0, twice = 0;
  polygon.forEach(([x0, y0], index) => {
    const [x1, y1] = polygon[(index + 1) % polygon.length], cross = x0 * y1 - x1 * y0;
    twice += cross;
    x += (x0 + x1) * cross;
    y += (y0 + y1) * cross;
  });
  return twice ? [x / (3 * twice), y / (3 * twice)] : polygon[0];
}

// Where a room's name may stand: its middle first.
function spots(polygon) {
  const [x, y] = middle(polygon), high = Math.max(...polygon.map((each) => each[1])) - Math.min(...polygon.map((each) => each[1]));
  return [0, 0.25, -0.25, 0.36, -0.36].map((share) => [x, y + share * high]);
}

// The first spot that is so far from every number, or the one that is furthest.
function clearest(places, numbers, enough) {
  const apart = ([x, y]) => Math.min(enough, ...numbers.map(([nx, ny]) => Math.hypot((nx - x) / 2, ny - y) * 2));
  return places.reduce((best, each) => (apart(each) > apart(best) ? each : best));
}

function line(pen, points, colour, width, dash) {
  if (points.length < 2) return;
  pen.strokeStyle = colour;
  pen.lineWidth = width;
  pen.lineJoin = "round";
  pen.setLineDash(dash);
  pen.beginPath();
  points.forEach(([x, y], index) => pen[index ? "lineTo" : "moveTo"](x, y));
  pen.stroke();
  pen.setLineDash([]);
}

// [x0, y0, x1, y1] of what the map knows; all of it where it knows nothing.
function knownExtent(grid) {
  const {image, resolution_m: side, origin: [x, y]} = grid, canvas = document.createElement("canvas");
  Object.assign(canvas, {width: image.width, height: image.height});
  const pen = canvas.getContext("2d", {willReadFrequently: true});
  pen.drawImage(image, 0, 0);
  const {data} = pen.getImageData(0, 0, canvas.width, canvas.height), found = [Infinity, Infinity, -Infinity, -Infinity];
  for (let at = 0; at < data.length; at += 4) {
    if (data[at] === 128) continue;
    const column = (at / 4) % canvas.width, row = Math.floor(at / 4 / canvas.width);
    found[0] = Math.min(found[0], column); found[2] = Math.max(found[2], column + 1);
    found[1] = Math.min(found[1], row); found[3] = Math.max(found[3], row + 1);
  }
  if (found[0] === Infinity) return [x, y, x + image.width * side, y + image.height * side];
  return [x + found[0] * side, y + (image.height - found[3]) * side, x + found[2] * side, y + (image.height - found[1]) * side];
}

// The map's three shades in the theme's colours.
function tinted(image, colours) {
  const canvas = document.createElement("canvas");
  Object.assign(canvas, {width: image.width, height: image.height});
  const pen = canvas.getContext("2d", {willReadFrequently: true});
  pen.drawImage(image, 0, 0);
  const pixels = pen.getImageData(0, 0, canvas.width, canvas.height);
  const shades = {255: rgb(colours.free), 128: rgb(colours.unknown), 0: rgb(colours.wall)};
  for (let at = 0; at < pixels.data.length; at += 4) {
    const shade = shades[pixels.data[at]] || shades[128];
    pixels.data[at] = shade[0];
    pixels.data[at + 1] = shade[1];
    pixels.data[at + 2] = shade[2];
  }
  pen.putImageData(pixels, 0, 0);
  return canvas;
}

const rgb = (hex) => [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16));

export async function loadSite(site, gridUrl, gridJson) {
  const grid = gridJson || null;
  if (!grid) return [site, null, null];
  const response = await fetch(gridUrl, {credentials: "same-origin"});
  if (!response.ok) return [site, null, null];
  return [site, grid, await createImageBitmap(await response.blob())];
}
