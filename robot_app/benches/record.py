"""Recording at full rate over a real Zenoh link: 640x480 RGB-D at 30 Hz, 200 000 points/s, IMU at 200 Hz, /tf at 50 Hz.

The sources run in a process of their own; the CPU share is this process's alone (receiving, JPEG, zstd, writing), in
cores. Fails where a single message is lost, and says whether that was on the way to the recorder or in it.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Any

from robot_app import arguments
from robot_app.cli import Failure, print_json

if TYPE_CHECKING:
    from drivers.ports import Clock
    from logs.record.queued import QueuedRecorder
    from logs.record.recorder import McapRecorder
    from logs.record.streams import RecordedStream

SETTLE_S, POLL_S = 10.0, 0.05
GONE = "the sources' process ended early; its message is above"
LATCHED = ("/map", "/tf_static")
KEPT_AS = {"/camera/color/image_raw": "/camera/color/image_raw/compressed"}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--seconds", type=arguments.bench_seconds, default=60.0, help="how long the sources send (default 60)"
    )
    parser.add_argument(
        "--folder", type=Path, metavar="DIR", help="the disk to measure (default: the temporary folder)"
    )


def run(options: argparse.Namespace) -> None:
    with tempfile.TemporaryDirectory(dir=options.folder) as folder:
        result = _measure(Path(folder) / "bench.mcap", options.seconds)
    if options.json:
        print_json(result)
    else:
        print(table(result))
    if result["lost"]:
        raise Failure(f"{result['lost']} messages were lost: the machine is busy (load {result['load']}) or too slow")


def _measure(path: Path, seconds: float) -> dict[str, Any]:
    from drivers.clock import SystemClock
    from logs.record.recorder import McapRecorder

    command = [sys.executable, "-m", "sim_fakes.wire.full_rate", "--seconds", str(seconds)]
    clock, peaks = SystemClock(), [0]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as sources:
        with McapRecorder(path, clock) as recorder:
            report, cpu_s, streams = _record(sources, recorder, clock, peaks)
        sources.communicate("done\n")
    written, sent = _counted(recorder.paths), report["sent"]
    kept = {name: written[KEPT_AS.get(name, name)] for name in sent}
    taken = {name: streams[KEPT_AS.get(name, name)].taken for name in sent}
    return {
        "seconds": seconds,
        "sent": sent,
        "taken": taken,
        "written": kept,
        "lost": sum(sent.values()) - sum(kept.values()),
        "lost_on_the_way": sum(sent.values()) - sum(taken.values()),
        "dropped": sum(streams[KEPT_AS.get(name, name)].dropped for name in sent),
        "sources_behind_s": round(report["behind_s"], 3),
        "file_mb": round(sum(file.stat().st_size for file in recorder.paths) / 1e6, 1),
        "peak_backlog_mb": round(max(peaks) / 1e6, 1),
        "cpu_cores": round(cpu_s / seconds, 3),
        "cores": len(os.sched_getaffinity(0)),
        "load": round(os.getloadavg()[0], 2),
    }


def _record(
    sources: subprocess.Popen[str], recorder: McapRecorder, clock: Clock, peaks: list[int]
) -> tuple[dict[str, Any], float, dict[str, RecordedStream]]:
    """(what the sources sent, our CPU seconds meanwhile, what became of each topic) of one run."""
    from drivers.ros.zenoh_link import LinkConfig, ZenohLink
    from logs.record.queued import QueuedRecorder
    from logs.record.tap import TopicTap

    endpoint = _line(sources)
    with ZenohLink(LinkConfig((endpoint,))) as link, QueuedRecorder(recorder, clock) as queue:
        TopicTap(link, queue).start()
        while not all(queue.stream(name).written for name in LATCHED):  # then the other subscriptions are known too
            if sources.poll() is not None:
                raise Failure(GONE)
            time.sleep(POLL_S)
        began_s = time.process_time()
        _tell(sources, "begin")
        watcher = threading.Thread(target=_watch, args=(queue, sources, peaks), daemon=True)
        watcher.start()
        report = json.loads(_line(sources))
        _settle(queue, sum(report["sent"].values()) + len(LATCHED))
        return report, time.process_time() - began_s, queue.streams


def _watch(queue: QueuedRecorder, sources: subprocess.Popen[str], peaks: list[int]) -> None:
    while sources.poll() is None:
        peaks.append(queue.backlog_bytes)
        time.sleep(POLL_S)


def _settle(queue: QueuedRecorder, expected: int) -> None:
    """Until everything has come, or for ten seconds: what has not come by then is lost."""
    deadline_s = time.monotonic() + SETTLE_S
    while sum(stream.taken for stream in queue.streams.values()) < expected and time.monotonic() < deadline_s:
        time.sleep(POLL_S)
    queue.drain()


def _counted(paths: list[Path]) -> Counter[str]:
    """Messages by topic, as they lie on the disk, every checksum verified."""
    from logs.mcap_io.reader import LogReader

    return Counter(message.topic for path in paths for message in LogReader(path))


def _line(sources: subprocess.Popen[str]) -> str:
    line = sources.stdout.readline() if sources.stdout else ""
    if not line:
        raise Failure(GONE)
    return line.strip()


def _tell(sources: subprocess.Popen[str], word: str) -> None:
    assert sources.stdin is not None
    sources.stdin.write(f"{word}\n")
    sources.stdin.flush()


def table(result: dict[str, Any]) -> str:
    """The result for people."""
    sent = ", ".join(f"{count} on {name}" for name, count in result["sent"].items())
    return "\n".join(
        [
            f"sent in {result['seconds']:g} s: {sent}",
            f"lost: {result['lost']} ({result['lost_on_the_way']} on the way, {result['dropped']} dropped here)",
            f"CPU of the recorder: {result['cpu_cores']:.2f} of {result['cores']} cores, load average {result['load']}",
            f"on the disk: {result['file_mb']:.0f} MB; most that waited for it: {result['peak_backlog_mb']:.0f} MB",
            f"the sources were late by {result['sources_behind_s']:.2f} s at worst",
        ]
    )
