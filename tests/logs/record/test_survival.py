"""What was flushed survives a kill and a disk that refuses, and a full disk is visible."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

from logs.mcap_io.reader import LogReader
from logs.mcap_io.recover import recover
from logs.record.disk import DiskBudget
from logs.record.recorder import McapRecorder
from support.clocks import HandClock
from support.events import read_events
from support.words import STRING, said, word

NOW_NS = 1_000_000_000_000
KILLED = """
import sys
from pathlib import Path
from drivers.clock import SystemClock
from drivers.ros.messages import encode, make
from logs.record.recorder import McapRecorder
with McapRecorder(Path(sys.argv[1]), SystemClock()) as recorder:
    recorder.metadata("run", {"id": "1"})
    for k in range(10**9):
        recorder.write_cdr("/words", "std_msgs/msg/String", k, encode(make("std_msgs/msg/String", data=str(k) * 50)))
        if k % 20 == 19:
            recorder.flush()
            print(k + 1, flush=True)
"""
FULL = """
import resource, sys
from pathlib import Path
from drivers.clock import SystemClock
from drivers.ros.messages import encode, make
from logs.record.recorder import McapRecorder
resource.setrlimit(resource.RLIMIT_FSIZE, (200_000, 200_000))  # the events file stays below it, the recording does not
noise = __import__("random").Random(1)
told = []
with McapRecorder(Path(sys.argv[1]), SystemClock(), tell=told.append) as recorder:
    for k in range(100):
        text = str(k) + " " + "".join(chr(noise.randrange(33, 126)) for _ in range(5000))
        recorder.write_cdr("/words", "std_msgs/msg/String", k, encode(make("std_msgs/msg/String", data=text)))
        recorder.flush()
    state = recorder.state, recorder.dropped
print(state[0], state[1], len(told))
print(told[0])
"""
NO_ROOM_FOR_THE_INDEX = """
import resource, sys
from pathlib import Path
from drivers.clock import SystemClock
from drivers.ros.messages import encode, make
from logs.record.recorder import McapRecorder
path = Path(sys.argv[1])
with McapRecorder(path, SystemClock()) as recorder:
    recorder.write_cdr("/words", "std_msgs/msg/String", 1, encode(make("std_msgs/msg/String", data="kept" * 20000)))
    recorder.flush()
    full = path.with_name("walk.mcap.partial").stat().st_size + 100
    resource.setrlimit(resource.RLIMIT_FSIZE, (full, full))
    sys.stdout.write(recorder.state + " ")
print(recorder.state, recorder.dropped, recorder.paths)
"""


def test_kill_9_loses_nothing_that_was_flushed(tmp_path: Path) -> None:
    path = tmp_path / "walk.mcap"
    process = subprocess.Popen([sys.executable, "-c", KILLED, str(path)], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    flushed = 0
    for line in process.stdout:
        flushed = int(line)
        if flushed >= 200:
            break
    process.send_signal(signal.SIGKILL)
    rest = process.stdout.read().split()
    process.wait(timeout=10)
    flushed = int(rest[-1]) if rest else flushed
    assert not path.exists()
    report = recover(tmp_path / "walk.mcap.partial", path, lambda share: None)
    words = said(path)
    assert len(words) >= flushed and report.messages == len(words)
    assert words == [str(k) * 50 for k in range(len(words))]
    assert LogReader(path).metadata()["run"] == {"id": "1"}


def test_a_full_disk_is_visible_and_costs_nothing_that_was_written(tmp_path: Path) -> None:
    path = tmp_path / "walk.mcap"
    done = subprocess.run(
        [sys.executable, "-c", FULL, str(path)], capture_output=True, text=True, timeout=60, check=True
    )
    (state, dropped, told), sentence = done.stdout.splitlines()[0].split(), done.stdout.splitlines()[1]
    assert (state, told) == ("failed", "1") and int(dropped) > 0
    assert "recording_failed" in done.stderr
    [event] = read_events(tmp_path / "walk.events.jsonl")
    assert event["sentence"] == sentence and "openbelief recover" in sentence
    report = recover(tmp_path / "walk.mcap.partial", path, lambda share: None)
    words = said(path)
    assert [w.split()[0] for w in words] == [str(k) for k in range(len(words))]
    assert len(words) == 100 - int(dropped) and report.loss_count == 1  # only the missing index


def test_a_disk_that_fills_up_at_the_very_end_keeps_every_message(tmp_path: Path) -> None:
    path = tmp_path / "walk.mcap"
    command = [sys.executable, "-c", NO_ROOM_FOR_THE_INDEX, str(path)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True)
    assert done.stdout == "recording failed 0 []\n"
    assert not path.exists() and "openbelief recover" in done.stderr
    recover(tmp_path / "walk.mcap.partial", path, lambda share: None)
    assert said(path) == ["kept" * 20000]


def test_a_full_disk_budget_ends_the_file_in_good_order(tmp_path: Path) -> None:
    told: list[str] = []
    clock = HandClock(NOW_NS)
    with McapRecorder(tmp_path / "a.mcap", clock, disk=DiskBudget(warn_bytes=0, stop_bytes=0), tell=told.append) as r:
        r.write_cdr("/words", STRING, 1, word("kept"))
        r._disk = DiskBudget(stop_bytes=1 << 62)  # the disk fills up
        clock.sleep(2.0)
        r.write_cdr("/words", STRING, 2, word("too late"))
        assert (r.state, r.dropped) == ("failed", 1)
    assert said(tmp_path / "a.mcap") == ["kept"]
    assert len(told) == 1 and "recording stopped: only" in told[0]
    assert read_events(tmp_path / "a.events.jsonl")[0]["event"] == "disk_full"


def test_little_room_is_told_once_and_recording_goes_on(tmp_path: Path) -> None:
    told: list[str] = []
    clock = HandClock(NOW_NS)
    budget = DiskBudget(warn_bytes=1 << 62, stop_bytes=0)
    with McapRecorder(tmp_path / "a.mcap", clock, disk=budget, tell=told.append) as recorder:
        for k in range(5):
            recorder.write_cdr("/words", STRING, k, word(str(k)))
            clock.sleep(2.0)
    assert said(tmp_path / "a.mcap") == list("01234")
    assert len(told) == 1 and "GB are free" in told[0]
