"""Goal poses on a site of furnished rooms, for candidates at several distances, and for one behind a wall across the
site that has no door, or one at its end; Dijkstra over the whole grid beside it.

The yardstick is only of the ways' lengths, the part that grows with the site. Fails where these differ: by anything up
to 119 m; beyond, where they lead along a lattice of 0.2 m, by more than a tenth.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass, replace
from functools import cache
from typing import TYPE_CHECKING, Any

from robot_app import arguments
from robot_app.benches.cpu import beside_plain, count, cpu_s, peak_mb, said
from robot_app.cli import Failure, print_json

if TYPE_CHECKING:
    from openbelief.arrays import Array
    from openbelief.goal_pose import GoalSearch
    from openbelief.pose import Pose2
    from openbelief.traversability import OccupancyGrid

EXACT_M, LONGER = 119.0, 0.1  # ways up to here are the shortest, beyond they may be longer by such a share

SIDE_M = arguments.number("metres", 16, 1000)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--site", type=SIDE_M, default=200.0, metavar="M", help="its side in metres (default 200)")
    parser.add_argument(
        "--rooms-away", type=count, nargs="+", default=[1, 2, 5, 10, 20], metavar="N", help="default 1 2 5 10 20"
    )
    parser.add_argument("--no-plain", action="store_true", help="without the yardstick: it needs 3 GB on 200 m")


def run(options: argparse.Namespace) -> None:
    from robot_app.benches.synthetic import ROOM_M

    rooms = int(options.site // ROOM_M)
    if max(options.rooms_away) + 1 > rooms:
        raise Failure(f"a site of {options.site:g} m has no room so far away: along a side lie {rooms} of {ROOM_M:g} m")
    rows = [_row(case, not options.no_plain) for case in _cases(options.site, options.rooms_away)]
    if options.json:
        print_json({"site_m": options.site, "candidates": rows})
    else:
        print("\n".join(_line(row) for row in rows))
    if any(row["equal"] is False for row in rows):
        raise Failure("the plain way found other lengths: that is a defect, please report it with this machine's name")


@dataclass(frozen=True)
class Case:
    """A candidate: so many rooms from the robot, along x. wall: one across the whole site stands between."""

    side_m: float
    rooms_away: int
    wall: str = ""  # "no door" | "door at its end"

    @property
    def begin(self) -> int:
        """The robot's room: that in the middle, or as far before it as the candidate needs."""
        from robot_app.benches.synthetic import ROOM_M

        rooms = int(self.side_m // ROOM_M)
        return min(0, rooms - rooms // 2 - 1 - self.rooms_away)

    @property
    def robot(self) -> Pose2:
        from robot_app.benches.synthetic import middle_of_room

        return middle_of_room(self.begin)

    @property
    def candidate(self) -> Array:
        """(n, 3) points."""
        from robot_app.benches.synthetic import middle_of_room, thing

        there = middle_of_room(self.begin + self.rooms_away)
        return thing(there.x, there.y)

    @property
    def grid(self) -> OccupancyGrid:
        from robot_app.benches.synthetic import ROOM_M

        return _floor(self.side_m, ROOM_M * (self.begin + 1) if self.wall else None, self.wall == "door at its end")


def _cases(side_m: float, rooms_away: list[int]) -> list[Case]:
    walls = [Case(side_m, min(rooms_away), wall) for wall in ("no door", "door at its end")]
    return [*(Case(side_m, away) for away in rooms_away), *walls]


@cache
def _floor(side_m: float, cut_m: float | None, door_at_end: bool) -> OccupancyGrid:
    from robot_app.benches.synthetic import floor

    return floor(side_m, cut_m=cut_m, door_at_end=door_at_end)


def _row(case: Case, with_plain: bool) -> dict[str, Any]:
    ours_s, found = cpu_s(lambda: _found(case), times=3)
    row: dict[str, Any] = {
        "rooms_away": case.rooms_away,
        "wall": case.wall,
        "poses": len(found.poses),
        "way_m": round(found.poses[0].path_length_m, 2) if found.poses else None,
        "because": found.reason,
        "cpu_s": round(ours_s, 4),
        "peak_mb": peak_mb(),
    }
    if not with_plain:
        return row | beside_plain(ours_s, None, None)
    plain_s, longer = _beside(case, found)
    most = 0.0 if row["way_m"] is None or row["way_m"] <= EXACT_M else LONGER
    return row | beside_plain(ours_s, plain_s, 0 <= longer <= most) | {"longer": round(longer, 4)}


def _found(case: Case) -> GoalSearch:
    from openbelief.g1 import T_BASE_CAMERA
    from openbelief.goal_pose import goal_poses
    from openbelief.parameters import Parameters
    from robot_app.benches.synthetic import CAMERA

    return goal_poses(case.candidate, case.grid, case.robot, T_BASE_CAMERA, CAMERA, Parameters())


def _beside(case: Case, found: GoalSearch) -> tuple[float, float]:
    """The yardstick's CPU seconds, and by what share our ways are longer than its; inf where only one says no way."""
    import numpy as np

    places = [goal.pose.xy for goal in found.poses] or [case.candidate[0, :2] - STANDING_OFF_M]
    cells = case.grid.cell(np.array(places))
    same = replace(case, rooms_away=0) if case.begin == 0 and not case.wall else case  # robot and grid
    plain_s, everywhere_m = _plain(same)
    lengths_m = everywhere_m[tuple(cells.T)]
    if not found.poses or np.isinf(lengths_m).any():
        return plain_s, 0.0 if not found.poses and np.isinf(lengths_m).all() else float("inf")
    longer = np.array([goal.path_length_m for goal in found.poses]) / lengths_m - 1
    return plain_s, float(longer[np.argmax(np.abs(longer))])


@cache
def _plain(case: Case) -> tuple[float, Array]:
    """CPU seconds and (h, w) metres of the ways from the robot; of candidates that share a robot and a grid once."""
    from openbelief.goal_pose import ROBOT_RADIUS_M
    from robot_app.benches import plain

    return cpu_s(lambda: plain.way_lengths_m(case.grid, ROBOT_RADIUS_M, case.robot))


STANDING_OFF_M = 0.7  # of the candidate's corner


def _line(row: dict[str, Any]) -> str:
    way = f"{row['poses']} poses, the first {row['way_m']:.1f} m away" if row["poses"] else row["because"].rstrip(".")
    away = f"{row['rooms_away']} rooms away{', behind a wall, ' if row['wall'] else ''}{row['wall']}"
    longer = f", {row['longer']:.1%} longer" if row.get("longer") else ""
    return f"{away}: {way}: {row['cpu_s']:.3f} s of CPU, {row['peak_mb']} MB; {said(row)}{longer}"
