"""The /tf tree as data: a transform at a stamp, interpolated between its bracketing samples, or a named refusal."""

from __future__ import annotations

import math
import threading
from bisect import bisect_left, insort

import numpy as np

from drivers.ports import PoseUnavailable
from drivers.stamps import set_back
from openbelief.arrays import Array
from openbelief.pose import interpolate, inverse, transform

FORGOTTEN_NS = 2_000_000_000  # a live publisher that is silent for longer is taken to have been stopped


class TransformMissing(PoseUnavailable):
    """No chain of transforms joins the two frames."""


class TransformNotYet(PoseUnavailable):
    """The stamp is newer than the newest sample of an edge: it may still come, it is not extrapolated."""


class TransformTooOld(PoseUnavailable):
    """The stamp is older than the oldest sample kept of an edge."""


class TransformStale(PoseUnavailable):
    """The two samples that bracket the stamp are too far apart in time to interpolate between."""


class TransformInvalid(PoseUnavailable):
    """A bracketing sample is not a rigid transform (NaN, zero quaternion), or a frame has two parents."""


class TransformDisputed(TransformInvalid):
    """Two nodes publish an edge around the stamp, and disagree."""


MAX_GAP_S = 0.25
DISPUTE_M, DISPUTE_M_S = 0.05, 1.5  # there and back, farther and faster than a walking robot's odometry goes
DISPUTE_RAD, DISPUTE_RAD_S = 0.1, 5.0
DISPUTES = 3  # so many within DISPUTE_NS of a stamp; one or two are outliers of one publisher
DISPUTE_NS = 1_000_000_000


class Edge:
    """The samples T_parent_child of one edge, by stamp. A sample that is no rigid transform is kept as None.

    disputes: the stamps of samples that lie off both neighbours, which agree: another node publishes this edge, too.
    """

    def __init__(self, parent: str, child: str) -> None:
        self.parent, self.child = parent, child
        self.stamps: list[int] = []
        self.samples: list[Array | None] = []
        self.disputes: list[int] = []
        self.apart_m = 0.0  # the most that two of them disagreed

    def add(self, stamp_ns: int, sample: Array | None, horizon_ns: int | None) -> None:
        """Out-of-order stamps are sorted in; a repeated stamp keeps its first sample, as tf2 does.

        A live edge (with a horizon) whose publisher's clock was set back begins anew: the old samples' times are gone.
        """
        if horizon_ns is not None and self.stamps and set_back(stamp_ns, self.stamps[-1]):
            self.stamps.clear()
            self.samples.clear()
            self.disputes.clear()
        at = bisect_left(self.stamps, stamp_ns)
        if at < len(self.stamps) and self.stamps[at] == stamp_ns:
            self._compare(stamp_ns, self.samples[at], sample)
            return
        self.stamps.insert(at, stamp_ns)
        self.samples.insert(at, sample)
        self._look_around(min(at, len(self.stamps) - 2))
        if horizon_ns is not None:
            drop = bisect_left(self.stamps, self.stamps[-1] - horizon_ns)
            del self.stamps[:drop], self.samples[:drop]
            del self.disputes[: bisect_left(self.disputes, self.stamps[0])]

    def _compare(self, stamp_ns: int, first: Array | None, second: Array | None) -> None:
        """Two samples of one stamp."""
        if first is not None and second is not None:
            metres, radians = _apart(first, second)
            if metres > DISPUTE_M or radians > DISPUTE_RAD:
                self._dispute(stamp_ns, metres)

    def _look_around(self, at: int) -> None:
        """Whether the sample there lies off its two neighbours, while those agree."""
        if at < 1 or at + 1 >= len(self.stamps):
            return
        before, here, after = self.samples[at - 1 : at + 2]
        if before is None or here is None or after is None:
            return
        seconds = min(self.stamps[at] - self.stamps[at - 1], self.stamps[at + 1] - self.stamps[at]) / 1e9
        there, back = _apart(before, here), _apart(here, after)
        for limit, speed, i in ((DISPUTE_M, DISPUTE_M_S, 0), (DISPUTE_RAD, DISPUTE_RAD_S, 1)):
            jump = min(there[i], back[i])
            if jump > max(limit, speed * seconds) and _apart(before, after)[i] < jump / 2:
                self._dispute(self.stamps[at], there[0])
                return

    def _dispute(self, stamp_ns: int, metres: float) -> None:
        insort(self.disputes, stamp_ns)
        self.apart_m = max(self.apart_m, metres)

    def require_one_publisher(self, stamp_ns: int) -> None:
        near = bisect_left(self.disputes, stamp_ns + DISPUTE_NS) - bisect_left(self.disputes, stamp_ns - DISPUTE_NS)
        if near >= DISPUTES:
            raise TransformDisputed(self.quarrel)

    @property
    def quarrel(self) -> str:
        return f"Two nodes publish the transform {self.name} and disagree by up to {self.apart_m:.2f} m: stop one."

    def at(self, stamp_ns: int, max_gap_ns: int) -> Array:
        """(4, 4) T_parent_child at that stamp; raises as `TransformTree.lookup` does."""
        i = bisect_left(self.stamps, stamp_ns)
        if i < len(self.stamps) and self.stamps[i] == stamp_ns:
            return self._valid(i)
        if i == len(self.stamps):
            late = (stamp_ns - self.stamps[-1]) / 1e9
            raise TransformNotYet(f"The newest transform {self.name} is {late:.3f} s older than the stamp.")
        if i == 0:
            raise TransformTooOld(
                f"The oldest transform {self.name} is {(self.stamps[0] - stamp_ns) / 1e9:.3f} s newer than the stamp."
            )
        gap_ns = self.stamps[i] - self.stamps[i - 1]
        if gap_ns > max_gap_ns:
            raise TransformStale(
                f"The transforms {self.name} around the stamp are {gap_ns / 1e9:.3f} s apart, "
                f"more than {max_gap_ns / 1e9:.3f} s."
            )
        return interpolate(self._valid(i - 1), self._valid(i), (stamp_ns - self.stamps[i - 1]) / gap_ns)

    @property
    def name(self) -> str:
        return f"{self.parent} -> {self.child}"

    def _valid(self, index: int) -> Array:
        sample = self.samples[index]
        if self.disputes:
            self.require_one_publisher(self.stamps[index])
        if sample is None:
            raise TransformInvalid(f"A transform {self.name} at the stamp is not rigid (NaN or a zero quaternion).")
        return sample


def rigid(translation: list[float] | Array, quaternion_xyzw: list[float] | Array) -> Array | None:
    """(4, 4) of a transform message; None where it is not rigid (NaN, or no rotation)."""
    try:
        return transform(translation, quaternion_xyzw)
    except ValueError:
        return None


def _apart(a: Array, b: Array) -> tuple[float, float]:
    """Metres and radians between two transforms."""
    x, y, z = (b[:3, 3] - a[:3, 3]).tolist()
    cosine = (float(np.einsum("ij,ij->", a[:3, :3], b[:3, :3])) - 1) / 2
    return math.sqrt(x * x + y * y + z * z), math.acos(min(max(cosine, -1.0), 1.0))


class TransformTree:
    """Transforms as they arrive, from any thread; looked up by stamp, never extrapolated.

    max_gap_s: the longest time between two samples that may be interpolated. horizon_s: how long samples are kept
    behind the newest of their edge; None keeps all (a recording).
    """

    def __init__(self, *, max_gap_s: float = MAX_GAP_S, horizon_s: float | None = None) -> None:
        self._max_gap_ns = round(max_gap_s * 1e9)
        self._horizon_ns = None if horizon_s is None else round(horizon_s * 1e9)
        self._edges: dict[str, Edge] = {}  # by child
        self._static: dict[str, Edge] = {}
        self._two_parents: dict[str, tuple[str, int]] = {}  # child -> the second parent somebody claimed, and when
        self._lock = threading.Lock()

    def add(
        self,
        stamp_ns: int,
        parent: str,
        child: str,
        translation: list[float] | Array,
        quaternion_xyzw: list[float] | Array,
        *,
        static: bool = False,
    ) -> None:
        """One geometry_msgs/TransformStamped: header.frame_id is the parent, child_frame_id the child.

        What is not a rigid transform is remembered as such: a lookup that needs it is refused with TransformInvalid.
        """
        self.add_sample(stamp_ns, parent, child, rigid(translation, quaternion_xyzw), static=static)

    def add_sample(self, stamp_ns: int, parent: str, child: str, sample: Array | None, *, static: bool = False) -> None:
        """`add` of what `rigid` made. A static edge keeps what it had where the new one is no rigid transform."""
        parent, child = parent.lstrip("/"), child.lstrip("/")
        with self._lock:
            known = self._edges.get(child) or self._static.get(child)
            if known and known.parent != parent and not static and self._silent(child, stamp_ns):
                self._edges.pop(child)  # who said otherwise has fallen silent
                self._two_parents.pop(child, None)
                known = None
            if known and known.parent == parent and self._withdrawn(child, stamp_ns):
                del self._two_parents[child]
            if parent == child or (known and known.parent != parent):
                self._two_parents[child] = (parent, stamp_ns)
            elif static and (sample is not None or child not in self._static):
                self._static[child] = Edge(parent, child)
                self._static[child].add(stamp_ns, sample, None)
            elif not static:
                self._edges.setdefault(child, Edge(parent, child)).add(stamp_ns, sample, self._horizon_ns)

    def _silent(self, child: str, now_ns: int) -> bool:
        """Whether the publisher of a moving edge has not been heard for so long that another one counts instead."""
        edge = self._edges.get(child)
        return self._horizon_ns is not None and edge is not None and now_ns - edge.stamps[-1] > FORGOTTEN_NS

    def _withdrawn(self, child: str, now_ns: int) -> bool:
        """Whether the second parent was claimed long before this word of the first; a recording forgets nothing."""
        claim = self._two_parents.get(child)
        return self._horizon_ns is not None and claim is not None and now_ns - claim[1] > FORGOTTEN_NS

    def quarrels(self) -> list[str]:
        """A sentence for each edge that two nodes published and disagreed on."""
        with self._lock:
            return [edge.quarrel for edge in self._edges.values() if len(edge.disputes) >= DISPUTES]

    def lookup(self, stamp_ns: int, target: str, source: str) -> Array:
        """(4, 4) float64 T_target_source at that stamp: `p_target = T_target_source @ p_source`.

        Raises PoseUnavailable, as TransformMissing, TransformNotYet, TransformTooOld, TransformStale or
        TransformInvalid.
        """
        with self._lock:
            to_target, to_source = self._paths(target.lstrip("/"), source.lstrip("/"))
            T_root_target, T_root_source = self._compose(to_target, stamp_ns), self._compose(to_source, stamp_ns)
        return inverse(T_root_target) @ T_root_source

    def newest_stamp(self, target: str, source: str) -> int | None:
        """The newest stamp that every moving edge between the frames covers; None where all edges are static.

        Raises TransformMissing where no chain joins the frames.
        """
        with self._lock:
            to_target, to_source = self._paths(target.lstrip("/"), source.lstrip("/"))
            return min((e.stamps[-1] for e in (*to_target, *to_source) if e.child in self._edges), default=None)

    def _paths(self, target: str, source: str) -> tuple[list[Edge], list[Edge]]:
        """The edges from each frame up to the nearest common ancestor, nearest the frame first."""
        up_target, up_source = self._ancestry(target), self._ancestry(source)
        common = next((frame for frame in up_source if frame in up_target), None)
        if common is None:
            raise TransformMissing(f"No transforms join {target!r} and {source!r}; known frames: {self._frames()}.")
        return list(up_target[common]), list(up_source[common])

    def _ancestry(self, frame: str) -> dict[str, tuple[Edge, ...]]:
        """Each ancestor of a frame (itself first) with the edges that lead up to it."""
        known: dict[str, tuple[Edge, ...]] = {frame: ()}
        while edge := self._edges.get(frame) or self._static.get(frame):
            if edge.parent in known:
                raise TransformInvalid(f"The transforms form a loop at {edge.name}.")
            known[edge.parent] = (*known[frame], edge)
            frame = edge.parent
        return known

    def _compose(self, path: list[Edge], stamp_ns: int) -> Array:
        """(4, 4) T_ancestor_frame along the edges from a frame up to an ancestor."""
        T = transform([0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0])
        for edge in path:
            if edge.child in self._two_parents:
                raise TransformInvalid(
                    f"Frame {edge.child!r} has two parents, {edge.parent!r} and {self._two_parents[edge.child][0]!r}: "
                    "two nodes publish it; stop one."
                )
            always = edge.child not in self._edges  # /tf_static holds at every stamp
            T = edge.at(edge.stamps[0] if always else stamp_ns, self._max_gap_ns) @ T
        return T

    def _frames(self) -> str:
        edges = [*self._edges.values(), *self._static.values()]
        return ", ".join(sorted({name for e in edges for name in (e.parent, e.child)})) or "none"
