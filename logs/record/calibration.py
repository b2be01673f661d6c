"""The calibration of a recording's sensors as a sheet of its own: each camera's numbers, and what is mounted where."""

from __future__ import annotations

import json
from typing import Any

from drivers.ros.convert import StampedTransform, transforms_of
from drivers.ros.messages import Message, WireError, decode
from drivers.topics import CAMERA_INFO_TYPE, TF_STATIC
from logs.record.queued import Cdr
from logs.record.recorder import McapRecorder

NAME = "calibration.json"


class CalibrationSheet:
    """Attaches calibration.json to a recording, again where it changes; later files of the recording begin with it.

    `see` every message that was written. Metres, quaternions as xyzw, matrices by rows; a later sheet replaces an
    earlier one.
    """

    def __init__(self, recorder: McapRecorder) -> None:
        self._recorder = recorder
        self._infos: dict[str, dict[str, Any]] = {}
        self._transforms: dict[str, dict[str, Any]] = {}

    def see(self, cdr: Cdr) -> None:
        """What cannot be read is no calibration; it stays in the recording as it is."""
        try:
            changed = self._take(cdr)
        except WireError:
            return
        if changed:
            sheet = {"camera_info": self._infos, "static_transforms": list(self._transforms.values())}
            self._recorder.attach(NAME, "application/json", json.dumps(sheet, indent=1).encode(), calibration=True)

    def _take(self, cdr: Cdr) -> bool:
        """Whether it said something new."""
        if cdr.type_name == CAMERA_INFO_TYPE:
            return _put(self._infos, cdr.topic, _camera_info(decode(cdr.payload, cdr.type_name)))
        if cdr.topic == TF_STATIC.name:
            mounts = transforms_of(decode(cdr.payload, cdr.type_name))
            return sum(_put(self._transforms, mount.child, _transform(mount)) for mount in mounts) > 0
        return False


def _put(known: dict[str, dict[str, Any]], key: str, value: dict[str, Any]) -> bool:
    before = known.get(key)
    known[key] = value
    return before != value


def _transform(mount: StampedTransform) -> dict[str, Any]:
    return {name: value for name, value in vars(mount).items() if name != "stamp_ns"}


def _camera_info(info: Message) -> dict[str, Any]:
    return {
        "frame_id": info.header.frame_id,
        "width": info.width,
        "height": info.height,
        "distortion_model": info.distortion_model,
        **{name: [float(value) for value in getattr(info, name)] for name in ("d", "k", "r", "p")},
    }
