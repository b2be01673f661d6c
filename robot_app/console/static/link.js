// The live connection. A command is sent now or not at all: nothing waits for a link that may come back.

import {openSocket} from "./socket.js";

const RETRY_MS = 500;
const DEAD_MS = 2500; // ten snapshots a second: a socket that is silent for so long leads nowhere
const ANSWER_MS = 3000;
// Why the console closed a socket; the others went away by themselves.
const REFUSED = {4408: "This page sent too much.", 4429: "Too many pages look at this robot: close some."};
const PAGE = Array.from(crypto.getRandomValues(new Uint8Array(12)), (byte) => byte.toString(16).padStart(2, "0")).join("");

export class Link {
  constructor({onState, onChange, onLoggedOut}) {
    Object.assign(this, {onState, onChange, onLoggedOut});
    this.open = false;
    this.seen = -1; // the snapshot that is painted
    this.heardAt = 0;
    this.waiting = new Map();
    this.next = 1;
    this.state = {};
    this.ended = false;
    this.refused = "";
  }

  start() {
    this.ended = false;
    this.connect();
  }

  end() {
    this.ended = true;
    this.socket?.close();
  }

  connect() {
    if (this.ended) return;
    const socket = (this.socket = openSocket(`/ws?page=${PAGE}`));
    this.triedAt = performance.now();
    socket.onopen = () => { this.open = true; this.state = {}; this.heardAt = performance.now(); this.onChange(); };
    socket.onmessage = (event) => this.take(JSON.parse(event.data));
    socket.onclose = (event) => this.closed(event);
  }

  // A network that went away closes no socket: one that fell silent is given up, and another one tried.
  check() {
    const since = performance.now() - Math.max(this.heardAt, this.triedAt);
    if (this.ended || since < DEAD_MS || this.retrying) return;
    const socket = this.socket;
    socket.onopen = socket.onmessage = socket.onclose = null;
    socket.close();
    this.closed({code: 0});
  }

  closed(event) {
    this.open = false;
    this.refused = REFUSED[event.code] || "";
    for (const give of this.waiting.values()) give({ok: false, text: "No answer: the link went down. Look at the robot."});
    this.waiting.clear();
    this.onChange();
    if (event.code === 4401) this.onLoggedOut();
    else if (!this.ended) {
      this.retrying = true;
      setTimeout(() => { this.retrying = false; this.connect(); }, RETRY_MS);
    }
  }

  take(message) {
    if (message.type === "ack") {
      this.waiting.get(message.id)?.(message);
      this.waiting.delete(message.id);
      return;
    }
    this.heardAt = performance.now();
    this.refused = "";
    this.state = {...this.state, ...message};
    this.onState(this.state);
  }

  // Resolves to {ok, text}. Only what the other end acknowledged is done.
  send(message) {
    if (!this.open || this.socket.readyState !== WebSocket.OPEN) {
      return Promise.resolve({ok: false, text: "Not sent: there is no link to the console."});
    }
    const id = this.next++;
    return new Promise((resolve) => {
      const late = setTimeout(() => {
        this.waiting.delete(id);
        resolve({ok: false, text: "No answer from the console. Look at the robot."});
      }, ANSWER_MS);
      this.waiting.set(id, (answer) => { clearTimeout(late); resolve(answer); });
      this.socket.send(JSON.stringify({...message, id}));
    });
  }

  command(message) {
    return this.send({...message, seen: this.seen});
  }

  // A sign of life: this snapshot is on the screen.
  beat(seen) {
    if (!this.open || this.socket.readyState !== WebSocket.OPEN || this.socket.bufferedAmount > 4096) return;
    this.socket.send(JSON.stringify({type: "beat", seen}));
  }

  get silentMs() {
    return this.heardAt ? performance.now() - this.heardAt : Infinity;
  }
}
