"""Goal poses on a site of furnished rooms, for candidates at several distances; Dijkstra over the whole grid beside it.

The yardstick is only of the ways' lengths, the part that grows with the site. Fails where these differ.
"""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

from robot_app.benches.cpu import beside_plain, count, cpu_s, peak_mb, said
from robot_app.cli import Failure, print_json

if TYPE_CHECKING:
    from openbelief.goal_pose import GoalSearch
    from openbelief.parameters import Parameters
    from openbelief.pose import Pose2
    from openbelief.traversability import OccupancyGrid


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--site", type=_side, default=200.0, metavar="M", help="its side in metres (default 200)")
    parser.add_argument(
        "--rooms-away", type=count, nargs="+", default=[1, 2, 5, 10], metavar="N", help="candidates (default 1 2 5 10)"
    )
    parser.add_argument("--no-plain", action="store_true", help="without the yardstick: it needs 3 GB on 200 m")


def run(options: argparse.Namespace) -> None:
    from robot_app.benches.synthetic import ROOM_M

    if max(options.rooms_away) + 1 > options.site / 2 / ROOM_M:
        raise Failure(
            f"a site of {options.site:g} m has no room so far away: from its middle it has {ROOM_M:g} m rooms"
        )
    rows = _measured(options.site, options.rooms_away, not options.no_plain)
    if options.json:
        print_json({"site_m": options.site, "candidates": rows})
    else:
        print("\n".join(_line(row) for row in rows))
    if any(row["equal"] is False for row in rows):
        raise Failure("the plain way found other lengths: that is a defect, please report it with this machine's name")


def _measured(side_m: float, rooms_away: list[int], with_plain: bool) -> list[dict[str, Any]]:
    from openbelief.g1 import T_BASE_CAMERA
    from openbelief.goal_pose import goal_poses
    from openbelief.parameters import Parameters
    from robot_app.benches import synthetic

    grid, robot, parameters = synthetic.floor(side_m), synthetic.middle_of_room(0), Parameters()
    goal_poses(synthetic.thing(robot.x + 2, robot.y), grid, robot, T_BASE_CAMERA, synthetic.CAMERA, parameters)
    return [_row(away, grid, robot, parameters, with_plain) for away in rooms_away]


def _row(away: int, grid: OccupancyGrid, robot: Pose2, parameters: Parameters, with_plain: bool) -> dict[str, Any]:
    from openbelief.g1 import T_BASE_CAMERA
    from openbelief.goal_pose import goal_poses
    from robot_app.benches import synthetic

    there = synthetic.middle_of_room(away)
    points = synthetic.thing(there.x, there.y)
    ours_s, found = cpu_s(lambda: goal_poses(points, grid, robot, T_BASE_CAMERA, synthetic.CAMERA, parameters), times=3)
    row = {
        "rooms_away": away,
        "poses": len(found.poses),
        "way_m": round(found.poses[0].path_length_m, 2) if found.poses else None,
        "cpu_s": round(ours_s, 4),
        "peak_mb": peak_mb(),
    }
    return row | _beside(found, ours_s, grid, robot, with_plain)


def _beside(found: GoalSearch, ours_s: float, grid: OccupancyGrid, robot: Pose2, with_plain: bool) -> dict[str, Any]:
    import numpy as np

    from openbelief.goal_pose import ROBOT_RADIUS_M
    from robot_app.benches import plain

    if not (with_plain and found.poses):
        return beside_plain(ours_s, None, None)
    cells = grid.cell(np.array([goal.pose.xy for goal in found.poses]))
    plain_s, lengths_m = cpu_s(lambda: plain.way_lengths_m(grid, ROBOT_RADIUS_M, robot, cells))
    equal = [goal.path_length_m for goal in found.poses] == lengths_m.tolist()
    return beside_plain(ours_s, plain_s, equal)


def _line(row: dict[str, Any]) -> str:
    way = "no pose" if row["way_m"] is None else f"{row['poses']} poses, the first {row['way_m']:.1f} m away"
    return f"{row['rooms_away']} rooms away: {way}: {row['cpu_s']:.3f} s of CPU, {row['peak_mb']} MB; {said(row)}"


def _side(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 16.0 <= value <= 1000.0:
        raise argparse.ArgumentTypeError(f"a side should be a number of metres from 16 to 1000, got '{text}'")
    return value
