"""Score a memory against ground truth. Each evaluation is a module of robot_app/evals; `eval NAME --help` says more."""

from __future__ import annotations

import argparse

from robot_app.subverbs import add_subverbs, run_subverb

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
    add_subverbs(parser, "robot_app.evals", EVALUATIONS, metavar="EVALUATION")


def run(options: argparse.Namespace) -> int | None:
    return run_subverb(options)
