"""One mission on file: what it consumed and decided, with its memory, configuration, versions and commit."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
from pydantic import ValidationError

from drivers.ports import CameraFrame, Clock, LidarCloud
from drivers.ros.clouds import cloud_message, cloud_of
from drivers.ros.convert import color_message, grid_message
from drivers.ros.messages import Message, WireError, decode, encode, header, make
from logs.mcap_io.reader import LogError, LogMessage, LogReader
from logs.record.recorder import McapRecorder
from logs.structured import logger
from logs.trial.journal import Attached, Entry, Sound
from logs.trial.records import RECORDS, Cloud, Ended, Frame, MapUsed, Query, Record, Spoken, Transition
from logs.versions import commit, versions
from openbelief.arrays import Array
from openbelief.documents import from_json
from openbelief.traversability import OccupancyGrid

FORMAT = "openbelief.trial/1"
MEMORY_MAX_BYTES = 64 << 20  # a larger memory is named by its hash, and a replay takes --memory
MEMORY_NAME, SETTINGS_NAME, CONFIGURATION_NAME = "memory.belief", "mission.json", "robot.toml"
COLOR, DEPTH = "/trial/frame/color", "/trial/frame/depth"
GRID, HEIGHTS, POINTS = "/trial/map/grid", "/trial/map/heights", "/trial/cloud/points"
CLOUD = "sensor_msgs/msg/PointCloud2"
IMAGE, OCCUPANCY = "sensor_msgs/msg/Image", "nav_msgs/msg/OccupancyGrid"


class TrialError(ValueError):
    """The file is no whole trial; the text is one line with the cause and the remedy."""


class NoTrial(TrialError):
    """The file is a whole recording of something else, a walk perhaps."""


@dataclass(frozen=True, kw_only=True)
class TrialHeader:
    """What a trial says about itself. settings: parameters and policy of the mission, JSON values.

    memory_hash: of the memory's content. state_hash: of its content and rooms; None in a trial that is older than it.
    """

    trial_id: str
    query_id: str
    memory_hash: str
    state_hash: str | None = None
    text_encoder_id: str
    settings: Mapping[str, Any]


class TrialWriter:
    """A Journal on file: `with TrialWriter(path, clock, ...) as journal: Mission(..., journal).run(sentence)`.

    What a decision saw is written losslessly before it, and is on the disk when the decision is. A disk that fails does
    not stop the mission; `failure` says so.
    """

    def __init__(
        self, path: Path, clock: Clock, *, about: TrialHeader, memory_path: Path, configuration: str | None = None
    ) -> None:
        """memory_path: the .belief file in use. configuration: the text of robot.toml."""
        self._recorder = McapRecorder(path, clock)
        self._clock, self._about, self._memory_path, self._configuration = clock, about, memory_path, configuration
        self._grids: set[str] = set()

    def __enter__(self) -> TrialWriter:
        self._recorder.__enter__()
        self._recorder.metadata("trial", self._identity())
        self._recorder.metadata("versions", versions())
        self._recorder.attach(SETTINGS_NAME, "application/json", json.dumps(self._about.settings).encode())
        if self._configuration is not None:
            self._recorder.attach(CONFIGURATION_NAME, "application/toml", self._configuration.encode())
        if self._memory_path.stat().st_size <= MEMORY_MAX_BYTES:
            self._recorder.attach(MEMORY_NAME, "application/vnd.sqlite3", self._memory_path.read_bytes())
        self._recorder.flush()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._recorder.close()

    @property
    def failure(self) -> str | None:
        """Why the trial is not on the disk, None while it is."""
        return self._recorder.failure

    def write(self, record: Record, attached: Attached = None) -> None:
        if isinstance(attached, CameraFrame):
            self._image(color_message(attached.stamp_ns, attached.frame_id, attached.color), COLOR, attached.stamp_ns)
            self._image(_float_image(attached.stamp_ns, attached.frame_id, attached.depth_m), DEPTH, attached.stamp_ns)
        elif isinstance(attached, LidarCloud):
            self._recorder.write_cdr(POINTS, CLOUD, attached.stamp_ns, encode(cloud_message(attached)))
        elif isinstance(attached, OccupancyGrid) and isinstance(record, MapUsed):
            self._grid(record.sha256, attached)
        elif isinstance(attached, Sound) and isinstance(record, Spoken):
            self._recorder.attach(record.audio, "audio/wav", attached.wav)
        self._recorder.write_json(record.topic, record, self._clock.now_ns())
        if record.role == "decision":
            self._recorder.flush()
        if isinstance(record, (Transition, Ended)):  # the story; its details are in the trial
            logger().info(record.topic, facts=record.model_dump(mode="json"))

    def _identity(self) -> dict[str, str]:
        about = self._about
        return {
            "format": FORMAT,
            "trial_id": about.trial_id,
            "query_id": about.query_id,
            "memory_hash": about.memory_hash,
            **({"state_hash": about.state_hash} if about.state_hash else {}),
            "text_encoder_id": about.text_encoder_id,
            "commit": commit(),
            "started_ns": str(self._clock.now_ns()),
        }

    def _image(self, message: Message, topic: str, stamp_ns: int) -> None:
        self._recorder.write_cdr(topic, IMAGE, stamp_ns, encode(message))

    def _grid(self, sha256: str, grid: OccupancyGrid) -> None:
        if sha256 in self._grids:
            return
        self._grids.add(sha256)
        if grid.heights_m is not None:
            self._image(_float_image(grid.stamp_ns, "map", grid.heights_m), HEIGHTS, grid.stamp_ns)
        self._recorder.write_cdr(GRID, OCCUPANCY, grid.stamp_ns, encode(grid_message(grid)))


class TrialReader:
    """A whole trial. Raises TrialError (or LogError) with one line where it is damaged, cut off or no trial.

    entries: every record in the order in which it was written, with its images or grid.
    """

    def __init__(self, path: Path) -> None:
        self.path, self._log = path, LogReader(path)
        metadata = self._log.metadata()
        identity = metadata.get("trial", {})
        if "format" not in identity:
            raise NoTrial(f"{path} is no trial, but a recording of something else")
        if identity["format"] != FORMAT:
            raise TrialError(
                f"{path} is a trial of format {identity['format']}, and this openbelief replays {FORMAT}: replay it "
                f"with the commit that recorded it ({identity.get('commit', 'unknown')}), or add its migration "
                "(tests/replay/README.md says how)"
            )
        self.versions, self.commit = metadata.get("versions", {}), identity.get("commit", "unknown")
        self.started_ns = int(identity["started_ns"])
        self._attachments = {a.name: a.data for a in self._log.attachments()}
        if SETTINGS_NAME not in self._attachments:
            raise TrialError(f"{path} lacks {SETTINGS_NAME}: it was edited; copy it from the robot again")
        self.about = TrialHeader(
            trial_id=identity["trial_id"],
            query_id=identity["query_id"],
            memory_hash=identity["memory_hash"],
            state_hash=identity.get("state_hash"),
            text_encoder_id=identity["text_encoder_id"],
            settings=from_json(self._attachments[SETTINGS_NAME]),
        )
        self.entries = list(self._read())

    @property
    def memory_bytes(self) -> bytes | None:
        """The attached .belief file, None where only its hash was kept."""
        return self._attachments.get(MEMORY_NAME)

    @property
    def configuration(self) -> str | None:
        """The text of its robot.toml, None where it had none."""
        data = self._attachments.get(CONFIGURATION_NAME)
        return None if data is None else data.decode()

    @property
    def records(self) -> list[Record]:
        return [entry.record for entry in self.entries]

    @property
    def decisions(self) -> list[Record]:
        return [record for record in self.records if record.role == "decision"]

    @property
    def query(self) -> Query:
        found = next((record for record in self.records if isinstance(record, Query)), None)
        if found is None:
            raise TrialError(f"{self.path} holds no query: it was cut off before the mission began")
        return found

    @property
    def outcome(self) -> Ended | None:
        """None where the trial was cut off before its end."""
        return next((record for record in reversed(self.records) if isinstance(record, Ended)), None)

    def whole(self) -> TrialReader:
        """Itself; raises TrialError where the mission's end is missing."""
        if self.outcome is None:
            raise TrialError(f"{self.path} was cut off before the mission's end: it has no outcome to compare")
        return self

    def _read(self) -> Iterator[Entry]:
        pictures: dict[str, Message] = {}
        grids: dict[str, OccupancyGrid] = {}
        for message in self._log:
            try:
                if message.topic in (COLOR, DEPTH, GRID, HEIGHTS, POINTS):
                    pictures[message.topic] = decode(message.payload, message.type_name)
                elif message.topic in RECORDS:
                    entry = _entry(message, pictures, grids, self._attachments)
                    yield replace(entry, log_time_ns=message.log_time_ns)
            except (ValidationError, WireError, KeyError, ValueError) as error:
                if isinstance(error, LogError):
                    raise
                raise TrialError(
                    f"{self.path}: a record on {message.topic} cannot be read: {_first_words(error)}"
                ) from error


def _first_words(error: Exception) -> str:
    """One line; of pydantic's several, the field and what is wrong with it."""
    if isinstance(error, ValidationError):
        first = error.errors(include_url=False)[0]
        return f"{'.'.join(map(str, first['loc'])) or 'it'}: {first['msg']}"
    return str(error).splitlines()[0] if str(error) else type(error).__name__


def _entry(
    message: LogMessage,
    pictures: dict[str, Message],
    grids: dict[str, OccupancyGrid],
    attachments: Mapping[str, bytes],
) -> Entry:
    record = RECORDS[message.topic].model_validate_json(message.payload)
    if isinstance(record, Frame):
        color, depth = pictures.pop(COLOR), pictures.pop(DEPTH)
        pixels = np.frombuffer(color.data, np.uint8).reshape(color.height, color.width, 3)
        frame = CameraFrame(record.stamp_ns, pixels, _floats(depth), record.intrinsics.intrinsics(), record.frame_id)
        return Entry(record, frame)
    if isinstance(record, Cloud):
        return Entry(record, _cloud_of(record, pictures))
    if isinstance(record, MapUsed):
        if record.sha256 not in grids:
            grids[record.sha256] = _grid_of(record, pictures)
        return Entry(record, grids[record.sha256])
    if isinstance(record, Spoken):
        return Entry(record, Sound(attachments[record.audio]))
    return Entry(record)


def _grid_of(record: MapUsed, pictures: dict[str, Message]) -> OccupancyGrid:
    """The grid exactly as it was: its resolution is the record's, for the message's is a float32."""
    cells = np.asarray(pictures.pop(GRID).data, dtype=np.int8).reshape(record.shape)
    heights = _floats(pictures.pop(HEIGHTS)) if record.has_heights else None
    grid = OccupancyGrid(cells, record.resolution_m, record.origin_xy, record.stamp_ns, heights)
    if MapUsed.of(grid).sha256 != record.sha256:
        raise ValueError("the grid is not the one that the record names")
    return grid


def _cloud_of(record: Cloud, pictures: dict[str, Message]) -> LidarCloud:
    cloud = cloud_of(pictures.pop(POINTS))
    if len(cloud.points) != record.count:
        raise ValueError(f"the cloud has {len(cloud.points)} points, its record names {record.count}")
    return cloud


def _float_image(stamp_ns: int, frame_id: str, values: Array) -> Message:
    """sensor_msgs/Image 32FC1: lossless."""
    pixels = np.ascontiguousarray(values, dtype="<f4")
    return make(
        IMAGE,
        header=header(stamp_ns, frame_id),
        height=pixels.shape[0],
        width=pixels.shape[1],
        encoding="32FC1",
        step=4 * pixels.shape[1],
        data=pixels.view(np.uint8).ravel(),
    )


def _floats(image: Message) -> Array:
    """(h, w) float32."""
    return np.frombuffer(np.ascontiguousarray(image.data), "<f4").reshape(image.height, image.width)
