"""A microphone below PortAudio: ALSA's own `file` plugin reads a pipe that is fed in real time, as a device is."""

from __future__ import annotations

import fcntl
import os
import threading
import time
from pathlib import Path

from robot_app.voice.audio import RATE_HZ, read_wav

# One period as PortAudio asks for it: a pipe that gives less than a read wants would leave gaps in the sound.
BLOCK = 278
PIPE_BYTES = 4096  # 0.13 s
NAME = "talk"
CONFIGURATION = """</usr/share/alsa/alsa.conf>
pcm.{name} {{
  type file
  slave.pcm {{ type null }}
  file "/dev/null"
  infile "{pipe}"
  format "raw"
}}
"""


class AlsaMicrophone:
    """A context manager: silence, and what `says` was given. environment: for the process that listens."""

    def __init__(self, folder: Path) -> None:
        pipe, self._configuration = folder / "microphone.pipe", folder / "asound.conf"
        os.mkfifo(pipe)
        self._configuration.write_text(CONFIGURATION.format(name=NAME, pipe=pipe))
        self._pipe = os.open(pipe, os.O_RDWR | os.O_NONBLOCK)
        fcntl.fcntl(self._pipe, fcntl.F_SETPIPE_SZ, PIPE_BYTES)
        self._sound, self._ended = bytearray(), threading.Event()
        self._feeding = threading.Thread(target=self._feed, daemon=True)

    @property
    def environment(self) -> dict[str, str]:
        return {**os.environ, "ALSA_CONFIG_PATH": str(self._configuration)}

    def __enter__(self) -> AlsaMicrophone:
        self._feeding.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self._feeding.join()
        os.close(self._pipe)

    def says(self, path: Path) -> None:
        """Returns when the last word is in the pipe."""
        self._sound += read_wav(path).pcm16()
        while self._sound:
            time.sleep(0.01)

    def _feed(self) -> None:
        while not self._ended.wait(BLOCK / (2 * RATE_HZ)):
            try:
                os.write(self._pipe, bytes(self._sound[:BLOCK]).ljust(BLOCK, b"\0"))
                del self._sound[:BLOCK]
            except BlockingIOError:  # full: nobody reads
                continue
