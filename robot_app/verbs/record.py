"""Record a walk: RGB-D, lidar, IMU, transforms and the map, from the sources that robot.toml names.

Sources may be real, ROS topics, a recording or simulated, in any mix. A live line tells rates, drops, disk and how much
of the mapped floor the camera has measured. Ctrl-C ends the recording in good order. Long recordings go on in
walk_001.mcap, walk_002.mcap ...; a simulated robot walks through its scene, and the recording ends with the walk.
"""

from __future__ import annotations

import argparse
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from robot_app.cli import Failure, print_json

if TYPE_CHECKING:
    from robot_app.record.monitor import StreamStatus
    from robot_app.record.recording import RecordingResult

EXAMPLE = "openbelief record -o walk.mcap --config demo-out/robot.toml --minutes 2"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="OUT.mcap", help="never overwritten")
    parser.add_argument(
        "--config", type=Path, default=Path("robot.toml"), metavar="robot.toml", help="default robot.toml"
    )
    parser.add_argument("--minutes", type=_minutes, metavar="N", help="how long (default: until Ctrl-C)")
    parser.add_argument("--operator", metavar="NAME", help="who records (default: [recording] operator)")
    parser.add_argument("--site", metavar="PLACE", help="where (default: [recording] site)")
    parser.add_argument("--sheet", type=Path, metavar="FILE", help="your notes on the walk, kept in the recording")
    parser.add_argument("--stand", action="store_true", help="a simulated robot stands still")


def run(options: argparse.Namespace) -> int:
    from drivers.ports import PortError
    from robot_app.config import ConfigError, load_config, with_recording
    from robot_app.record.recording import RecordJob, record
    from robot_app.record.status_line import StatusLine

    seconds = None if options.minutes is None else 60.0 * options.minutes
    try:
        config = with_recording(load_config(options.config), operator=options.operator, site=options.site)
        job = RecordJob(config, options.output, seconds, stand=options.stand, sheet=options.sheet)
        with StatusLine() as line, _stopped_by_signals() as stop:
            recorded = record(job, stop, line.show, line.tell)
    except OSError as error:
        raise Failure(f"{error.filename}: {error.strerror}" if error.strerror else str(error)) from error
    except (ConfigError, PortError, ValueError, RuntimeError) as error:
        raise Failure(str(error)) from error
    if options.json:
        print_json(
            {
                "paths": [str(path) for path in recorded.paths],
                "failure": recorded.failure,
                **recorded.status.as_json(),
            }
        )
    else:
        print("\n".join(story(recorded)))
    if (failure := failure_of(recorded)) is not None:
        raise Failure(failure)
    return 0


def failure_of(recorded: RecordingResult) -> str | None:
    """Why a recording is not what was wanted, whatever of it is on the disk; None where it is."""
    if recorded.failure is not None:
        return recorded.failure
    if not recorded.status.written:
        return "nothing was recorded: no source sent anything (openbelief doctor looks for the cause)"
    if recorded.status.gone:
        return f"a source ended before the recording, which is kept: {' | '.join(recorded.status.gone)}"
    return None


def story(recorded: RecordingResult) -> list[str]:
    """What a person wants to know, in lines."""
    status = recorded.status
    lines = [f"{', '.join(map(str, recorded.paths)) or 'no file'}: {status.written} messages in {status.seconds:.1f} s"]
    for name, stream in status.streams.items():
        lines.append("".join([f"  {name}: {stream.written or 'nothing came'}", *_missing(stream)]))
    if status.coverage is not None:
        lines.append(f"  floor seen: {100 * status.coverage:.0f} % of {status.floor_m2:.0f} m2")
    return lines + [f"  {sentence}" for sentence in status.trouble]


def _missing(stream: StreamStatus) -> list[str]:
    """What is not in the file, and where it was lost."""
    told = [f", {count} {where}" for where, count in stream.lost.items()]
    if stream.dropped:
        told.append(f", {stream.dropped} dropped ({stream.reason})")
    if stream.holes:
        told.append(f", {stream.holes} holes in the stamps (longest {stream.longest_hole_s:.2f} s)")
    if stream.backwards:
        told.append(f", {stream.backwards} stamps not after the one before")
    return told


@contextmanager
def _stopped_by_signals() -> Iterator[threading.Event]:
    """Ctrl-C or a service manager's SIGTERM ends the recording; a second Ctrl-C ends the program."""
    stop = threading.Event()
    ends = (signal.SIGINT, signal.SIGTERM)

    def end(number: int, _frame: object) -> None:
        stop.set()
        signal.signal(number, before[signal.Signals(number)])

    before = {number: signal.signal(number, end) for number in ends}
    try:
        yield stop
    finally:
        for number in ends:
            signal.signal(number, before[number])


def _minutes(text: str) -> float:
    try:
        minutes = float(text)
    except ValueError:
        minutes = 0.0
    if not 0.0 < minutes < 10_000.0:
        raise argparse.ArgumentTypeError(f"minutes must be a number above 0, got '{text}'")
    return minutes
