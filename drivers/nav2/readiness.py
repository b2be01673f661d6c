"""Nav2's readiness: liveliness token, lifecycle, localisation and map; a goal is sent only where all hold."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from drivers.ports import LinkLost, Map, PortError, PoseSource
from drivers.ros.action import service_client
from drivers.ros.bridge_keys import Keys
from drivers.ros.shapes import Shapes
from drivers.ros.zenoh_link import ZenohLink
from drivers.topics import IS_ACTIVE, NAVIGATE_TO_POSE

IS_ACTIVE_S = 1.0  # wall time
SEVERAL_SERVERS = "Nav2 servers offer navigate_to_pose, and each would drive the robot: leave one running."


@dataclass(frozen=True)
class ReadinessSign:
    """One sign; where it fails, `sentence` names the cause and the remedy."""

    name: str
    ok: bool
    sentence: str = ""


class Nav2Readiness:
    """Reads the signs in the order in which they depend on each other."""

    def __init__(
        self, link: ZenohLink, keys: Keys, shapes: Shapes, poses: PoseSource, grid: Map, *, pose_age_s: float
    ) -> None:
        self._link, self._keys, self._poses, self._grid, self._pose_age_s = link, keys, poses, grid, pose_age_s
        self._is_active = service_client(link, keys, IS_ACTIVE, shapes)
        self._servers: set[str] = set()
        self._bridges: set[str] = set()
        self._lock = threading.Lock()

    def start(self) -> None:
        """Begin to watch the liveliness tokens."""
        self._link.watch_tokens(self._keys.action_token(NAVIGATE_TO_POSE), self._watcher(self._servers))
        self._link.watch_tokens(self._keys.bridge_token("*"), self._watcher(self._bridges))

    def read(self) -> Iterator[ReadinessSign]:
        """Link, bridge, action server, is_active, pose, map; a reader stops at the first that fails."""
        yield self._link_up()
        yield self._server()
        yield self._active()
        yield self._pose()
        yield self._map()

    def whose_silence(self) -> str:
        """A sentence on who is gone, for a goal that fell silent."""
        return next((s.sentence for s in (self._link_up(), self._server()) if not s.ok), "Nav2 fell silent.")

    def _watcher(self, tokens: set[str]) -> Callable[[str, bool], None]:
        def watch(token: str, there: bool) -> None:
            with self._lock:
                (tokens.add if there else tokens.discard)(token)

        return watch

    def _link_up(self) -> ReadinessSign:
        where = ", ".join(self._link.config.endpoints)
        return ReadinessSign(
            "link",
            self._link.alive,
            f"The link to the robot ({where}) is down: check the network and that zenoh-bridge-ros2dds runs there.",
        )

    @property
    def doubled(self) -> str | None:
        """A sentence where more than one server offers the action, each behind a bridge of its own."""
        count = len(self._servers)
        return f"{count} {SEVERAL_SERVERS}" if count > 1 else None

    def _server(self) -> ReadinessSign:
        if self.doubled:
            return ReadinessSign("action server", False, self.doubled)
        if self._bridges:
            said = (
                "The bridge offers no action navigate_to_pose: start Nav2 with RMW_IMPLEMENTATION=rmw_cyclonedds_cpp "
                "(with Fast-DDS topics work, actions do not) and allow the action in the bridge's configuration."
            )
        else:
            said = "No zenoh-bridge-ros2dds is behind the link: start it on the robot."
        return ReadinessSign("action server", bool(self._servers), said)

    def _active(self) -> ReadinessSign:
        try:
            answer = self._is_active.ask(IS_ACTIVE_S)
        except LinkLost as error:
            return ReadinessSign("active", False, str(error))
        if answer.message is None:
            said = f"Nav2's lifecycle manager does not say whether Nav2 is active: {answer.why}."
            return ReadinessSign("active", False, said)
        said = "Nav2 is not active: wait for its start-up to end, or look at the log of lifecycle_manager_navigation."
        return ReadinessSign("active", bool(answer.message.success), said)

    def _pose(self) -> ReadinessSign:
        try:
            self._poses.robot_pose(self._pose_age_s)
        except PortError as error:
            return ReadinessSign("pose", False, f"The robot does not know where it is: {error}")
        return ReadinessSign("pose", True)

    def _map(self) -> ReadinessSign:
        try:
            self._grid.latest()
        except PortError as error:
            return ReadinessSign("map", False, str(error))
        return ReadinessSign("map", True)
