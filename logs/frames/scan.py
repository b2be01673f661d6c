"""One pass over a recording: the stamps of all pictures, calibrations, transforms, and what could not be read."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Any

from drivers.ros.convert import transforms_of
from drivers.ros.images import COMPRESSED_IMAGE, IMAGE, is_depth
from drivers.ros.messages import Message, WireError, decode, stamp_to_ns
from drivers.ros.transform_edge import rigid
from drivers.ros.transform_tree import TransformTree
from drivers.topics import CAMERA_INFO_TYPE, GRID, MAP, TRANSFORMS
from logs.containers.recording import Recording
from logs.frames.clock_steps import Epochs, Mark
from logs.frames.topics import is_read
from logs.mcap_io.reader import LogMessage
from openbelief.arrays import Array

JOINED_GAP_NS = 10_000_000_000  # between the last message of a file and the first of the next part of the recording


@dataclass(frozen=True, slots=True)
class ImageHead:
    """An image that was not decoded. rank: among all of its topic in its file; file: the number of that file."""

    mark: Mark
    frame_id: str
    rank: int
    file: int = 0


Sample = tuple[Mark, Array | None]


@dataclass
class Scan:
    """What one pass found, by topic. foreign: topic -> (type, encoding) of what is not read.

    maps: the newest navigation map of each height (z of its origin, decimetres).
    """

    max_tf_gap_s: float
    color: dict[str, list[ImageHead]] = field(default_factory=lambda: defaultdict(list))
    depth: dict[str, list[ImageHead]] = field(default_factory=lambda: defaultdict(list))
    infos: dict[str, list[tuple[Mark, Message]]] = field(default_factory=lambda: defaultdict(list))
    moving: dict[tuple[str, str], list[Sample]] = field(default_factory=lambda: defaultdict(list))
    static: list[tuple[int, str, str, Array | None]] = field(default_factory=list)
    encodings: dict[str, set[str]] = field(default_factory=lambda: defaultdict(set))
    foreign: dict[str, tuple[str, str]] = field(default_factory=dict)
    types: dict[str, str] = field(default_factory=dict)
    unreadable: Counter[str] = field(default_factory=Counter)
    maps: dict[int, Message] = field(default_factory=dict)
    messages: int = 0
    log_times_ns: tuple[int, int] | None = None

    @property
    def images(self) -> dict[str, list[ImageHead]]:
        """Colour and depth."""
        return {**self.depth, **self.color}

    @cached_property
    def epochs(self) -> Epochs:
        streams: dict[Any, list[Mark]] = {t: [head.mark for head in heads] for t, heads in self.images.items()}
        return Epochs(streams | {edge: [mark for mark, _ in samples] for edge, samples in self.moving.items()})

    @cached_property
    def trees(self) -> list[TransformTree]:
        """The transforms of each epoch; the static ones are in all."""
        trees = [TransformTree(max_gap_s=self.max_tf_gap_s) for _ in range(len(self.epochs.steps) + 1)]
        for (parent, child), samples in self.moving.items():
            epoch = self.epochs.of_stream((parent, child))
            for mark, sample in sorted(samples, key=lambda s: self.epochs.place(s[0])):
                trees[epoch[mark.order]].add_sample(mark.stamp_ns, parent, child, sample)
        for tree in trees:
            for stamp_ns, parent, child, sample in self.static:
                tree.add_sample(stamp_ns, parent, child, sample, static=True)
        return trees

    @property
    def notes(self) -> list[str]:
        """What a person should know although frames can be made."""
        said = [
            f"its clock was set back by {step.back_s:.2f} s (from {step.before_ns / 1e9:.3f}): what came before and "
            "after is read apart"
            for step in self.epochs.steps
        ]
        return said + [quarrel for tree in self.trees for quarrel in tree.quarrels()]


def scan(log: Recording, max_tf_gap_s: float, file: int = 0) -> Scan:
    """One pass over the recording."""
    found = Scan(max_tf_gap_s)
    ranks: Counter[str] = Counter()
    for message in log:
        mark = Mark(found.messages, message.log_time_ns, message.stamp_ns)
        found.messages += 1
        found.types[message.topic] = message.type_name
        first, last = found.log_times_ns or (mark.log_time_ns, mark.log_time_ns)
        found.log_times_ns = min(first, mark.log_time_ns), max(last, mark.log_time_ns)
        if not is_read(message.encoding, message.type_name):
            found.foreign[message.topic] = (message.type_name, message.encoding)
        elif message.type_name in (IMAGE, COMPRESSED_IMAGE):
            _try(found, message, partial(_add_image, found, message, mark, ranks[message.topic], file))
            ranks[message.topic] += 1
        elif message.type_name in HANDLERS:
            _try(found, message, partial(HANDLERS[message.type_name], found, message, mark))
    return found


def joined(scans: Sequence[Scan]) -> Scan:
    """The scans of a split recording's files, in their order, as one."""
    whole = Scan(scans[0].max_tf_gap_s)
    for number, part in enumerate(scans):
        offset = whole.messages

        def later(mark: Mark, offset: int = offset) -> Mark:
            return replace(mark, order=mark.order + offset)

        for ours, theirs in ((whole.color, part.color), (whole.depth, part.depth)):
            for topic, heads in theirs.items():
                ours[topic] += [replace(head, mark=later(head.mark), file=number) for head in heads]
        for topic, infos in part.infos.items():
            whole.infos[topic] += [(later(mark), info) for mark, info in infos]
        for edge, samples in part.moving.items():
            whole.moving[edge] += [(later(mark), sample) for mark, sample in samples]
        for topic, names in part.encodings.items():
            whole.encodings[topic] |= names
        whole.static += part.static
        whole.foreign |= part.foreign
        whole.types |= part.types
        whole.unreadable += part.unreadable
        whole.messages += part.messages
    return whole


def follows(before: Scan, after: Scan) -> bool:
    """Whether one file goes on where the other ended, by the times of logging."""
    if before.log_times_ns is None or after.log_times_ns is None:
        return False
    return abs(after.log_times_ns[0] - before.log_times_ns[1]) <= JOINED_GAP_NS


def _try(found: Scan, message: LogMessage, add: Callable[[], None]) -> None:
    try:
        add()
    except WireError:
        found.unreadable[f"unreadable {message.type_name}"] += 1


def _add_image(found: Scan, message: LogMessage, mark: Mark, rank: int, file: int) -> None:
    image = decode(message.payload, message.type_name)
    kind = found.depth if is_depth(image) else found.color
    found.encodings[message.topic].add(str(getattr(image, "encoding", None) or getattr(image, "format", "")))
    stamped = replace(mark, stamp_ns=stamp_to_ns(image.header.stamp))
    kind[message.topic].append(ImageHead(stamped, image.header.frame_id, rank, file))


def _add_info(found: Scan, message: LogMessage, mark: Mark) -> None:
    info = decode(message.payload, message.type_name)
    found.infos[message.topic].append((replace(mark, stamp_ns=stamp_to_ns(info.header.stamp)), info))


def _add_map(found: Scan, message: LogMessage, mark: Mark) -> None:  # noqa: ARG001 - a map has no time of its own
    if message.topic == MAP.name:
        grid = decode(message.payload, message.type_name)
        found.maps[round(10 * grid.info.origin.position.z)] = grid


def _add_transforms(found: Scan, message: LogMessage, mark: Mark) -> None:
    static = message.topic.endswith("tf_static")
    for t in transforms_of(decode(message.payload, message.type_name)):
        parent, child = t.parent.lstrip("/"), t.child.lstrip("/")
        sample = rigid(t.translation, t.quaternion_xyzw)
        if sample is None:
            found.unreadable[f"transform {parent} -> {child} that is not rigid (NaN or no rotation)"] += 1
        if static:
            found.static.append((t.stamp_ns, parent, child, sample))
        else:
            found.moving[parent, child].append((replace(mark, stamp_ns=t.stamp_ns), sample))


HANDLERS: dict[str, Callable[[Scan, LogMessage, Mark], None]] = {
    CAMERA_INFO_TYPE: _add_info,
    TRANSFORMS: _add_transforms,
    GRID: _add_map,
}
