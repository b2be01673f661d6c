// The recorded trials: a list to filter, and one trial to scrub through.

import {$, dayTime, element, getJson, shown, text} from "./dom.js";
import {TrialPage} from "./trial.js";
import {endWords} from "./words.js";

const AGAIN_MS = 2000;

export class Trials {
  constructor() {
    this.box = $("trials");
    this.rows = [];
  }

  async show(name) {
    this.page?.end();
    this.page = null;
    this.active = true;
    if (name) {
      this.page = new TrialPage(this.box, name);
      await this.page.start();
    } else {
      this.frameList();
      await this.load();
    }
  }

  end() {
    this.active = false;
    clearTimeout(this.timer);
    this.page?.end();
    this.page = null;
    this.box.replaceChildren();
  }

  frameList() {
    this.words = element("input", {type: "search", id: "trial-words", placeholder: "Filter by words", "aria-label": "Filter by words", oninput: () => this.draw()});
    this.outcome = element("select", {id: "trial-outcome", "aria-label": "Filter by outcome", onchange: () => this.draw()},
      ...["", "CONFIRMED", "FAILED", "NAVIGATION_FAILED", "CANCELLED", "FAULT", "UNFINISHED", "broken"].map((each) => element("option", {value: each}, each ? (each === "broken" ? "Cannot be read" : endWords(each)[0]) : "Every outcome")));
    this.count = element("span", {class: "faint", role: "status"});
    this.list = element("ol", {class: "rows", role: "list", "aria-label": "Trials, the newest first", tabindex: "0"});
    this.box.replaceChildren(element("div", {class: "filters"}, element("h1", {class: "hidden"}, "Trials"), this.words, this.outcome, this.count), this.list);
  }

  async load() {
    if (!this.active || this.page) return;
    try {
      this.rows = (await getJson("/api/trials")).trials;
      this.draw();
      this.failed = false;
    } catch (error) {
      this.failed = true;
      text(this.count, error.message);
    }
    clearTimeout(this.timer);
    if (this.failed || this.rows.some((row) => row.reading)) this.timer = setTimeout(() => this.load(), AGAIN_MS);
  }

  draw() {
    const words = this.words.value.toLowerCase().split(/\s+/).filter(Boolean), outcome = this.outcome.value;
    const found = this.rows.filter((row) => matches(row, words, outcome));
    const key = JSON.stringify([found.length, found[0]?.name, found.filter((row) => row.reading).length, words, outcome]);
    text(this.count, this.rows.length ? `${found.length} of ${this.rows.length}` : "No mission was recorded here yet.");
    if (key === this.key && this.list.childElementCount) return;
    this.key = key;
    this.list.replaceChildren(...found.map(rowOf));
    shown(this.list, true);
  }
}

function matches(row, words, outcome) {
  if (outcome && (outcome === "broken" ? !row.broken : row.outcome !== outcome)) return false;
  const text = [row.sentence, row.reason, row.who, row.name, row.broken, ...(row.candidates || []).flat()].join(" ").toLowerCase();
  return words.every((word) => text.includes(word));
}

function rowOf(row) {
  if (row.reading || row.broken) {
    const why = row.reading ? "being read …" : `cannot be read: ${row.broken}`;
    return linkTo(row,
      element("span", {class: "faint"}, dayTime(row.started_ms)), element("span", {}, row.name), element("span", {class: "faint"}, ""), element("span", {class: "reason"}, why));
  }
  const [words, mood] = endWords(row.outcome), kind = mood === "good" ? "confirmed" : row.outcome === "CANCELLED" ? "declined" : "rejected";
  return linkTo(row,
    element("span", {class: "faint"}, dayTime(row.started_ms)), element("span", {}, `“${row.sentence}”`),
    element("span", {class: "word", "data-status": kind}, `${mood === "good" ? "✓" : "✕"} ${words}`), element("span", {class: "reason"}, row.reason));
}

// The name is said once more: a browser does not lay out the rows that are out of sight, and reads nothing from them.
function linkTo(row, ...cells) {
  const name = cells.map((each) => each.textContent).filter(Boolean).join(", ");
  return element("li", {}, element("a", {class: "trial", href: `#trials/${encodeURIComponent(row.name)}`, "aria-label": name}, ...cells));
}
