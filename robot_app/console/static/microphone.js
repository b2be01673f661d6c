// On the audio thread: every block as it comes, to the page.

class Microphone extends AudioWorkletProcessor {
  process([channels]) {
    if (channels?.[0]?.length) this.port.postMessage(channels[0].slice());
    return true;
  }
}

registerProcessor("microphone", Microphone);
