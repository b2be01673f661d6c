"""One edge of the /tf tree: its samples by stamp, interpolated between two of them, or a refusal by name."""

from __future__ import annotations

import math
from bisect import bisect_left, insort

import numpy as np

from drivers.ports import PoseUnavailable
from drivers.stamps import set_back
from openbelief.arrays import Array
from openbelief.pose import interpolate, transform


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
