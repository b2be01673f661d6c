"""A demo's folder, made once, and an operator's keyboard and screen."""

from __future__ import annotations

import io
import os
import queue
import shutil
import signal
import socket
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from robot_app.cli import main

SMALL = Path(__file__).parent / "small_scene.json"


@pytest.fixture(scope="session")
def demo_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What `openbelief demo` leaves of the small room; read only."""
    folder = tmp_path_factory.mktemp("small") / "demo-out"
    assert main(["demo", "--scene", str(SMALL), "--out", str(folder), "--json"]) == 0
    return folder


@pytest.fixture
def small_site(demo_folder: Path, tmp_path: Path) -> Path:
    """A copy of it, to ask and record in."""
    return Path(shutil.copytree(demo_folder, tmp_path / "small-site"))


@pytest.fixture
def remote_toml(small_site: Path) -> Path:
    """The demo's robot.toml, with a person's yes before motion, and [remote] at a free port."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        endpoint = f"tcp/127.0.0.1:{probe.getsockname()[1]}"
    path = small_site / "remote.toml"
    text = (small_site / "robot.toml").read_text().replace('motion = "allow"', 'motion = "ask"')
    off = '\n[remote]\nserve = "off"\nendpoint = "tcp/127.0.0.1:7450"\n'
    assert off in text
    path.write_text(text.replace(off, f'\n[remote]\nserve = "here"\nendpoint = "{endpoint}"\n'))
    return path


HUNG_S = 240.0


class Keyboard:
    """A standard input: lines come when they are typed, as a terminal's do. terminal: whether it says it is one."""

    terminal = False

    def __init__(self) -> None:
        self._typed: queue.Queue[str | None] = queue.Queue()

    def type(self, *lines: str) -> None:
        for line in lines:
            self._typed.put(line + "\n")

    def isatty(self) -> bool:
        return self.terminal

    def end(self) -> None:
        self._typed.put(None)

    def wait_until_read(self) -> None:
        """Until the reader has dealt with every typed line."""
        self._typed.join()

    def __iter__(self) -> Iterator[str]:
        while (line := self._typed.get()) is not None:
            yield line
            self._typed.task_done()
        self._typed.task_done()


class Screen(io.StringIO):
    """What the operator is shown; `reactions` are done once, when a line holds their words."""

    def __init__(self) -> None:
        super().__init__()
        self.reactions: dict[str, Callable[[], object]] = {}
        self.settled: Callable[[float], bool] = lambda _: True  # of the Screen that writes here, where one lives on

    def write(self, text: str) -> int:
        for words in [words for words in self.reactions if words in text]:
            self.reactions.pop(words)()
        return super().write(text)

    @property
    def lines(self) -> list[str]:
        if threading.current_thread().name != "screen":
            assert self.settled(HUNG_S)
        return self.getvalue().splitlines()


@pytest.fixture
def keyboard() -> Iterator[Keyboard]:
    made = Keyboard()
    yield made
    made.end()


@pytest.fixture
def screen() -> Screen:
    return Screen()


@pytest.fixture
def terminal(keyboard: Keyboard, screen: Screen) -> Callable[[list[str]], int]:
    """Runs a verb whose standard input and error are the keyboard and the screen; Ctrl-C is as before afterwards.

    Put in place at the call: pytest sets its own streams again when a test begins.
    """

    def run(arguments: list[str]) -> int:
        before = signal.getsignal(signal.SIGINT)
        hung = threading.Timer(HUNG_S, lambda: os.kill(os.getpid(), signal.SIGINT))  # a test fails, and never hangs
        hung.daemon = True
        hung.start()
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr("sys.stdin", keyboard)
            patch.setattr("sys.stderr", screen)
            try:
                return main(arguments)
            finally:
                hung.cancel()
                signal.signal(signal.SIGINT, before)

    return run
