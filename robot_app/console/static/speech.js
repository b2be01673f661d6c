// The robot's sentences aloud, on the page that commands. Never while this page listens, never twice, never late.

export class Speech {
  constructor(listening) {
    this.listening = listening; // whether the talk button is held
    this.seen = null; // the last sentence's number; what was said before this page came is not said again
  }

  show(speech, commands) {
    if (!speech) return;
    const {n, words} = speech, fresh = this.seen !== null && n !== this.seen;
    this.seen = n;
    if (!words) this.hush();
    else if (fresh && commands && !this.listening() && navigator.userActivation?.hasBeenActive) this.say(speech);
  }

  say(speech) {
    this.hush();
    const mine = (this.saying = Symbol("sentence"));
    if (speech.sound) this.play(speech, mine);
    else this.byTheBrowser(speech);
  }

  async play(speech, mine) {
    const answer = await fetch(`/api/speech/${speech.n}.wav`, {credentials: "same-origin"}).catch(() => null);
    if (answer?.status === 503) this.byTheBrowser(speech);
    if (!answer?.ok) return; // a newer sentence is there already, or the link is down, which is seen elsewhere
    this.context ||= new AudioContext();
    const sound = await this.context.decodeAudioData(await answer.arrayBuffer());
    if (mine !== this.saying || this.listening()) return;
    const source = (this.source = new AudioBufferSourceNode(this.context, {buffer: sound}));
    source.connect(this.context.destination);
    source.start();
  }

  // Only a voice that lies on this machine: others send the words away.
  byTheBrowser({words, language}) {
    const voice = globalThis.speechSynthesis?.getVoices().find((each) => each.localService && each.lang.toLowerCase().startsWith(language.toLowerCase()));
    if (!voice) return;
    const utterance = new SpeechSynthesisUtterance(words);
    Object.assign(utterance, {voice, lang: voice.lang});
    speechSynthesis.speak(utterance);
  }

  hush() {
    this.saying = null;
    this.source?.stop();
    this.source = null;
    globalThis.speechSynthesis?.cancel();
  }
}
