// The question before motion, inline: what, how far, a ring that runs down, and the answers. No dialog.

import {$, attribute, shown, text} from "./dom.js";

export class Question {
  constructor(link, say) {
    Object.assign(this, {link, say});
    this.asked = null;
    $("answer-yes").addEventListener("click", () => this.answer("yes"));
    $("answer-no").addEventListener("click", () => this.answer("no"));
    $("answer-other").addEventListener("click", () => this.answer("not this one"));
    $("answer-why").addEventListener("click", () => this.toggleWhy());
  }

  // asked: of the operator, null where nothing is asked; epoch: of our lease, null where another commands.
  // mayAnswer: what somebody who does not command may do about it.
  show(asked, epoch, candidates, mayAnswer) {
    Object.assign(this, {epoch, mayAnswer});
    if (asked?.id !== this.asked?.id) this.open(asked, candidates);
    if (!asked) return;
    this.endsAt = performance.now() + 1000 * asked.left_s;
    const mine = Boolean(epoch) && this.link.open;
    for (const id of ["answer-yes", "answer-no"]) $(id).disabled = !mine || this.sent;
    shown($("answer-other"), asked.options.length > 0);
    $("answer-other").disabled = !mine || this.sent;
    this.tick();
  }

  open(asked, candidates) {
    this.asked = asked;
    this.sent = false;
    shown($("question"), Boolean(asked));
    if (!asked) return;
    const number = asked.options.find((each) => each.object_id === asked.object_id)?.number;
    const label = candidates?.find((each) => each.object_id === asked.object_id)?.label;
    const way = asked.path_length_m === null ? "" : `, ${asked.path_length_m.toFixed(1)} m`;
    text($("answer-yes"), number ? `Go to #${number}${way}` : "Go on");
    const doubt = asked.doubt ? `I am not sure: ${asked.doubt}. ` : ""; // as the sentence begins, for who only hears it
    text($("question-doubt"), doubt);
    shown($("question-doubt"), Boolean(doubt));
    text($("question-words"), asked.sentence.startsWith(doubt) ? asked.sentence.slice(doubt.length) : asked.sentence);
    text($("question-why"), "");
    attribute($("answer-why"), "aria-expanded", "false");
    shown($("answer-why"), Boolean(asked.because));
    attribute($("answer-yes"), "aria-label", number && label ? `Go to #${number}${way}: ${label}` : null);
  }

  tick() {
    if (!this.asked) return;
    const left = Math.max(0, this.endsAt - performance.now()) / 1000;
    attribute($("ring"), "stroke-dashoffset", (100 * (1 - left / this.asked.timeout_s)).toFixed(1));
    const wait = this.sent ? "Sent." : this.epoch ? "" : ` ${this.mayAnswer}`;
    text($("question-left"), `${Math.ceil(left)} s left.${wait} `);
  }

  toggleWhy() {
    const open = $("answer-why").getAttribute("aria-expanded") !== "true";
    attribute($("answer-why"), "aria-expanded", open);
    text($("question-why"), open ? this.asked.because : "");
  }

  async answer(word, number = null) {
    const asked = this.asked;
    if (!asked || this.sent) return;
    this.sent = true;
    const answer = await this.link.command({type: "answer", epoch: this.epoch ?? 0, question: asked.id, memory_hash: asked.memory_hash, word, number});
    this.say(answer);
    if (!answer.ok && this.asked === asked) this.sent = false;
  }
}
