// Candidates, evidence, the three checks: the same on the live page and in a recorded trial.

import {element, getJson, metres, text} from "./dom.js";
import {STATUS_WORDS, statusKind} from "./words.js";

// hands: null where nothing can be done now, else {take(number), leave(number)}.
export function drawCandidates(list, mission, {onSelect, hands, selected}) {
  const candidates = mission?.candidates || [];
  list.replaceChildren(...candidates.map((each) => candidateRow(each, mission, {onSelect, hands, selected})));
}

function candidateRow(each, mission, {onSelect, hands, selected}) {
  const kind = statusKind(each.status), current = each.object_id === mission.chosen && kind !== "confirmed";
  const number = each.number ? String(each.number) : {confirmed: "✓", rejected: "✕"}[kind] || "–";
  const row = element("li", {class: "candidate", "data-status": each.status, "data-current": current || each.object_id === selected},
    element("span", {class: "number", "aria-hidden": "true"}, number),
    element("button", {type: "button", class: "name", onclick: () => onSelect(each.object_id), "aria-label": `Candidate ${number}: ${each.label}, evidence`}, each.label),
    element("span", {class: "score", title: "score"}, each.score.toFixed(2)));
  if (hands && each.number && kind !== "confirmed") row.append(handsOf(each, current, hands));
  row.append(about(each, kind, current, mission));
  return row;
}

function handsOf(each, current, hands) {
  const take = element("button", {type: "button", class: "small", onclick: () => hands.take(each.number), "aria-label": `Take candidate ${each.number}, ${each.label}`}, "Take");
  const leave = element("button", {type: "button", class: "small", onclick: () => hands.leave(each.number), "aria-label": `Leave out candidate ${each.number}, ${each.label}`}, "Leave out");
  return element("span", {class: "hands"}, current ? null : take, leave);
}

function about(each, kind, current, mission) {
  const word = element("span", {class: "word", "data-status": kind}, current && kind === "chosen" ? "▶ this one" : STATUS_WORDS[each.status] ?? "");
  const parts = [];
  if (current && mission.path_length_m !== null) parts.push(metres(mission.path_length_m));
  if (each.language !== null) parts.push(`language ${each.language.toFixed(2)}`);
  if (each.visual !== null) parts.push(`looks ${each.visual.toFixed(2)}`);
  if (each.because && kind !== "chosen") parts.push(each.because);
  return element("span", {class: "about"}, word, word.textContent ? " " : "", parts.join(" · "));
}

export class Evidence {
  constructor(box, title) {
    Object.assign(this, {box, title, shown: null, cards: new Map()});
  }

  async show(objectId, mission) {
    const key = JSON.stringify([objectId, (mission?.candidates || []).map((each) => [each.object_id, each.number, each.score])]);
    if (objectId === null || objectId === undefined || key === this.shown) return;
    this.shown = key;
    try {
      if (!this.cards.has(objectId)) this.cards.set(objectId, await getJson(`/api/objects/${objectId}`));
      if (this.shown === key) this.draw(this.cards.get(objectId), mission);
    } catch (error) {
      this.shown = null;
      text(this.title, "");
      this.box.replaceChildren(element("p", {class: "faint"}, error.message));
    }
  }

  draw(card, mission) {
    text(this.title, card.room ? `in the ${card.room}` : "");
    const best = Math.max(...card.phrases.map((each) => each.support), 1e-9);
    const named = card.phrases.map((each) => {
      const share = element("span");
      share.style.width = `${(100 * each.support) / best}%`;
      return element("li", {class: "phrase"}, element("span", {}, each.phrase), element("span", {class: "number"}, each.support.toFixed(1)), element("span", {class: "share"}, share));
    });
    const more = card.more_phrases ? element("p", {class: "faint"}, `and ${card.more_phrases} more`) : null;
    const crop = card.crop ? element("img", {src: `/api/objects/${card.object_id}/crop.jpg`, alt: `What the map's best view of ${card.label || "it"} looked like`, loading: "lazy"}) : element("span", {class: "faint"}, "no crop was kept");
    this.box.replaceChildren(element("div", {class: "evidence-card"}, crop,
      element("div", {}, element("h3", {}, card.label || `object ${card.object_id}`),
        element("p", {class: "faint"}, `Seen ${card.seen} times from ${card.frames} frames, ${card.trust}.`)),
      element("p", {class: "rival"}, rivalWords(card.object_id, mission)),
      element("ol", {class: "phrases", "aria-label": "What it was called, by support"}, ...named), more));
  }
}

// Who came next, and why it lost: what the scores say.
function rivalWords(objectId, mission) {
  const ranked = (mission?.candidates || []).filter((each) => each.number);
  const own = ranked.find((each) => each.object_id === objectId), rival = ranked.find((each) => each.object_id !== objectId);
  if (!own) return "";
  if (!rival) return `It scores ${own.score.toFixed(2)}; there is no other candidate.`;
  const beats = own.score >= rival.score ? "before" : "after";
  const parts = [["language", own.language, rival.language], ["looks", own.visual, rival.visual]]
    .filter(([, a, b]) => a !== null && b !== null).map(([name, a, b]) => `${name} ${a.toFixed(2)} to ${b.toFixed(2)}`);
  return `${own.score.toFixed(2)}, ${beats} ${rival.label} with ${rival.score.toFixed(2)}${parts.length ? ` (${parts.join(", ")})` : ""}.`;
}

const CHECKS = [
  ["visibility", "Is enough of it in view?", (value, limit) => value >= limit, "at least"],
  ["semantic", "Is it what was asked for?", (value, limit) => value > limit, "more than"],
  ["geometric", "Is it where the map says?", (value, limit) => value >= limit, "at least"],
];

export function drawChecks(box, title, look) {
  if (!look) {
    text(title, "");
    box.replaceChildren(element("p", {class: "faint"}, "The robot has not looked at a candidate yet."));
    return;
  }
  const good = look.verdict === "confirmed";
  text(title, `object ${look.object_id}`);
  box.replaceChildren(...CHECKS.map(([name, asks, passes, needs], index) => checkRow(index + 1, asks, look[name], passes, needs)),
    ...relativeLines(look.relative).map((line) => element("p", {class: "faint"}, line)), element("p", {}, element("span", {class: "word", "data-status": good ? "confirmed" : "rejected"}, good ? "✓ confirmed" : `✕ ${look.verdict}`), ` ${look.reason}`));
}

// What the relative check held against what; nothing under the paper's.
function relativeLines(relative) {
  if (!relative) return [];
  const called = relative.called === null ? "without a name" : `called “${relative.called}”`;
  const rival = relative.looks_like ? `, like “${relative.looks_like}” ${relative.rival_like.toFixed(2)}` : "";
  const lead = relative.lead === null ? "nothing else left on the map" : `${signed(relative.lead)} over object ${relative.rival}`;
  return [`From near: ${called}, like the words ${relative.asked_like.toFixed(2)}${rival}; contrast ${signed(relative.contrast)}`, `Against the map: ${lead}`];
}

function signed(value) {
  return `${value < 0 ? "−" : "+"}${Math.abs(value).toFixed(2)}`;
}

function checkRow(number, asks, check, passes, needs) {
  const measured = check.value !== null, passed = measured && passes(check.value, check.threshold);
  const value = element("span", {class: "value"}), threshold = element("span", {class: "threshold"});
  value.style.width = `${100 * Math.max(0, Math.min(1, check.value || 0))}%`;
  threshold.style.left = `${100 * check.threshold}%`;
  const words = measured ? `${passed ? "✓" : "✕"} ${check.value.toFixed(2)}, needs ${needs} ${check.threshold.toFixed(2)}` : "not measured";
  return element("div", {class: "check", "data-passes": measured ? (passed ? "yes" : "no") : "unknown"},
    element("div", {class: "line"}, element("span", {}, `${number}. ${asks}`), element("span", {}, words)),
    element("div", {class: "track", "aria-hidden": "true"}, value, threshold));
}
