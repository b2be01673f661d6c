"""The whole loop in simulation, then its replay.

A simulated G1 walks through a flat and records what it senses; the recording is mapped; the operator asks for a
thing; the robot drives to the best candidate over a simulated Nav2 behind real Zenoh wires, looks, and confirms it or
tries the next. The trial is replayed and compared decision by decision. Everything is left in the --out folder, over
what an earlier demo left there; a file of somebody else's is never replaced.

With --console the flat opens in a browser instead, and you are the operator: ask, approve, stop.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from pathlib import Path

from robot_app import arguments
from robot_app.cli import Failure, print_json

EXAMPLE = 'openbelief demo --query "take me to the fire extinguisher" --out demo-out'
QUERY = "take me to the fire extinguisher"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--query", default=QUERY, metavar="TEXT", help=f"what the operator asks (default: {QUERY})")
    parser.add_argument("--scene", default="flat", metavar="SCENE.json", help="a scene file, or a built-in one (flat)")
    parser.add_argument("--seed", type=int, default=1, metavar="N", help="another seed, other noise (default 1)")
    parser.add_argument(
        "--console",
        type=arguments.listening,
        nargs="?",
        const="8800",
        metavar="[HOST:]PORT",
        help="open the simulated flat in a browser and play operator (default port 8800)",
    )
    parser.add_argument("--out", type=Path, default=Path("demo-out"), metavar="DIR", help="default demo-out")


def run(options: argparse.Namespace) -> int:
    from drivers.ports import PortError
    from robot_app.demo.demo import run_demo
    from robot_app.progress import progress
    from sim_fakes.world.scene import SceneError

    began = time.monotonic()

    def tell(sentence: str) -> None:
        print(
            f"[{time.monotonic() - began:5.1f} s] {sentence}",
            file=sys.stderr if options.json else sys.stdout,
            flush=True,
        )

    try:
        if options.console is not None:
            return _play(options, tell)
        with progress() as shown:
            demo = run_demo(options.out, options.query, options.scene, options.seed, shown, tell)
    except (PortError, SceneError, OSError, ValueError, RuntimeError) as error:
        raise Failure(str(error)) from error
    if options.json:
        print_json(demo.as_json())
    return 0 if demo.replayed.difference is None else 1


def _play(options: argparse.Namespace, tell: Callable[[str], None]) -> int:
    """The simulated flat behind the console; its memory is made where the folder has none of this scene yet."""
    from robot_app.console.console_run import run_with_console
    from robot_app.console.listening import require_free
    from robot_app.demo.demo import demo_configuration
    from robot_app.progress import progress

    require_free(options.console)
    with progress() as shown:
        config = demo_configuration(options.out, options.scene, options.seed, shown, tell)
    run_with_console(config, options.console, print_json if options.json else None)
    return 0
