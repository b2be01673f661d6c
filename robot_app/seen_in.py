"""Where did I see it: the views that show a thing, newest first, and their pictures with it marked."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from openbelief.memory import ObjectMemory
from openbelief.views import View, best_views, views_of
from robot_app.cli import Failure
from robot_app.pictures.sightings import view_with_thing

PICTURE_PX = 640
SHOWN = 10
FIRST_TIME_OF_DAY_NS = 946_684_800_000_000_000  # the year 2000


def views_of_object(memory: ObjectMemory, object_id: int) -> list[View]:
    """The views that show an object, newest first."""
    found = [view for view in views_of(memory, [memory.objects[object_id]]) if view.objects]
    return sorted(found, key=lambda view: (-view.stamp_ns, view.recording))


def best_view_of(memory: ObjectMemory, object_id: int) -> View | None:
    """The view that shows an object best, None where none does."""
    views = views_of(memory, [memory.objects[object_id]])
    index = best_views(views).get(object_id)
    return None if index is None else views[index]


def seen_in(memory: ObjectMemory, object_id: int, folder: Path) -> list[dict[str, Any]]:
    """One row for each of those views, as JSON; pictures go to `folder`. Raises Failure where it cannot be written."""
    views = views_of_object(memory, object_id)
    try:
        if any(view.camera for view in views):
            folder.mkdir(parents=True, exist_ok=True)
        return [_row(memory, object_id, view, folder, k) for k, view in enumerate(views, start=1)]
    except OSError as error:
        raise Failure(f"{folder} cannot be written: {error.strerror}.") from error


def _row(memory: ObjectMemory, object_id: int, view: View, folder: Path, rank: int) -> dict[str, Any]:
    sighting = view.sighting(object_id)
    pose = None if view.T_map_camera is None else view.T_map_camera.tolist()
    row: dict[str, Any] = {
        "object_id": object_id,
        "recording": view.recording,
        "stamp_ns": view.stamp_ns,
        "pose": pose,
        "share": sighting.share if sighting else None,
        "picture": None,
    }
    if view.camera is not None:
        masks = [o for o in memory.objects[object_id].observations if _of(o, view)]
        path = folder / f"object{object_id}_{rank:03d}_{view.stamp_ns}.jpg"
        path.write_bytes(view_with_thing(memory.surroundings.picture(view.camera), sighting, masks, PICTURE_PX))
        row["picture"] = str(path)
    return row


def _of(observation: Any, view: View) -> bool:
    """Was it taken in this view?"""
    source = observation.provenance
    return source is not None and (source.recording, source.stamp_ns) == (view.recording, view.stamp_ns)


def told(rows: list[dict[str, Any]], label: str | None) -> list[str]:
    """For people; the newest first."""
    if not rows:
        return ["no view shows it"]
    lines = [f"{len(rows)} views show object {rows[0]['object_id']} ({label or 'never named'}), newest first:"]
    for row in rows[:SHOWN]:
        share = f"{row['share']:.0%} of it" if row["share"] else "by its mask"
        picture = f" -> {row['picture']}" if row["picture"] else " (no picture in this file)"
        lines.append(f"  {row['recording']} at {_when(row['stamp_ns'])}: {share}{picture}")
    return [*lines, *([f"  and {len(rows) - SHOWN} more"] if len(rows) > SHOWN else [])]


def _when(stamp_ns: int) -> str:
    """As a clock on a wall says it; a recording whose stamps are no time of day counts seconds."""
    if stamp_ns < FIRST_TIME_OF_DAY_NS:
        return f"{stamp_ns / 1e9:.1f} s"
    at = datetime.fromtimestamp(stamp_ns / 1e9, UTC)
    return f"{at:%Y-%m-%d %H:%M:%S}.{at.microsecond // 100_000} UTC"
