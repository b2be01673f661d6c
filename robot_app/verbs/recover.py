"""Rewrite what a truncated or damaged recording still holds.

Every chunk, attachment and metadata record whose checksum holds goes into a new, finished recording; what cannot be
proven whole is left out and listed. The damaged file is not touched.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from robot_app.cli import Failure, print_json

if TYPE_CHECKING:
    from logs.mcap_io.recovery_report import RecoveryReport

EXAMPLE = "openbelief recover demo-out/walk.mcap -o walk.recovered.mcap"
SHOWN_LOSSES = 10


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", type=Path, metavar="FILE", help="the damaged recording (.mcap or .mcap.partial)")
    parser.add_argument("-o", "--output", type=Path, metavar="OUT", help="default: NAME.recovered.mcap beside FILE")


def run(options: argparse.Namespace) -> int:
    from logs.mcap_io.reader import LogError
    from logs.mcap_io.recover import recover

    output = options.output or default_output(options.file)
    try:
        report = recover(options.file, output, progress=_progress())
    except LogError as error:
        raise Failure(str(error)) from error
    except OSError as error:
        raise Failure(f"{output} cannot be written: {error.strerror or error}") from error
    if options.json:
        print_json(report.as_json())
    else:
        print("\n".join(story(report)))
    return 0


def default_output(source: Path) -> Path:
    return source.with_name(f"{source.name.removesuffix('.partial').removesuffix('.mcap')}.recovered.mcap")


def story(report: RecoveryReport) -> list[str]:
    """What a person wants to know, in lines."""
    lines = [
        f"{report.output}: {report.messages} messages in {report.chunks} chunks, "
        f"{report.attachments} attachments, {report.metadata} metadata records"
    ]
    if report.complete:
        return [*lines, "nothing was missing: the file was whole"]
    lost = "an unknown number of" if report.messages_lost is None else str(report.messages_lost)
    lines.append(f"lost: {lost} messages; {report.loss_count} places were damaged or cut off")
    lines += [f"  {loss}" for loss in report.losses[:SHOWN_LOSSES]]
    if report.loss_count > SHOWN_LOSSES:
        lines.append(f"  and {report.loss_count - SHOWN_LOSSES} more (--json lists up to 100)")
    if report.unverified_messages or report.unverified_records:
        unverified = report.unverified_messages + report.unverified_records
        lines.append(f"kept without proof, their writer having left checksums out: {unverified} messages or records")
    return lines


class _progress:  # noqa: N801  # reads as a verb where it is used
    """A percentage on a terminal's stderr, rewritten in place."""

    def __init__(self) -> None:
        self._shown = -1

    def __call__(self, share: float) -> None:
        percent = int(100 * share)
        if percent != self._shown and sys.stderr.isatty():
            self._shown = percent
            end = "\n" if percent == 100 else ""
            print(f"\rrecovering {percent:3d} %", end=end, file=sys.stderr, flush=True)
