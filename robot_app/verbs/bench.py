"""Measure this machine: how much of a core a part of the robot app takes, and what it loses, under its full load.

Each bench is a module of robot_app/benches; `openbelief bench NAME --help` says what it does. Exit status 1 where a
bench misses its own promise (data lost, a deadline passed).
"""

from __future__ import annotations

import argparse

from robot_app.subverbs import add_subverbs, run_subverb

BENCHES = {
    "livox": "the MID-360 receiver at 200 000 points/s: share of a core, packets lost",
    "realsense": "the RealSense driver at 30 Hz: share of a core, age, images lost",
    "watchdog": "the workstation killed, stopped, cut off: seconds until the cancel reaches Nav2",
    "record": "recording RGB-D, lidar and IMU at full rate: messages lost, share of the cores, disk",
    "voice": "listening: words wrong, seconds an utterance, stops heard and invented",
    "association": "which observations are of one object: CPU time and memory, beside kd-trees and union-find",
    "open": "a .belief file of many objects: CPU time and memory until it answers, beside reading all of it",
    "retrieval": "ranking all objects of a large memory: CPU time of each readout, beside one read of its matrices",
    "acquire": "observations of a frame full of masks: CPU time a frame, beside DBSCAN with a kd-tree",
    "goal": "where to stand to look at a thing on a large site: CPU time, beside Dijkstra over all of it",
    "perception": "SAM 3 and CLIP: frames/s and memory of every stage, for each image size",
    "console": "a press of STOP to the cancel at Nav2, a lost page to the hold, in a real Chromium",
}
EXAMPLE = "openbelief bench livox --seconds 5"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_subverbs(parser, "robot_app.benches", BENCHES, metavar="BENCH")


def run(options: argparse.Namespace) -> int | None:
    return run_subverb(options)
