"""The console in a real Chromium: from a press of STOP to the cancel at Nav2, and from a lost page to the hold.

A simulated robot with Nav2 in a process of its own, missions and console in this one, a headless Chromium in front of
it; the page shows camera and 2 000 objects that change ten times a second, and a Python thread keeps this process busy.
Fails where a promise is missed: STOP median 50 ms and worst 200 ms, every lost page held within 1 s, no hold while the
page is healthy, repaint of 2 000 objects within 10 ms at the 95th percentile. A tab is hidden in a second Chromium, as
a person starts it: Playwright keeps its own awake. The defaults take a quarter of an hour; what is done is said on the
way. Needs Debian's chromium and playwright.
"""

from __future__ import annotations

import argparse
import json
import sys
from typing import Any

from robot_app.arguments import from_one
from robot_app.benches.console_bench import ConsoleBench
from robot_app.benches.loaded_console import OBJECTS, TRIALS, loaded_console
from robot_app.benches.lost_pages import EVERY
from robot_app.cli import Failure, print_json
from robot_app.tables import show

STOP_MEDIAN_MS, STOP_WORST_MS, HOLD_S, REPAINT_MS = 50.0, 200.0, 1.0, 10.0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--presses", type=from_one, default=100, help="of STOP (default 100)")
    parser.add_argument("--minutes", type=float, default=10.0, help="of a healthy page (default 10)")
    parser.add_argument("--losses", type=from_one, default=3, help="of each kind of lost page (default 3)")


def run(options: argparse.Namespace) -> None:
    result: dict[str, Any] = {"hold_s": {}}
    with loaded_console() as console:
        bench = ConsoleBench(console)
        result["stop_ms"] = _said(options, "STOP", bench.stops(options.presses))
        for loss in EVERY:
            result["hold_s"][loss] = _said(options, loss, bench.holds(loss, options.losses))
        result["repaint_ms"] = _said(options, "repaint", bench.repaint())
        result["trials_ms"] = _said(options, "trials", bench.trials())
        result["healthy"] = _said(options, "healthy", bench.healthy(60.0 * options.minutes))
    print_json(result) if options.json else _show(result)
    if broken := _broken(result):
        raise Failure("; ".join(broken))


def _said(options: argparse.Namespace, what: str, found: Any) -> Any:
    """What was measured, told at once: a bench of a quarter of an hour may be cut short."""
    if not options.json:
        print(f"{what}: {json.dumps(found)[:400]}", file=sys.stderr, flush=True)
    return found


def _rows(result: dict[str, Any]) -> list[tuple[str, str, str, bool]]:
    """What, measured, promised, kept."""
    stop, healthy, paint = result["stop_ms"], result["healthy"], result["repaint_ms"]
    late = stop["heard_of_worst"]
    spread = (
        f"median {stop['median']:.0f}, p95 {stop['p95']:.0f}, worst {stop['worst']:.0f} ms ({late:.0f} until heard)"
    )
    return [
        (
            f"STOP to the cancel request at Nav2, {stop['presses']} presses",
            spread,
            f"median {STOP_MEDIAN_MS:.0f}, worst {STOP_WORST_MS:.0f} ms",
            stop["median"] <= STOP_MEDIAN_MS and stop["worst"] <= STOP_WORST_MS,
        ),
        *(
            (
                f"hold: {loss}",
                f"{', '.join(f'{each:.2f}' for each in times)} s",
                "1.0 s each",
                max(times) <= HOLD_S,
            )
            for loss, times in result["hold_s"].items()
        ),
        (
            f"repaint of {OBJECTS} objects, {paint['paints']} times",
            f"median {paint['median']:.1f}, p95 {paint['p95']:.1f} ms (the whole page {paint['page']['p95']:.1f})",
            f"p95 {REPAINT_MS:.0f} ms",
            paint["p95"] <= REPAINT_MS,
        ),
        (f"{TRIALS} trials, from the click to the list", f"{result['trials_ms']:.0f} ms", "", True),
        (
            f"holds of a healthy page in {healthy['seconds']:.0f} s",
            f"{healthy['false_holds']} (longest silence {healthy['longest_silence_s']:.2f} s)",
            "0",
            not healthy["false_holds"],
        ),
    ]


def _show(result: dict[str, Any]) -> None:
    from rich.table import Table

    shown = Table("what", "measured", "promised", "kept")
    for what, measured, promised, kept in _rows(result):
        shown.add_row(what, measured, promised, "yes" if kept else "NO")
    show(shown)


def _broken(result: dict[str, Any]) -> list[str]:
    return [f"{what}: {measured}, promised {promised}" for what, measured, promised, kept in _rows(result) if not kept]
