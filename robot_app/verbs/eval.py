"""Score a memory against ground truth. Each evaluation is a module of robot_app/evals; `eval NAME --help` says more."""

from __future__ import annotations

import argparse
import importlib

EVALUATIONS = {
    "retrieval": "free-form queries: R@1, R@3, SR@1m by kind, misses, purity",
    "rooms": "objects in the right rooms, found against true ones",
    "sites": "random furnished sites: consensus and grounded, per site, with intervals",
    "verification": "the check on arrival: right and wrong candidates confirmed, thresholds swept",
    "missions": "whole simulated missions over many seeds, by either check on arrival",
    "segmentation": "fixed-vocabulary classes against labelled points, both published protocols",
}
EXAMPLE = "openbelief eval retrieval demo-out/site.belief demo-out/walk.truth.json --readout consensus"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    evaluations = parser.add_subparsers(dest="evaluation", metavar="EVALUATION", required=True)
    for name, summary in EVALUATIONS.items():
        module = importlib.import_module(f"robot_app.evals.{name}")
        one = evaluations.add_parser(name, help=summary, description=(module.__doc__ or summary).strip())
        one.add_argument("--json", action="store_true", default=argparse.SUPPRESS, help="machine-readable result")
        module.add_arguments(one)
        one.set_defaults(evaluate=module.run)


def run(options: argparse.Namespace) -> None:
    options.evaluate(options)
