// The robot's sentences aloud, on the page that commands: one after the other, never while this page listens.
// What the console no longer lists (a STOP, somebody speaks, too much came after it) is cut off.

export class Speech {
  constructor(listening) {
    this.listening = listening; // whether the talk button is held
    this.seen = null; // the last sentence's number; what was said before this page came is not said again
    this.waiting = [];
    this.saying = null;
  }

  show(speech, commands) {
    if (!speech) return;
    const fresh = this.seen === null ? [] : speech.said.filter(({n}) => n > this.seen);
    this.seen = speech.n;
    const listed = ({n}) => speech.said.some((each) => each.n === n);
    this.waiting = this.waiting.filter(listed);
    if (this.saying && !listed(this.saying)) this.cut();
    if (!commands || this.listening() || !navigator.userActivation?.hasBeenActive) return;
    this.waiting.push(...fresh.map((each) => ({...speech, ...each})));
    this.next();
  }

  async next() {
    if (this.saying || !this.waiting.length) return;
    const mine = (this.saying = this.waiting.shift());
    await (mine.sound ? this.play(mine) : this.byTheBrowser(mine));
    if (mine !== this.saying) return;
    this.saying = null;
    this.next();
  }

  async play(mine) {
    const answer = await fetch(`/api/speech/${mine.n}.wav`, {credentials: "same-origin"}).catch(() => null);
    if (answer?.status === 503) return this.byTheBrowser(mine);
    if (!answer?.ok) return; // too late for it, or the link is down, which is seen elsewhere
    this.context ||= new AudioContext();
    const sound = await this.context.decodeAudioData(await answer.arrayBuffer());
    if (mine !== this.saying || this.listening()) return;
    const source = (this.source = new AudioBufferSourceNode(this.context, {buffer: sound}));
    source.connect(this.context.destination);
    const ended = new Promise((resolve) => source.addEventListener("ended", resolve));
    source.start();
    await ended;
  }

  // Only a voice that lies on this machine: others send the words away.
  byTheBrowser({words, language}) {
    const voice = globalThis.speechSynthesis?.getVoices().find((each) => each.localService && each.lang.toLowerCase().startsWith(language.toLowerCase()));
    if (!voice) return;
    const utterance = Object.assign(new SpeechSynthesisUtterance(words), {voice, lang: voice.lang});
    const ended = new Promise((resolve) => { utterance.onend = utterance.onerror = resolve; });
    speechSynthesis.speak(utterance);
    return ended;
  }

  hush() {
    this.waiting = [];
    this.cut();
  }

  cut() {
    this.saying = null;
    this.source?.stop();
    this.source = null;
    globalThis.speechSynthesis?.cancel();
  }
}
