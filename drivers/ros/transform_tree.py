"""The /tf tree as data: a transform at a stamp, interpolated between its bracketing samples, or a named refusal."""

from __future__ import annotations

import threading

from drivers.ros.transform_edge import DISPUTES, Edge, TransformInvalid, TransformMissing, rigid
from openbelief.arrays import Array
from openbelief.pose import inverse, transform

MAX_GAP_S = 0.25
FORGOTTEN_NS = 2_000_000_000  # a live publisher that is silent for longer is taken to have been stopped


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
