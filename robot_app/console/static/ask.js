// The ask line, and who commands.

import {$, attribute, shown, text} from "./dom.js";
import {Talk} from "./talk.js";

const SMALL = "(max-width: 820px), (max-height: 500px)";

export class AskLine {
  constructor(link) {
    this.link = link;
    this.answer = $("ask-answer");
    this.talk = new Talk((answer) => this.say(answer));
    $("ask").addEventListener("submit", (event) => { event.preventDefault(); this.ask(); });
    // Where the button waits for the command, Enter still asks: to be refused in words, and to stop in words.
    $("ask-words").addEventListener("keydown", (event) => { if (event.key === "Enter" && $("ask-send").disabled) this.ask(); });
    $("take").addEventListener("click", () => this.take());
    $("release").addEventListener("click", async () => this.say(await link.command({type: "release"})));
  }

  show(state) {
    const {you, operator} = state;
    this.epoch = you?.epoch ?? null;
    this.lease = operator?.lease;
    const operates = you?.role === "operator", mine = Boolean(this.epoch);
    $("ask-words").disabled = !operates;
    attribute($("ask"), "data-mine", mine ? "yes" : null);
    this.talk.show(operates);
    $("ask-words").placeholder = !operates ? "You are a viewer: you may look, and STOP" : mine ? "Take me to the …" : "Take command to ask";
    $("ask-send").disabled = !mine || !this.link.open;
    shown($("take"), operates && !mine);
    text($("take"), this.lease ? "Take over" : "Take command");
    $("take").disabled = !this.link.open;
    shown($("release"), mine && !operator.mission);
    const waiting = operator?.waiting.length || 0;
    if (!this.said) text(this.answer, waiting ? `${waiting} waiting: “${operator.waiting[0].sentence}”` : "");
  }

  // Only what was acknowledged is shown as done; a refusal stays until the next command.
  say({ok, text: words}) {
    this.said = true;
    text(this.answer, words);
    this.answer.className = `answer ${ok ? "faint" : "refused"}`;
    clearTimeout(this.calm);
    this.calm = setTimeout(() => { this.said = false; this.answer.className = "answer faint"; }, ok ? 4000 : 12000);
  }

  async take() {
    this.say(await this.link.command({type: "take", over: Boolean(this.lease)}));
  }

  async ask() {
    const words = $("ask-words").value.trim();
    if (!words) return;
    const answer = await this.link.command({type: "ask", epoch: this.epoch ?? 0, text: words, heard: this.talk.heard});
    this.say(answer);
    if (answer.ok) {
      $("ask-words").value = "";
      if (matchMedia(SMALL).matches) $("ask-words").blur(); // the keyboard on the screen makes room for the question
      $("meant").replaceChildren();
      this.talk.heard = 0;
    }
  }
}
