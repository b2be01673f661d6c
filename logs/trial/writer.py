"""One mission onto file: what it consumed and decided, with its memory, configuration, versions and commit."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path
from types import TracebackType

from drivers.ports import CameraFrame, Clock, LidarCloud
from drivers.ros.messages import encode
from logs.record.recorder import McapRecorder
from logs.structured import logger
from logs.trial import pictures
from logs.trial.header import CONFIGURATION_NAME, MEMORY_NAME, SETTINGS_NAME, TrialHeader
from logs.trial.journal import Attached, Sound
from logs.trial.records import Ended, MapUsed, Record, Spoken, Transition
from logs.versions import commit, versions
from openbelief.traversability import OccupancyGrid

MEMORY_MAX_BYTES = 64 << 20  # a larger memory is named by its hash, and a replay takes --memory


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
        self._recorder.start()
        identity = {"commit": commit(), "started_ns": str(self._clock.now_ns())}
        self._recorder.metadata("trial", self._about.as_metadata() | identity)
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
        self._attach(record, attached)
        self._recorder.write_json(record.topic, record, self._clock.now_ns())
        if record.role == "decision":
            self._recorder.flush()
        if isinstance(record, (Transition, Ended)):  # the story; its details are in the trial
            logger().info(record.topic, facts=record.model_dump(mode="json"))

    def _attach(self, record: Record, attached: Attached) -> None:
        """What the record is about, before the record; a grid once."""
        if isinstance(attached, CameraFrame):
            self._put(pictures.frame_messages(attached))
        elif isinstance(attached, LidarCloud):
            self._put(pictures.cloud_messages(attached))
        elif isinstance(attached, OccupancyGrid) and isinstance(record, MapUsed):
            if record.sha256 not in self._grids:
                self._grids.add(record.sha256)
                self._put(pictures.grid_messages(attached))
        elif isinstance(attached, Sound) and isinstance(record, Spoken):
            self._recorder.attach(record.audio, "audio/wav", attached.wav)

    def _put(self, messages: Iterable[pictures.Written]) -> None:
        for topic, type_name, stamp_ns, message in messages:
            self._recorder.write_cdr(topic, type_name, stamp_ns, encode(message))
