// A page on a busy machine: every snapshot comes that late while acknowledgements come at once, and so does every paint.
((ms) => {
  const socket = Object.getOwnPropertyDescriptor(WebSocket.prototype, "onmessage");
  Object.defineProperty(WebSocket.prototype, "onmessage", {
    get: socket.get,
    set(listener) {
      const late = (event) => setTimeout(() => this.onmessage && listener(event), ms);
      const isSnapshot = (event) => typeof event.data === "string" && event.data.startsWith('{"type": "state"');
      socket.set.call(this, listener && ((event) => (isSnapshot(event) ? late(event) : listener(event))));
    },
  });
  const paint = window.requestAnimationFrame.bind(window);
  window.requestAnimationFrame = (draw) => setTimeout(() => paint(draw), ms);
})
