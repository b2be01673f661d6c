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
    from robot_app.recording import Recorded

EXAMPLE = "openbelief record -o walk.mcap --config demo-out/robot.toml --minutes 2"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="OUT.mcap", help="never overwritten")
    parser.add_argument(
        "--config", type=Path, default=Path("robot.toml"), metavar="robot.toml", help="default robot.toml"
    )
    parser.add_argument("--minutes", type=_minutes, metavar="N", help="how long (default: until Ctrl-C)")
    parser.add_argument("--stand", action="store_true", help="a simulated robot stands still")


def run(options: argparse.Namespace) -> int:
    from drivers.ports import PortError
    from robot_app.config import ConfigError, load_config
    from robot_app.record_line import RecordLine
    from robot_app.recording import RecordJob, record

    seconds = None if options.minutes is None else 60.0 * options.minutes
    try:
        job = RecordJob(load_config(options.config), options.output, seconds, stand=options.stand)
        with RecordLine() as line, _stopped_by_signals() as stop:
            recorded = record(job, stop, line.show, line.tell)
    except (ConfigError, PortError, OSError, ValueError, RuntimeError) as error:
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
    if recorded.failure is not None:
        raise Failure(recorded.failure)
    if not recorded.status.written:
        raise Failure("nothing was recorded: no source sent anything (openbelief doctor looks for the cause)")
    return 0


def story(recorded: Recorded) -> list[str]:
    """What a person wants to know, in lines."""
    status = recorded.status
    lines = [f"{', '.join(map(str, recorded.paths)) or 'no file'}: {status.written} messages in {status.seconds:.1f} s"]
    for name, stream in status.streams.items():
        lost = f", {stream.dropped} dropped ({stream.reason})" if stream.dropped else ""
        lines.append(f"  {name}: {stream.written or 'nothing came'}{lost}")
    if status.coverage is not None:
        lines.append(f"  floor seen: {100 * status.coverage:.0f} % of {status.floor_m2:.0f} m2")
    return lines + [f"  {sentence}" for sentence in status.trouble]


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
