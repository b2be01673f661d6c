"""Acquisition of 640x480 frames full of masks: CPU time a frame on one core, and clusters by kd-tree pairs beside it.

The yardstick is only of the clusters, the part that costs most: DBSCAN over voxels with all pairs within eps. Fails
where the clusters differ.
"""

from __future__ import annotations

import argparse
from typing import Any

from robot_app.benches.cpu import beside_plain, count, cpu_s, said
from robot_app.cli import Failure, print_json


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--masks", type=count, default=20, metavar="N", help="in each frame (default 20)")
    parser.add_argument("--frames", type=count, default=5, metavar="N", help="unlike each other (default 5)")


def run(options: argparse.Namespace) -> None:
    result = _measured(options.masks, options.frames)
    if options.json:
        print_json(result)
    else:
        print(
            f"{result['frames']} frames of {result['masks']} masks: {result['ms_per_frame']:.1f} ms of CPU a frame "
            f"({result['frames_per_s']:.0f} frames/s a core), of it the clusters {result['clusters_ms_per_frame']:.1f} "
            f"ms; {said(result)}"
        )
    if not result["equal"]:
        raise Failure("the plain way found other clusters: that is a defect, please report it with this machine's name")


def _measured(masks: int, frames: int) -> dict[str, Any]:
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
    return {
        "frames": frames,
        "masks": masks,
        "observations": sum(len(observed) for observed, _ in made),
        "voxels": sum(o.n for observed, _ in made for o in observed),
        "ms_per_frame": round(1e3 * whole_s / frames, 2),
        "frames_per_s": round(frames / whole_s, 1),
        "clusters_ms_per_frame": round(1e3 * ours_s / frames, 2),
    } | beside_plain(ours_s, plain_s, equal)
