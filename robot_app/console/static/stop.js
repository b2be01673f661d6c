// STOP: one tap, Esc or Ctrl+. from anywhere, typing or not. It says "heard" only when the other end said so.

import {$, postJson, text} from "./dom.js";

const SHOWN_MS = 4000;
const LATE_MS = 1000; // from here on a person reaches for the remote, whatever may still come
const LOST = "NOT HEARD: use the remote";
const RETRIES = 20;
const RETRY_MS = 250;

export class Stop {
  constructor(link) {
    this.link = link;
    this.reaches = true; // whether the console's own link to the robot is well
    this.button = $("stop");
    this.words = $("stop-words");
    this.button.addEventListener("pointerdown", (event) => { if (event.button === 0) this.press(); });
    this.button.addEventListener("click", (event) => { if (event.detail === 0) this.press(); }); // Enter, Space, assistive tools
    window.addEventListener("keydown", (event) => this.key(event), {capture: true});
  }

  key(event) {
    if ($("app").hidden || event.repeat) return;
    if (event.key === "Escape" || (event.key === "." && (event.ctrlKey || event.metaKey))) {
      event.preventDefault();
      event.stopPropagation();
      this.press();
    }
  }

  async press() {
    performance.mark("stop-pressed");
    this.show("sent", "Stopping …");
    const pressed = (this.pressed = Symbol("press"));
    this.late = setTimeout(() => this.show("lost", LOST), LATE_MS);
    for (let attempt = 0; attempt < RETRIES; attempt++) {
      const answer = await this.send();
      if (pressed !== this.pressed) return;
      if (answer.ok) return this.heard();
      this.show("lost", LOST);
      await new Promise((resume) => setTimeout(resume, RETRY_MS));
    }
  }

  // By the console; what it cannot tell a robot that it has lost, it does not show as done.
  heard() {
    if (!this.reaches) return this.show("lost", "Heard here: use the remote");
    this.show("heard", "STOP was heard");
    this.calm = setTimeout(() => this.show("", "Software stop · Esc"), SHOWN_MS);
  }

  async send() {
    const answer = await this.link.send({type: "stop"});
    if (answer.ok || this.link.open) return answer;
    return postJson("/api/stop").then(() => ({ok: true})).catch(() => ({ok: false}));
  }

  show(state, words) {
    clearTimeout(this.calm);
    clearTimeout(this.late);
    this.button.dataset.state = state;
    text(this.words, words);
  }
}
