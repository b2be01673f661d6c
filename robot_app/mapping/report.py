"""What openbelief map tells of a mapping: its report as JSON, and in lines for a person."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any

from logs.structured import neutralise
from openbelief.association import ExtentAlarm
from openbelief.memory import ObjectMemory
from openbelief.scene_graph import scene_graph
from robot_app.mapping.job import MapResult

ALARMS_SHOWN = 5


def report_of(out: Path, result: MapResult) -> dict[str, Any]:
    """`map --json`. out: where the memory lies."""
    memory = result.memory
    return {
        "memory": str(out),
        "content_hash": memory.content_hash,
        "state_hash": memory.state_hash,
        "recordings": [
            {
                "recording": reader.recording,
                "frames": len(reader.plan.frames),
                "skipped": dict(reader.skipped),
                "first_skips": _first_of_each(reader.skips),
                "damage": reader.damage,
                "notes": reader.notes,
                "maps_unusable": reader.storey_maps()[1],
            }
            for reader in result.readers
        ],
        "frames": result.taken.frames,
        "frames_resumed": result.resumed,
        "observations": len(memory.observations),
        "masks_refused": dict(result.taken.refused),
        "frames_unseen": dict(result.taken.unseen),
        "objects": len(memory.objects),
        "rooms": _rooms(memory),
        "lacks": scene_graph(memory).lacks,
        "extent_alarms": [_alarm(memory, alarm) for alarm in _foreground_alarms(memory)],
        "seconds": {stage: round(seconds, 3) for stage, seconds in result.seconds.items()},
    }


def _rooms(memory: ObjectMemory) -> list[dict[str, Any]]:
    """How many objects stand in each room; in none of them under the name None."""
    standing = Counter(node.room for node in memory.objects)
    rooms = [{"name": r.name, "given": r.given, "objects": standing[r.name]} for r in memory.rooms]
    return rooms + ([{"name": None, "objects": standing[None]}] if standing[None] else [])


def _foreground_alarms(memory: ObjectMemory) -> list[ExtentAlarm]:
    """Walls and floors are long by nature."""
    return [alarm for alarm in memory.extent_alarms() if not memory.objects[alarm.label].background]


def _alarm(memory: ObjectMemory, alarm: ExtentAlarm) -> dict[str, Any]:
    node = memory.objects[alarm.label]
    return {"object_id": node.id, "label": node.label, "extent_m": alarm.extent_m, "because": alarm.because}


def _first_of_each(skips: list[Any]) -> dict[str, str]:
    """Reason -> the details of its first image."""
    first: dict[str, str] = {}
    for skip in skips:
        first.setdefault(skip.reason, f"image {skip.index}: {skip.detail}")
    return first


def text_of(report: dict[str, Any]) -> str:
    """The same for a person: what was left out and why, what may be wrong, what came of it."""
    lines = []
    for each in report["recordings"]:
        lines += [f"{each['recording']}: {note}" for note in each["notes"]]
        for reason, count in Counter(each["skipped"]).most_common():
            example = each["first_skips"].get(reason)
            lines.append(f"skipped {count} x {reason}" + (f" (first: {example})" if example else ""))
        if each["damage"]:
            lines.append(f"{each['recording']} is damaged: {each['damage']}. Mapped what lies before the damage.")
        lines += [f"{each['recording']}: its navigation map is not used. {why}" for why in each["maps_unusable"]]
    lines += [f"could not look at {n} frames: {reason}" for reason, n in Counter(report["frames_unseen"]).most_common()]
    lines += [f"refused {n} masks: {reason}" for reason, n in Counter(report["masks_refused"]).most_common()]
    lines += alarm_lines(report["extent_alarms"])
    lines += [report["lacks"]] if report["lacks"] else []
    if any(room["name"] for room in report["rooms"]):
        standing = [f"{room['name'] or 'in none of them'} {room['objects']}" for room in report["rooms"]]
        lines.append(f"objects by room: {', '.join(standing)}")
    resumed = f" ({report['frames_resumed']} of them done before)" if report["frames_resumed"] else ""
    lines.append(
        f"{report['frames']} frames{resumed}, {report['observations']} observations, {report['objects']} objects "
        f"-> {report['memory']}"
    )
    spent = ", ".join(f"{stage} {seconds:.1f} s" for stage, seconds in report["seconds"].items())
    return "\n".join([*lines, f"time: {spent}", f"content hash {report['content_hash']}"])


def alarm_lines(alarms: list[dict[str, Any]]) -> list[str]:
    lines = [
        neutralise(f"object {a['object_id']} ({a['label'] or 'no phrase'}) may be several things: {a['because']}")
        for a in alarms[:ALARMS_SHOWN]
    ]
    more = len(alarms) - ALARMS_SHOWN
    return [*lines, f"and {more} more objects that may be several things (--json lists them)"] if more > 0 else lines
