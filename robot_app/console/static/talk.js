// Hold to talk. What was heard goes into the ask line, to be read, corrected and asked like typed words.

import {$, element, shown, text} from "./dom.js";
import {openSocket} from "./socket.js";

const RATE_HZ = 16000;
const MOST_MS = 29000;
// Gain that adapts clips the first word; the other two take away what a recogniser can use.
const SOUND = {channelCount: 1, autoGainControl: false, noiseSuppression: false, echoCancellation: false};

export class Talk {
  constructor(say) {
    this.say = say;
    this.heard = 0;
    this.button = $("talk");
    this.button.addEventListener("pointerdown", (event) => { this.button.setPointerCapture(event.pointerId); this.begin(); });
    for (const end of ["pointerup", "pointercancel", "lostpointercapture", "blur"]) this.button.addEventListener(end, () => this.end());
    this.button.addEventListener("keydown", (event) => {
      if ((event.key === " " || event.key === "Enter") && !event.repeat) { event.preventDefault(); this.begin(); }
    });
    this.button.addEventListener("keyup", (event) => { if (event.key === " " || event.key === "Enter") this.end(); });
    $("ask-words").addEventListener("input", () => { if (!$("ask-words").value) this.heard = 0; });
  }

  show(operates) {
    shown(this.button, operates && Boolean(navigator.mediaDevices?.getUserMedia)); // HTTPS or localhost
  }

  async begin() {
    if (this.talking) return;
    this.talking = true;
    text(this.button, "Listening");
    this.onListen?.(); // nothing is said aloud meanwhile
    const mine = (this.utterance = {chunks: []});
    try {
      const stream = (mine.stream = await navigator.mediaDevices.getUserMedia({audio: SOUND}));
      const context = (mine.context = new AudioContext({sampleRate: RATE_HZ}));
      const socket = this.open(); // before the module is awaited: its events must not be missed
      await context.audioWorklet.addModule("/static/microphone.js");
      const node = new AudioWorkletNode(context, "microphone", {numberOfOutputs: 0, channelCount: 1, channelCountMode: "explicit"});
      node.port.onmessage = ({data}) => this.send(socket, data);
      context.createMediaStreamSource(stream).connect(node);
      mine.late = setTimeout(() => this.end(), MOST_MS);
      if (this.utterance !== mine) { // pressed anew meanwhile: that one counts
        this.close(mine);
        this.whenOpen(socket, () => socket.close());
      } else if (!this.talking) this.close(mine, socket);
      else mine.done = () => this.close(mine, socket);
    } catch (error) {
      this.close(mine);
      if (this.utterance === mine) this.end();
      this.say({ok: false, text: `The microphone cannot be used: ${error.message}`});
    }
  }

  end() {
    if (!this.talking) return;
    this.talking = false;
    text(this.button, "Hold to talk");
    this.utterance?.done?.();
  }

  close(mine, socket) {
    clearTimeout(mine.late);
    for (const track of mine.stream?.getTracks() || []) track.stop();
    if (mine.context && mine.context.state !== "closed") mine.context.close();
    if (socket) this.whenOpen(socket, () => socket.send("end"));
  }

  open() {
    const socket = openSocket("/ws/voice");
    socket.binaryType = "arraybuffer";
    socket.onmessage = ({data}) => { this.take(JSON.parse(data)); socket.close(); };
    socket.onerror = () => this.say({ok: false, text: "Nothing was heard: there is no link to the console."});
    return socket;
  }

  whenOpen(socket, act) {
    if (socket.readyState === WebSocket.OPEN) act();
    else if (socket.readyState === WebSocket.CONNECTING) socket.addEventListener("open", act, {once: true});
  }

  send(socket, block) {
    const pcm = Int16Array.from(block, (value) => Math.round(Math.max(-1, Math.min(1, value)) * 32767));
    this.whenOpen(socket, () => socket.send(pcm.buffer));
  }

  take(answer) {
    if (answer.type !== "heard") return this.say({ok: false, text: answer.text});
    const sure = answer.confidence === null ? "confidence unknown" : `confidence ${answer.confidence.toFixed(2)}`;
    if (answer.stop) return this.say({ok: true, text: `Heard “${answer.transcript}”: STOP.`});
    this.heard = answer.heard;
    $("ask-words").value = answer.transcript;
    $("ask-words").focus();
    this.say({ok: true, text: `Heard with ${sure}. Correct it if need be, then ask.`});
    const meant = answer.suggestions.map(({sentence}) => element("button", {
      type: "button", class: "quiet", onclick: () => { $("ask-words").value = sentence; $("meant").replaceChildren(); },
    }, `Did you mean: ${sentence}`));
    $("meant").replaceChildren(...meant);
  }
}
