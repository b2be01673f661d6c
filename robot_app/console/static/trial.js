// One recorded trial, from its file alone: plan, camera, candidates, checks and decisions at every step.

import {Picture} from "./camera.js";
import {attribute, clockTime, dayTime, element, getJson, postJson, text} from "./dom.js";
import {drawCandidates, drawChecks} from "./panels.js";
import {Plan, loadSite} from "./plan.js";
import {stateWords} from "./words.js";

const PLAY_MS = 100;

export class TrialPage {
  constructor(box, name) {
    Object.assign(this, {box, name, url: `/api/trials/${encodeURIComponent(name)}`, at: 0, pictures: new Map()});
  }

  async start() {
    this.box.replaceChildren(element("p", {class: "faint", role: "status"}, `Reading ${this.name} …`));
    try {
      this.trial = await getJson(this.url);
      if (!this.trial.steps.length) throw new Error(`${this.name} was cut off before anything happened in it.`);
    } catch (error) {
      this.box.replaceChildren(element("p", {class: "refused", role: "alert"}, error.message), element("a", {href: "#trials"}, "All trials"));
      return;
    }
    this.build();
    this.plan.setSite(...(await loadSite(this.trial.site || {objects: [], rooms: [], keep_out: [], allowed: []}, `${this.url}/grid.png`, this.trial.grid)));
    await this.go(this.trial.steps.length - 1);
  }

  end() {
    this.ended = true;
    clearInterval(this.playing);
  }

  build() {
    const {trial} = this;
    this.words = element("h1", {class: "state"});
    this.reason = element("span", {class: "reason"});
    const head = element("div", {class: "head"}, element("a", {href: "#trials"}, "← All trials"), this.words, this.reason,
      element("span", {class: "faint"}, dayTime(trial.started_ms)), element("a", {href: `${this.url}/export`, download: ""}, "Export"));
    const canvas = element("canvas", {role: "img", "aria-label": "No picture yet"}), caption = element("p", {class: "faint caption"});
    const map = element("canvas", {role: "img", tabindex: "0", "aria-label": "Plan of the site"});
    this.candidates = element("ol", {"aria-label": "Candidates"});
    this.checks = element("div");
    this.checksFor = element("span", {class: "faint"});
    this.steps = element("ol", {"aria-label": "Decisions over time"}, ...trial.steps.map((step, index) => element("li", {}, this.stepButton(step, index))));
    this.slider = element("input", {type: "range", min: "0", max: String(trial.steps.length - 1), value: "0", "aria-label": "Time in the trial", oninput: () => this.go(Number(this.slider.value))});
    this.play = element("button", {type: "button", onclick: () => this.toggle()}, "Play");
    this.time = element("span");
    this.box.replaceChildren(element("div", {class: "one"}, head,
      panel("camera", "Camera", canvas, caption), panel("plan", "Plan", map), panel("candidates", "Candidates", this.candidates),
      panel("checks", "Checks on arrival", this.checks), panel("steps", "Decisions", this.steps), this.notes(),
      element("div", {class: "time"}, this.play, this.slider, this.time)));
    this.picture = new Picture(canvas, caption);
    this.plan = new Plan(map);
  }

  stepButton(step, index) {
    return element("button", {type: "button", onclick: () => this.go(index)}, element("span", {class: "faint"}, `${(step.at_ms / 1000).toFixed(1)} s`), element("span", {}, `${step.kind}: ${step.text}`));
  }

  notes() {
    const list = element("ol", {"aria-label": "Notes"}), words = element("input", {"aria-label": "Note", placeholder: "Add a note", maxlength: "2000"});
    const draw = (notes) => list.replaceChildren(...notes.map((note) => element("li", {}, element("span", {class: "faint"}, `${note.who}, ${clockTime(note.at_ms)}: `), note.text)));
    const refused = element("span", {class: "refused", role: "alert"});
    const form = element("form", {onsubmit: async (event) => {
      event.preventDefault();
      try {
        draw((await postJson(`${this.url}/notes`, {text: words.value})).notes);
        words.value = "";
        text(refused, "");
      } catch (error) { text(refused, error.message); }
    }}, words, element("button", {type: "submit"}, "Add"));
    draw(this.trial.notes);
    return panel("notes", "Notes", list, form, refused);
  }

  toggle() {
    clearInterval(this.playing);
    const starts = !this.playing;
    this.playing = starts ? setInterval(() => this.tick(), PLAY_MS) : null;
    this.playedMs = this.at >= this.trial.steps.length - 1 ? 0 : this.trial.steps[this.at].at_ms;
    if (starts && this.playedMs === 0) this.go(0);
    text(this.play, starts ? "Pause" : "Play");
  }

  tick() {
    this.playedMs += PLAY_MS;
    const due = this.trial.steps.findLastIndex((step) => step.at_ms <= this.playedMs);
    if (due > this.at) this.go(due);
    if (due >= this.trial.steps.length - 1) this.toggle();
  }

  // One view is asked for at a time; the newest wish is served next.
  async go(index) {
    this.at = index;
    this.slider.value = String(index);
    if (this.asking) return;
    this.asking = true;
    try {
      while (this.drawn !== this.at && !this.ended) {
        const step = this.at;
        await this.draw(step, await getJson(`${this.url}/view/${step}`));
        this.drawn = step;
      }
    } catch (error) {
      text(this.reason, `This step cannot be shown: ${error.message}`);
    } finally { this.asking = false; }
  }

  async draw(index, mission) {
    const step = this.trial.steps[index], [words, mood, reason] = stateWords(mission);
    text(this.words, words);
    attribute(this.words, "data-mood", mood);
    text(this.reason, reason);
    text(this.time, `${(step.at_ms / 1000).toFixed(1)} s`);
    attribute(this.slider, "aria-valuetext", `${(step.at_ms / 1000).toFixed(1)} seconds: ${step.text}`);
    drawCandidates(this.candidates, mission, {onSelect: () => {}, hands: null});
    const look = mission.looks.at(-1) || null;
    drawChecks(this.checks, this.checksFor, look);
    this.plan.show({robot: mission.robot, track: mission.track, path: mission.path, goal: mission.goal, candidates: mission.candidates, chosen: mission.chosen});
    this.mark(index);
    const judged = look && look.frame_stamp_ns === step.frame ? look : null;
    const image = step.frame ? await this.image(step.frame) : null;
    this.picture.show(image, judged);
    this.picture.say(image ? (judged ? `What was judged: ${judged.verdict}.` : "The last picture that the mission used.") : "No picture yet.");
  }

  mark(index) {
    this.current?.removeAttribute("aria-current");
    this.current = this.steps.children[index].firstChild;
    attribute(this.current, "aria-current", "step");
    const list = this.steps.getBoundingClientRect(), row = this.current.getBoundingClientRect();
    if (row.top < list.top) this.steps.scrollTop -= list.top - row.top; // the list alone: on a phone the page stays where it is
    else if (row.bottom > list.bottom) this.steps.scrollTop += row.bottom - list.bottom;
  }

  async image(stamp) {
    if (!this.pictures.has(stamp)) {
      const response = await fetch(`${this.url}/frame/${stamp}.jpg`, {credentials: "same-origin"});
      this.pictures.set(stamp, response.ok ? await createImageBitmap(await response.blob()) : null);
    }
    return this.pictures.get(stamp);
  }
}

function panel(kind, title, ...children) {
  return element("section", {class: `panel ${kind}`, "aria-label": title}, element("div", {class: "head"}, element("h2", {}, title)), ...children);
}
