// The picture, and on an arrival's picture what was judged: outlines in the colours of the arrival pictures.

import {attribute, text} from "./dom.js";
import {openSocket} from "./socket.js";

const LATE_S = 1.2;

export class Picture {
  constructor(canvas, words) {
    Object.assign(this, {canvas, words});
    this.image = null;
    this.look = null;
    new ResizeObserver(() => this.paint()).observe(canvas);
  }

  show(image, look = null, caption = "") {
    Object.assign(this, {image, look, caption});
    this.paint();
  }

  say(caption, alternative = caption) {
    text(this.words, caption);
    attribute(this.canvas, "aria-label", alternative);
  }

  paint() {
    const {canvas, image} = this;
    const ratio = window.devicePixelRatio || 1;
    const width = Math.round(canvas.clientWidth * ratio), height = Math.round(canvas.clientHeight * ratio);
    if (!width || !height) return;
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, {width, height});
    const pen = canvas.getContext("2d");
    pen.clearRect(0, 0, width, height);
    if (!image) return;
    const scale = Math.min(width / image.width, height / image.height);
    const box = {w: image.width * scale, h: image.height * scale};
    box.x = (width - box.w) / 2;
    box.y = (height - box.h) / 2;
    pen.drawImage(image, box.x, box.y, box.w, box.h);
    if (this.look) drawLook(pen, this.look, box, ratio);
  }
}

function drawLook(pen, look, box, ratio) {
  const style = getComputedStyle(document.documentElement);
  const colour = (name) => style.getPropertyValue(name).trim();
  const verdict = look.verdict === "confirmed" ? "--confirmed" : "--rejected";
  for (const mask of look.masks) if (!mask.judged) outline(pen, mask.outline, box, "#e8eef4", 1 * ratio, []);
  outline(pen, look.place, box, colour("--place"), 2.5 * ratio, [8 * ratio, 6 * ratio]);
  for (const mask of look.masks) if (mask.judged) outline(pen, mask.outline, box, colour(verdict), 4 * ratio, []);
  const words = look.masks.filter((mask) => mask.phrase && mask.outline.length).sort((a, b) => a.judged - b.judged);
  for (const mask of words) label(pen, mask, box, mask.judged ? colour(verdict) : null, ratio);
}

function outline(pen, lines, box, colour, width, dash) {
  pen.lineJoin = "round";
  pen.setLineDash(dash);
  for (const [style, wide] of [["rgba(0,0,0,.65)", width + 2], [colour, width]]) {
    pen.strokeStyle = style;
    pen.lineWidth = wide;
    for (const line of lines) {
      pen.beginPath();
      line.forEach(([x, y], index) => pen[index ? "lineTo" : "moveTo"](box.x + x * box.w, box.y + y * box.h));
      pen.closePath();
      pen.stroke();
    }
  }
  pen.setLineDash([]);
}

function label(pen, mask, box, best, ratio) {
  const corners = mask.outline[0];
  const x = box.x + box.w * (corners.reduce((sum, corner) => sum + corner[0], 0) / corners.length);
  const y = box.y + box.h * Math.min(...corners.map((corner) => corner[1]));
  pen.font = `${best ? 600 : 400} ${(best ? 15 : 11) * ratio}px system-ui, sans-serif`;
  const words = mask.phrase.slice(0, 40), wide = pen.measureText(words).width + 10 * ratio, high = (best ? 22 : 17) * ratio;
  const left = Math.max(box.x, Math.min(box.x + box.w - wide, x - wide / 2)), top = Math.max(box.y, y - high - 3 * ratio);
  pen.fillStyle = best ? "#0b1520" : "rgba(11,21,32,.72)";
  pen.fillRect(left, top, wide, high);
  if (best) { pen.fillStyle = best; pen.fillRect(left, top, 4 * ratio, high); }
  pen.fillStyle = "#ffffff";
  pen.textBaseline = "middle";
  pen.fillText(words, left + 6 * ratio, top + high / 2);
}

// The live stream: the next picture is sent when this one is shown.
export class CameraStream {
  constructor(onPicture) {
    this.onPicture = onPicture;
    this.ended = true;
  }

  start() {
    if (!this.ended) return;
    this.ended = false;
    this.connect();
  }

  end() {
    this.ended = true;
    this.socket?.close();
  }

  connect() {
    if (this.ended) return;
    const socket = (this.socket = openSocket("/ws/camera"));
    socket.binaryType = "arraybuffer";
    socket.onmessage = async (event) => {
      try {
        this.onPicture(await createImageBitmap(new Blob([event.data.slice(8)], {type: "image/jpeg"})));
      } finally {
        if (socket.readyState === WebSocket.OPEN) socket.send("shown");
      }
    };
    socket.onclose = (event) => { if (!this.ended && event.code !== 4401) setTimeout(() => this.connect(), 1000); };
  }
}

// What is said under the picture: how old it is, or why there is none.
// hereMs: since the newest picture came to this page, which knows nothing of the robot's camera while its link is down.
export function pictureWords(robot, hereMs) {
  if (!robot) return "No picture yet.";
  if (robot.silent.camera) return robot.silent.camera;
  if (robot.camera_age_s === null || hereMs === Infinity) return "No picture yet.";
  const age = Math.max(robot.camera_age_s, hereMs / 1000);
  return age > LATE_S ? `No new picture for ${age.toFixed(1)} s.` : "Live.";
}
