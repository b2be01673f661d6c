"""Camera, pose, map and lidar of the robot, as the bridge forwards its ROS topics.

Age is the Clock's time since the message's stamp, so a publisher whose stamps stand still is stale like a silent one.
A robot whose clock is set, ahead or back, is followed at its next message; while it is wrong, that is named.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from drivers.ports import BatteryState, Clock, LidarCloud, PoseUnavailable, StaleData, StampedPose
from drivers.ros.bridge_keys import BridgeKeys, Keys
from drivers.ros.camera import RosCamera
from drivers.ros.clouds import CloudDecoder, cloud_of
from drivers.ros.convert import grid_of, transforms_of
from drivers.ros.messages import Message, WireError, stamp_to_ns
from drivers.ros.subscription import Subscription, listen
from drivers.ros.transform_edge import TransformNotYet, rigid
from drivers.ros.transform_tree import MAX_GAP_S, TransformTree
from drivers.ros.zenoh_link import ZenohLink
from drivers.stamps import is_news, require_fresh
from drivers.topics import BATTERY, LIDAR, MAP, TF, TF_STATIC, Topic
from openbelief.arrays import Array
from openbelief.pose import Pose2
from openbelief.traversability import OccupancyGrid

__all__ = ["RosBattery", "RosCamera", "RosLidar", "RosMap", "RosPoseSource"]

PATIENCE_S = 0.3


class RosLidar:
    """The Lidar port: the newest cloud of a PointCloud2 topic."""

    def __init__(self, link: ZenohLink, clock: Clock, keys: Keys | None = None, *, topic: Topic = LIDAR) -> None:
        self._link, self._clock, self._keys, self._topic = link, clock, keys or BridgeKeys(), topic
        self._cloud: LidarCloud | None = None
        self._intake: Subscription | None = None

    def start(self) -> None:
        self._intake = listen(self._link, self._keys, self._topic, self._keep, CloudDecoder())

    def latest(self, max_age_s: float) -> LidarCloud:
        self._link.check()
        cloud, trouble = self._cloud, self._intake.trouble() if self._intake else ""
        if cloud is None:
            raise StaleData(f"No lidar cloud yet on {self._topic.name}.{trouble}")
        require_fresh("Lidar", cloud.stamp_ns, self._clock.now_ns(), max_age_s, trouble)
        return cloud

    def _keep(self, message: Message) -> None:
        cloud = cloud_of(message)
        if self._cloud is None or is_news(cloud.stamp_ns, self._cloud.stamp_ns):
            self._cloud = cloud


class RosBattery:
    """The Battery port: the newest sensor_msgs/BatteryState, of which only `percentage` and the stamp are read.

    Many battery drivers leave the stamp 0: such a message is as old as its arrival here. It is sent once a second or
    less and is not latched, so what arrives is new.
    """

    def __init__(
        self, link: ZenohLink, clock: Clock, keys: BridgeKeys | None = None, *, topic: Topic = BATTERY
    ) -> None:
        self._link, self._clock, self._keys, self._topic = link, clock, keys or BridgeKeys(), topic
        self._charge: BatteryState | None = None
        self._intake: Subscription | None = None

    def start(self) -> None:
        self._intake = listen(self._link, self._keys, self._topic, self._keep)

    def latest(self, max_age_s: float) -> BatteryState:
        self._link.check()
        charge, trouble = self._charge, self._intake.trouble() if self._intake else ""
        if charge is None:
            raise StaleData(f"No battery state yet on {self._topic.name}.{trouble}")
        require_fresh("Battery", charge.stamp_ns, self._clock.now_ns(), max_age_s, trouble)
        return charge

    def _keep(self, message: Message) -> None:
        fraction = float(message.percentage)
        if math.isnan(fraction):
            raise WireError("The battery's percentage is NaN: its driver does not measure the charge.")
        if not 0.0 <= fraction <= 1.0:
            raise WireError(f"A battery's percentage should be 0 to 1, got {fraction:g}.")
        self._charge = BatteryState(stamp_to_ns(message.header.stamp) or self._clock.now_ns(), fraction)


class RosMap:
    """The Map port: the newest OccupancyGrid of a latched topic."""

    def __init__(self, link: ZenohLink, keys: Keys | None = None, *, topic: Topic = MAP) -> None:
        self._link, self._keys, self._topic = link, keys or BridgeKeys(), topic
        self._grid: OccupancyGrid | None = None
        self._intake: Subscription | None = None

    def start(self) -> None:
        self._intake = listen(self._link, self._keys, self._topic, self._keep)

    def latest(self) -> OccupancyGrid:
        self._link.check()
        grid = self._grid
        if grid is None:
            trouble = self._intake.trouble() if self._intake else ""
            raise StaleData(f"No map has arrived on {self._topic.name}: is Nav2's map_server active?{trouble}")
        return grid

    def _keep(self, message: Message) -> None:
        self._grid = grid_of(message)


class RosPoseSource:
    """The PoseSource port over /tf and /tf_static.

    A stamp newer than the newest transform is waited for PATIENCE_S, by the clock: images often come first.
    max_gap_s: the longest time between two transforms that is interpolated; slow localisers need more than usual.
    """

    def __init__(
        self,
        link: ZenohLink,
        clock: Clock,
        keys: Keys | None = None,
        *,
        max_gap_s: float = MAX_GAP_S,
    ) -> None:
        self._link, self._clock, self._keys = link, clock, keys or BridgeKeys()
        self._tree = TransformTree(max_gap_s=max_gap_s, horizon_s=10.0)
        self._intakes: list[Subscription] = []

    def start(self) -> None:
        for topic, static in ((TF, False), (TF_STATIC, True)):
            self._intakes.append(listen(self._link, self._keys, topic, self._adder(static)))

    def transform_at(self, stamp_ns: int, frame_id: str) -> Array:
        self._link.check()
        give_up_ns = self._clock.now_ns() + round(PATIENCE_S * 1e9)
        while True:
            try:
                return self._tree.lookup(stamp_ns, "map", frame_id)
            except TransformNotYet:
                if self._clock.now_ns() >= give_up_ns:
                    raise
            self._clock.sleep(0.02)

    def robot_pose(self, max_age_s: float) -> Pose2:
        return self.stamped_pose(max_age_s).pose

    def stamped_pose(self, max_age_s: float) -> StampedPose:
        self._link.check()
        trouble = "".join(intake.trouble() for intake in self._intakes)
        try:
            stamp_ns = self._tree.newest_stamp("map", "base_link")
            if stamp_ns is None:
                raise StaleData("Nothing on /tf moves the robot: map -> base_link is static. Is localisation running?")
            require_fresh("The robot's pose", stamp_ns, self._clock.now_ns(), max_age_s, trouble)
            return StampedPose(stamp_ns, Pose2.from_matrix(self._tree.lookup(stamp_ns, "map", "base_link")))
        except PoseUnavailable as error:
            raise StaleData(
                f"{error} Is localisation running, and does the bridge forward /tf and /tf_static?{trouble}"
            ) from error

    def _adder(self, static: bool) -> Callable[[Message], None]:
        def add(message: Message) -> None:
            for t in transforms_of(message):
                sample = rigid(t.translation, t.quaternion_xyzw)
                if sample is None:
                    self._intakes[static].spoilt(
                        f"the transform {t.parent} -> {t.child} is not rigid (NaN, or no rotation)"
                    )
                self._tree.add_sample(t.stamp_ns, t.parent, t.child, sample, static=static)

        return add
