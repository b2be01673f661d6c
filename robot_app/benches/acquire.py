"""Acquisition of 640x480 frames full of masks: CPU time a frame on one core, and clusters by kd-tree pairs beside it.

The yardstick is only of the clusters, the part that costs most: DBSCAN over voxels with all pairs within eps. Then
frames a second by the wall's clock, one at a time and --jobs at once, as `openbelief map` does it: on a busy machine
that says what was left of it. Fails where clusters or observations differ.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

from robot_app.benches.cpu import beside_plain, count, cpu_s, said
from robot_app.cli import Failure, print_json

if TYPE_CHECKING:
    from openbelief.mapping import Acquired, Each, SegmentedFrame
    from openbelief.observation import Mask, RgbdFrame

ROUNDS, TRIES = 2, 5  # over the frames, for each job; and the best of so many


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--masks", type=count, default=20, metavar="N", help="in each frame (default 20)")
    parser.add_argument("--frames", type=count, default=5, metavar="N", help="unlike each other (default 5)")
    parser.add_argument("--jobs", type=count, metavar="N", help="frames at once (default: the cores there are)")


def run(options: argparse.Namespace) -> None:
    from robot_app.mapping.workers import cores

    result = _measured(options.masks, options.frames, options.jobs or cores())
    if options.json:
        print_json(result)
    else:
        print(
            f"{result['frames']} frames of {result['masks']} masks: {result['ms_per_frame']:.1f} ms of CPU a frame "
            f"({result['frames_per_s']:.0f} frames/s a core), of it the clusters {result['clusters_ms_per_frame']:.1f} "
            f"ms; {said(result)}"
        )
        jobs = result["jobs"]
        print(
            f"frames/s by the wall's clock: {result['wall_frames_per_s']:.0f} one at a time, "
            f"{result['jobs_frames_per_s']:.0f} with {jobs} at once"
        )
    if not result["equal"]:
        raise Failure("the plain way found other clusters: that is a defect, please report it with this machine's name")


def _measured(masks: int, frames: int, jobs: int) -> dict[str, Any]:
    import numpy as np

    from openbelief.acquisition import acquire
    from openbelief.backprojection import backproject
    from openbelief.clustering import largest_cluster
    from openbelief.parameters import Parameters
    from robot_app.benches import plain, synthetic

    parameters, seen = Parameters(), [synthetic.frame(masks, seed) for seed in range(frames)]
    clouds = [backproject(mask.pixels, frame, parameters) for frame, found in seen for mask in found]
    plain.largest_cluster(clouds[0], parameters)  # what is imported at the first use is no part of it
    whole_s, made = cpu_s(lambda: [acquire(frame, found, parameters) for frame, found in seen], times=3)
    ours_s, ours = cpu_s(lambda: [largest_cluster(cloud, parameters) for cloud in clouds], times=3)
    plain_s, theirs = cpu_s(lambda: [plain.largest_cluster(cloud, parameters) for cloud in clouds])
    equal = all(np.array_equal(one, other) for one, other in zip(ours, theirs, strict=True))
    wall_s, jobs_s, same = _side_by_side(seen, jobs)
    return {
        "frames": frames,
        "masks": masks,
        "observations": sum(len(observed) for observed, _ in made),
        "voxels": sum(o.n for observed, _ in made for o in observed),
        "ms_per_frame": round(1e3 * whole_s / frames, 2),
        "frames_per_s": round(frames / whole_s, 1),
        "clusters_ms_per_frame": round(1e3 * ours_s / frames, 2),
        "jobs": jobs,
        "wall_frames_per_s": round(1 / wall_s, 1),
        "jobs_frames_per_s": round(1 / jobs_s, 1),
    } | beside_plain(ours_s, plain_s, equal and same)


def _side_by_side(seen: list[tuple[RgbdFrame, list[Mask]]], jobs: int) -> tuple[float, float, bool]:
    """(seconds of the wall a frame, one at a time; with so many jobs; whether both gave the same points)."""
    import numpy as np

    from openbelief.mapping import SegmentedFrame, acquired
    from openbelief.parameters import Parameters
    from robot_app.mapping.workers import FrameWorkers

    work = partial(acquired, parameters=Parameters())
    items = [SegmentedFrame(frame, masks, None, False) for frame, masks in seen] * (ROUNDS * jobs)
    with FrameWorkers(jobs, lambda _: None) as workers:
        list(workers.each(work, items[: 2 * jobs]))  # all have begun
        many_s, many = min((_wall_s(workers.each, work, items) for _ in range(TRIES)), key=lambda each: each[0])
    one_s, one = min((_wall_s(map, work, items[: len(seen)]) for _ in range(TRIES)), key=lambda each: each[0])
    points = [[o.points for o in got.observations] for got in (*one, *many[: len(one)])]
    half = zip(points[: len(one)], points[len(one) :], strict=True)
    same = all(len(a) == len(b) and all(map(np.array_equal, a, b)) for a, b in half)
    return one_s / len(one), many_s / len(many), same


def _wall_s(
    each: Each, work: Callable[[SegmentedFrame], Acquired], items: list[SegmentedFrame]
) -> tuple[float, list[Acquired]]:
    began = time.perf_counter()
    got = list(each(work, items))
    return time.perf_counter() - began, got
