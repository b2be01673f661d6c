"""Optional: a real model server, `transformers serve`, with the paper's Qwen3-VL, tiny and at random weights.

It runs in .venv-export (make export-venv) and reaches no network. What it says means nothing; that it is asked,
answers, dies and comes back is real.
"""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import time
import urllib.request
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from openbelief.observation import Intrinsics, RgbdFrame
from openbelief.perception.vlm import VlmError, VlmProposer
from openbelief.perception.vlm_config import VlmConfig
from openbelief.phrase import MAX_CHARACTERS, MAX_WORDS
from robot_app.cli import main

ROOT = Path(__file__).resolve().parents[3]
BIN = ROOT / ".venv-export" / "bin"
FIXTURES = ROOT / "tests" / "openbelief" / "perception" / "fixtures"
MODEL = "random/tiny-qwen3-vl"
READY_S = 120.0  # a loaded machine loads torch slowly

pytestmark = pytest.mark.skipif(
    not (BIN / "transformers").is_file() or not (BIN / "uvicorn").is_file(),
    reason="a real model server needs .venv-export: make export-venv (6 GB)",
)


class Server:
    """`transformers serve` on one port, which it keeps when it is started again."""

    def __init__(self, cache: Path) -> None:
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            self.port = probe.getsockname()[1]
        self.endpoint = f"http://127.0.0.1:{self.port}/v1"
        self._cache, self._process = cache, None

    def start(self) -> None:
        command = [BIN / "transformers", "serve", "--device", "cpu", "--host", "127.0.0.1", "--port", str(self.port)]
        environment = {"HF_HUB_CACHE": str(self._cache), "HF_HUB_OFFLINE": "1", "OMP_NUM_THREADS": "1"}
        self.log = (self._cache / "serve.log").open("ab")
        self._process = subprocess.Popen(
            command, env=os.environ | environment, stdout=self.log, stderr=self.log, start_new_session=True
        )
        self._wait()

    def kill(self) -> None:
        if self._process is not None and self._process.poll() is None:
            os.killpg(self._process.pid, signal.SIGKILL)
            self._process.wait(10)
            self.log.close()

    def _wait(self) -> None:
        end_s = time.monotonic() + READY_S
        while time.monotonic() < end_s and self._process.poll() is None:
            try:
                urllib.request.urlopen(f"http://127.0.0.1:{self.port}/health", timeout=2).close()
                return
            except OSError:
                time.sleep(0.2)
        pytest.fail(f"transformers serve did not start:\n{(self._cache / 'serve.log').read_text()[-3000:]}")


@pytest.fixture(scope="module")
def server(tmp_path_factory) -> Iterator[Server]:
    cache = tmp_path_factory.mktemp("hub")
    script = ROOT / "scripts" / "export" / "tiny_vlm.py"
    subprocess.run([BIN / "python", script, cache], check=True, timeout=300, capture_output=True)
    server = Server(cache)
    server.start()
    yield server
    server.kill()


class RealClock:
    """on_sleep: called before every sleep."""

    def __init__(self) -> None:
        self.on_sleep: Callable[[], None] = lambda: None

    def now_ns(self) -> int:
        return time.monotonic_ns()

    def sleep(self, seconds: float) -> None:
        self.on_sleep()
        time.sleep(seconds)


def proposer(endpoint: str, clock: RealClock | None = None, model: str = MODEL) -> VlmProposer:
    return VlmProposer(VlmConfig(endpoint, model, patience_s=180.0), clock or RealClock(), tell=lambda _: None)


def frame(seed: int) -> RgbdFrame:
    color = np.random.default_rng(seed).integers(0, 255, (240, 320, 3), dtype=np.uint8)
    camera = Intrinsics(320, 240, 200.0, 200.0, 160.0, 120.0)
    return RgbdFrame(seed, seed + 1, color, np.ones((240, 320), np.float32), camera, np.eye(4))


def test_a_real_servers_reply_becomes_phrases_that_hang_on_the_picture(server):
    vlm = proposer(server.endpoint)
    vlm.check()
    first = vlm.propose(frame(0))
    assert 0 < len(first) <= 20
    assert all(len(phrase.split()) <= MAX_WORDS and len(phrase) <= MAX_CHARACTERS for phrase in first)
    assert vlm.propose(frame(0)) == first, "temperature 0"
    assert vlm.propose(frame(1)) != first


def test_concurrent_frames_get_their_own_answers_from_a_real_server(server):
    vlm = proposer(server.endpoint)
    alone = [vlm.propose(frame(seed)) for seed in (0, 1)]
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(lambda seed: vlm.propose(frame(seed)), [0, 1, 0, 1]))
    assert together == alone * 2


def test_a_real_server_without_the_model_is_refused_before_the_first_frame(server):
    with pytest.raises(VlmError, match=rf"serves {MODEL}, not lab/other: correct the profile's model"):
        proposer(server.endpoint, model="lab/other").check()
    with pytest.raises(VlmError, match="The endpoint should end in /v1"):
        proposer(server.endpoint.removesuffix("/v1")).check()


def test_a_real_server_that_is_killed_is_waited_for(server):
    clock, restarts = RealClock(), []
    vlm = proposer(server.endpoint, clock)
    before = vlm.propose(frame(0))
    clock.on_sleep = lambda: restarts or restarts.append(server.start())
    server.kill()
    assert vlm.propose(frame(0)) == before and restarts


def test_a_walk_is_mapped_by_networks_alone(server, make_walk, tmp_path, capsys):
    """Real server, SAM 3 and CLIP through onnxruntime, every one of them at random weights."""
    walk = make_walk(4).write(tmp_path / "walk.mcap")
    (tmp_path / "lab.toml").write_text(
        f'segmenter = "sam3:{FIXTURES / "sam3"}"\nencoder = "clip:{FIXTURES / "clip"}"\n'
        f'[vlm]\nendpoint = "{server.endpoint}"\nmodel = "{MODEL}"\n'
    )
    out = tmp_path / "site.belief"
    assert main(["map", str(walk), "--perception", f"paper:{tmp_path / 'lab.toml'}", "-o", str(out), "--json"]) == 0
    mapped = json.loads(capsys.readouterr().out)
    assert mapped["observations"] > 0 and mapped["objects"] > 0
