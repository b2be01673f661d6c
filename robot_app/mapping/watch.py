"""Where a mapping is, seen from outside: the ports that it is given say when a step begins."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from contextlib import ExitStack

from openbelief.arrays import Array
from openbelief.evidence import Evidence
from openbelief.observation import Observation
from openbelief.store import BeliefStore
from openbelief.surroundings import CameraView, ViewImages
from robot_app.mapping.stopwatch import Stopwatch


class Steps:
    """The steps of the thread that maps, one at a time: each ends where the next begins."""

    def __init__(self, clock: Stopwatch) -> None:
        self._clock, self._current = clock, ExitStack()

    def begin(self, step: str | None) -> None:
        """None: what comes is counted elsewhere, or not at all."""
        self._current.close()
        if step is not None:
            self._current.enter_context(self._clock(step))


class WatchedStore(BeliefStore):
    """A store that tells of every frame it has kept, by its recording, and when all are kept."""

    def watched_by(self, steps: Steps, on_frame: Callable[[str], None], on_all: Callable[[], None]) -> None:
        self._steps, self._on_frame, self._on_all = steps, on_frame, on_all

    def add_frame(
        self,
        recording: str,
        stamp_ns: int,
        observations: Iterable[Observation],
        refused: Iterable[str] = (),
        skipped: str | None = None,
        view: tuple[CameraView, ViewImages] | None = None,
    ) -> None:
        self._steps.begin("keep")
        super().add_frame(recording, stamp_ns, observations, refused, skipped, view)
        self._steps.begin(None)
        self._on_frame(recording)

    def observations(self) -> list[Observation]:
        self._on_all()
        self._steps.begin("build")
        return super().observations()

    def finish(self, evidence: Evidence, columns: Mapping[str, Array]) -> None:
        self._steps.begin("seal")
        super().finish(evidence, columns)
        self._steps.begin(None)
