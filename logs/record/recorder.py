"""Record messages, JSON records, attachments and metadata to ROS 2 MCAP; a crash loses the open chunk at most."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from drivers.ports import Clock
from logs.mcap_io.file import ChannelSpec, McapFile
from logs.mcap_io.scan import MAX_ATTACHMENT_BYTES, MAX_CHUNK_BYTES
from logs.record.disk import DiskBudget, DiskRoom
from logs.record.event_log import EventLog
from logs.record.recording_files import events_of, next_file, require_unused
from logs.record.schemas import cdr_channel, json_channel
from logs.structured import logger
from openbelief.lifetime import Lifetime

if TYPE_CHECKING:
    from pydantic import BaseModel

LATCHED = {"/tf_static": 32, "/map": 1}  # topic -> how many of its newest messages begin every file of a recording
MAX_MESSAGE_BYTES = MAX_CHUNK_BYTES // 2  # a chunk holds a message and up to 1 MB before it


@dataclass(frozen=True)
class Rotation:
    """When a recording goes on in a new file: `walk.mcap`, `walk_001.mcap`, ..."""

    every_s: float = 300.0
    every_bytes: int = 1_000_000_000


@dataclass(frozen=True)
class _Message:
    spec: ChannelSpec
    stamp_ns: int
    payload: bytes
    log_time_ns: int | None = None


class McapRecorder(Lifetime):
    """`with McapRecorder(path, clock) as recorder: recorder.write_cdr(...)`; any thread may write.

    Written as `PATH.partial`, renamed when whole. A disk that is full or fails does not stop the mission: the recorder
    turns `failed`, says why in `failure`, in the log and in `NAME.events.jsonl` (whose room was reserved), keeps what
    was written (`openbelief recover PATH.partial`), and counts the messages it lost in `dropped`. Misuse raises:
    ValueError for a message of more than 32 MiB, FileExistsError at the start rather than overwrite a recording or run
    into the later files of an old one.

    Bounds: one open chunk of about 1 MB and its index in memory, plus the newest messages of `LATCHED` topics.
    """

    def __init__(
        self,
        path: str | Path,
        clock: Clock,
        *,
        rotation: Rotation | None = None,
        disk: DiskBudget | None = None,
        tell: Callable[[str], None] | None = None,
    ) -> None:
        """disk: None leaves the free space unwatched. tell: hears a failure's or warning's sentence, must not block."""
        self.path = Path(path)
        self.failure: str | None = None
        self.dropped = 0
        self.paths: list[Path] = []
        self._clock, self._rotation, self._disk, self._tell = clock, rotation, disk, tell
        self._lock = threading.RLock()
        self._file: McapFile | None = None
        self._events = EventLog(events_of(self.path))
        self._last_ns = self._opened_ns = self._checked_ns = 0
        self._room = DiskRoom.OK
        self._metadata: dict[str, dict[str, str]] = {}
        self._calibration: dict[str, tuple[str, bytes]] = {}
        self._latched: dict[str, deque[_Message]] = {}

    def start(self) -> None:
        with self._lock:
            require_unused(self.path, rotated=self._rotation is not None)
            self._file = McapFile(self.path).open()
            try:
                self._events.open()
            except BaseException:
                self._file.abandon().unlink()
                raise
            self._opened_ns = self._now_ns()

    @property
    def state(self) -> str:
        """`idle`, `recording`, `failed` or `closed`."""
        if self.failure is not None:
            return "failed"
        if self._file is not None:
            return "recording"
        return "closed" if self.paths else "idle"

    def write_cdr(
        self, topic: str, type_name: str, stamp_ns: int, payload: bytes, *, log_time_ns: int | None = None
    ) -> None:
        """A ROS message as it is on the wire. Raises drivers.ros.messages.WireError for an unknown type.

        log_time_ns: when it was taken, where that was before now (a queue lies between).
        """
        spec = cdr_channel(topic, type_name, latched=topic in LATCHED)
        self._write(_Message(spec, stamp_ns, payload, log_time_ns))

    def write_json(self, topic: str, model: BaseModel, stamp_ns: int) -> None:
        """One of our own records, with its JSON Schema."""
        self._write(_Message(json_channel(topic, type(model)), stamp_ns, model.model_dump_json().encode()))

    def attach(self, name: str, media_type: str, data: bytes, *, calibration: bool = False) -> None:
        """A file within the file. calibration: the newest of that name begins every later file of the recording."""
        if len(data) > MAX_ATTACHMENT_BYTES:
            raise ValueError(f"attachment {name} has {len(data)} bytes, more than the limit of {MAX_ATTACHMENT_BYTES}")
        with self._lock:
            if calibration:
                self._calibration[name] = media_type, data
            self._do(lambda file: file.attach(name, media_type, data, log_time_ns=self._now_ns()))

    def metadata(self, name: str, values: Mapping[str, str]) -> None:
        """Named strings about the recording (run id, commit, operator, site); repeated in every file of it."""
        with self._lock:
            self._metadata[name] = dict(values)
            self._do(lambda file: file.metadata(name, values))

    def flush(self) -> None:
        """Everything written so far is on the disk when this returns (or `failure` says why not)."""
        with self._lock:
            self._do(McapFile.flush)

    def close(self) -> None:
        """Finish the file and give it its name. Closing twice is once."""
        with self._lock:
            if self._file is not None:
                self._do(self._finish)
                self._file = None
            self._close_events()

    def _write(self, message: _Message) -> None:
        if len(message.payload) > MAX_MESSAGE_BYTES:
            raise ValueError(
                f"a message on {message.spec.topic} has {len(message.payload)} bytes, "
                f"more than the limit of {MAX_MESSAGE_BYTES}"
            )
        with self._lock:
            now_ns = self._now_ns(message.log_time_ns)
            self._do(lambda file: self._look_around(file, now_ns))
            if self._file is None:
                self.dropped += 1
                return
            self._do(lambda file: self._put(file, message))
            self._remember(message)

    def _put(self, file: McapFile, message: _Message) -> None:
        log_time_ns = self._now_ns(message.log_time_ns)
        file.write(message.spec, log_time_ns=log_time_ns, stamp_ns=message.stamp_ns, payload=message.payload)

    def _remember(self, message: _Message) -> None:
        keep = LATCHED.get(message.spec.topic)
        if keep is not None:
            newest = self._latched.setdefault(message.spec.topic, deque(maxlen=keep))
            if message not in newest:
                newest.append(message)

    def _do(self, action: Callable[[McapFile], None]) -> None:
        """Act on the file; what the disk refuses becomes `failure`, once. After that, and once closed: nothing."""
        if self.state == "idle":
            raise ValueError(f"the recorder of {self.path} is not started: use it as a context manager")
        if self._file is None:
            return
        try:
            action(self._file)
        except OSError as error:
            self._fail(f"recording stopped: {error.strerror or error}")

    def _fail(self, cause: str) -> None:
        file, self._file = self._file, None
        self.dropped += file.pending if file is not None else 0
        try:
            if file is not None and file.partial.exists():
                cause += f"; keep what was written with: openbelief recover {file.abandon()}"
        except OSError as error:
            cause += f"; closing the file failed too: {error.strerror}"
        self.failure = cause
        self._say("recording_failed", cause)

    def _say(self, event: str, sentence: str) -> None:
        log = logger()
        (log.error if self.failure else log.warning)(event, sentence=sentence, path=str(self.path))
        try:
            self._events.write(self._last_ns, event, sentence=sentence)
        except OSError as error:
            log.error("event_log_failed", sentence=str(error), path=str(self._events.path))
        if self._tell is not None:
            self._tell(sentence)

    def _close_events(self) -> None:
        try:
            self._events.close()
        except OSError as error:
            logger().error("event_log_failed", sentence=str(error), path=str(self._events.path))

    def _finish(self, file: McapFile) -> None:
        self.paths.append(file.finish())

    def _look_around(self, file: McapFile, now_ns: int) -> None:
        """Before a message: is there room, is it time for a new file?"""
        if self._disk is not None and now_ns - self._checked_ns >= self._disk.check_every_s * 1e9:
            self._checked_ns = now_ns
            self._check_disk(file, self._disk)
        if self._file is not None and self._rotation is not None and self._is_due(file, self._rotation, now_ns):
            self._rotate(file, now_ns)

    def _check_disk(self, file: McapFile, disk: DiskBudget) -> None:
        room, sentence = disk.room(self.path.parent)
        if room == self._room:
            return
        self._room = room
        if room == DiskRoom.FULL:
            self._finish(file)
            self._file, self.failure = None, f"recording stopped: {sentence}"
            self._say("disk_full", self.failure)
        elif room == DiskRoom.LOW:
            self._say("disk_low", sentence)

    def _is_due(self, file: McapFile, rotation: Rotation, now_ns: int) -> bool:
        return file.bytes_written >= rotation.every_bytes or now_ns - self._opened_ns >= rotation.every_s * 1e9

    def _rotate(self, file: McapFile, now_ns: int) -> None:
        """Finish this file; begin the next with all that a reader of it alone needs."""
        self._finish(file)
        following = self._file = next_file(self.path, len(self.paths))
        self._opened_ns = now_ns
        for key, values in self._metadata.items():
            following.metadata(key, values)
        for name, (media_type, data) in self._calibration.items():
            following.attach(name, media_type, data, log_time_ns=self._opened_ns)
        for newest in self._latched.values():
            for message in newest:
                self._put(following, replace(message, log_time_ns=now_ns))

    def _now_ns(self, taken_ns: int | None = None) -> int:
        """When a message was taken, else the clock's time; never less than before: log times do not run backwards."""
        self._last_ns = max(self._last_ns, self._clock.now_ns() if taken_ns is None else taken_ns)
        return self._last_ns
