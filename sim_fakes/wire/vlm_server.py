"""A stand-in for a served vision-language model: speaks /v1/models and /v1/chat/completions, answers from a table.

    python -m sim_fakes.wire.vlm_server --answers answers.json --port 8000

    python -m sim_fakes.wire.vlm_server --recording walk.mcap --perception walk.perception.jsonl --port 8000

ANSWERS.json maps the sha256 of a picture's bytes, as sent, to the reply's text; "*" is the reply to any other picture.
Of a recording it says what its recorded perception says.
Requests misbehave as --behave says, one word a request, then all is well. Every request leaves a line in --log.
"""

from __future__ import annotations

import argparse
import base64
import hashlib
import json
import os
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

SERVED_MODEL = "stand-in-vl"


class BadRequest(ValueError):
    """Not what an OpenAI-compatible vision server takes."""


class StandIn(ThreadingHTTPServer):
    """The server and its table. `behaviours` is consumed request by request."""

    daemon_threads = True

    def __init__(self, port: int, answers: dict[str, str], model: str, key: str | None, log: Path | None) -> None:
        super().__init__(("127.0.0.1", port), Handler)
        self.answers, self.model, self.key, self._log = answers, model, key, log
        self.behaviours: Iterator[str] = iter(())
        self.delay_s = 0.0
        self._lock = threading.Lock()
        self._busy, self._idle = 0, threading.Condition()

    @contextmanager
    def at_work(self) -> Iterator[None]:
        """Around an answer, to its last byte and its line in the log."""
        with self._idle:
            self._busy += 1
        yield
        with self._idle:
            self._busy -= 1
            self._idle.notify_all()

    def die(self) -> None:
        """Like kill -9, once no other answer is half sent: which ones were given is then known."""
        with self._idle:
            self._idle.wait_for(lambda: self._busy == 1)
            os._exit(1)

    def next_behaviour(self) -> str:
        with self._lock:
            return next(self.behaviours, "ok")

    def note(self, **facts: Any) -> None:
        if self._log is not None:
            with self._lock, self._log.open("a") as file:
                file.write(json.dumps(facts) + "\n")


class Handler(BaseHTTPRequestHandler):
    """One connection."""

    protocol_version = "HTTP/1.1"
    server: StandIn
    _answering: dict[str, str] | None = None  # the question whose answer is on its way

    def do_GET(self) -> None:
        if self._authorized() and self.path == "/v1/models":
            self._send(200, {"object": "list", "data": [{"id": self.server.model, "object": "model", "created": 0}]})
        elif self._authorized():
            self._send(404, _error("there is nothing here"))

    def do_POST(self) -> None:
        body = self.rfile.read(int(self.headers.get("content-length", 0)))
        if not self._authorized():
            return
        try:
            request = json.loads(body)
            picture = picture_of(request)
        except (ValueError, LookupError, TypeError) as error:
            self._send(400, _error(str(error)))
            return
        if self.path != "/v1/chat/completions" or request.get("model") != self.server.model:
            self._send(404, _error(f"The model `{request.get('model')}` does not exist."))
            return
        name = hashlib.sha256(picture).hexdigest()
        word, _, argument = self.server.next_behaviour().partition(":")
        self.server.note(picture=name, behaviour=word, temperature=request.get("temperature"))
        with self.server.at_work():
            time.sleep(self.server.delay_s)
            self._answering = {"picture": name, "answered": word}
            BEHAVIOURS[word](self, argument, self.server.answers.get(name, self.server.answers.get("*", "")))

    def log_message(self, format: str, *args: Any) -> None:
        """Silent: --log has it."""

    def answer(self, text: str, finish_reason: str = "stop") -> None:
        message = {"role": "assistant", "content": text}
        choice = {"index": 0, "message": message, "finish_reason": finish_reason}
        self._send(200, {"id": "1", "object": "chat.completion", "created": 0, "model": "m", "choices": [choice]})

    def answer_late(self, seconds: float, text: str) -> None:
        time.sleep(seconds)
        self.answer(text)

    def fail(self, argument: str) -> None:
        status, _, retry_after = argument.partition(",")
        self._send(int(status), _error("as the test asked"), {"Retry-After": retry_after} if retry_after else {})

    def raw(self, data: bytes, claimed: int | None = None, kind: str = "application/json") -> None:
        """Bytes as they are; `claimed` is a Content-Length that is not kept."""
        self.send_response(200)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(claimed or len(data)))
        self.end_headers()
        self._body(data)
        self.close_connection = self.close_connection or claimed is not None

    def drop(self) -> None:
        self.close_connection = True

    def _send(self, status: int, body: dict[str, Any], headers: dict[str, str] | None = None) -> None:
        data = json.dumps(body).encode()
        self.send_response(status)
        self.send_header("Content-Type", "application/json")
        for key, value in {"Content-Length": str(len(data)), **(headers or {})}.items():
            self.send_header(key, value)
        self.end_headers()
        self._body(data)

    def _body(self, data: bytes) -> None:
        """Noted before it is sent: who has read it may kill us."""
        if self._answering is not None:
            self.server.note(**self._answering)
            self._answering = None
        self.wfile.write(data)

    def _authorized(self) -> bool:
        if self.server.key in (None, self.headers.get("Authorization", "").removeprefix("Bearer ")):
            return True
        self._send(401, _error("Incorrect API key provided."))
        return False


# The word before the colon -> what it does with the word behind it and the true answer.
BEHAVIOURS: dict[str, Callable[[Handler, str, str], None]] = {
    "ok": lambda handler, _, text: handler.answer(text),
    "say": lambda handler, said, _: handler.answer(said),
    "length": lambda handler, said, text: handler.answer(said or text, "length"),
    "status": lambda handler, status, _: handler.fail(status),
    "slow": lambda handler, seconds, text: handler.answer_late(float(seconds), text),
    "garbage": lambda handler, *_: handler.raw(b"\x00\xff not JSON {"),
    "page": lambda handler, *_: handler.raw(b"<html><body>It works!</body></html>", kind="text/html"),
    "other": lambda handler, *_: handler.raw(b'{"choices": []}'),
    "cut": lambda handler, *_: handler.raw(b'{"choices": [{"mess', claimed=4000),
    "drop": lambda handler, *_: handler.drop(),
    "die": lambda handler, *_: handler.server.die(),
}


def picture_of(request: dict[str, Any]) -> bytes:
    """The bytes of the one picture; raises BadRequest where picture or text is missing."""
    parts = {part["type"]: part for message in request["messages"] for part in message["content"]}
    if set(parts) != {"image_url", "text"} or request.get("stream"):
        raise BadRequest("one picture and one text are taken, without streaming")
    head, _, data = parts["image_url"]["image_url"]["url"].partition(";base64,")
    if head not in ("data:image/jpeg", "data:image/png"):
        raise BadRequest(f"unknown picture type {head}")
    return base64.b64decode(data, validate=True)


def _error(message: str) -> dict[str, Any]:
    return {"error": {"message": message, "type": "error", "code": None}}


def answers_of(options: argparse.Namespace) -> dict[str, str]:
    """The table that the command line asks for."""
    if options.recording:
        from sim_fakes.wire.recorded_answers import recorded_answers

        return recorded_answers(options.recording, options.perception, stride=options.stride)
    return dict(json.loads(options.answers.read_text())) if options.answers else {"*": "a chair\na table"}


def main() -> None:
    """Print the address, then serve until killed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--port", type=int, default=0, help="0: any that is free")
    parser.add_argument("--answers", type=Path, help="JSON: sha256 of the picture's bytes -> reply")
    parser.add_argument("--recording", type=Path, help="answer for the pictures of this recording")
    parser.add_argument("--perception", type=Path, help="the recorded perception that says what is in them")
    parser.add_argument("--stride", type=int, default=1, help="only every Nth frame of it")
    parser.add_argument("--model", default=SERVED_MODEL)
    parser.add_argument("--key", help="the only API key that is let in")
    parser.add_argument("--behave", default="", help=f"words of {', '.join(BEHAVIOURS)}, separated by |")
    parser.add_argument("--delay-s", type=float, default=0.0, help="how long each answer takes")
    parser.add_argument("--log", type=Path, help="a JSON line per request and per answer")
    options = parser.parse_args()
    server = StandIn(options.port, answers_of(options), options.model, options.key, options.log)
    server.behaviours, server.delay_s = iter(filter(None, options.behave.split("|"))), options.delay_s
    print(f"http://127.0.0.1:{server.server_port}/v1", flush=True)
    server.serve_forever()


if __name__ == "__main__":
    main()
