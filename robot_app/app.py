"""The one place that chooses real, ROS, replayed or simulated bodies: a configuration in, a robot's ports out."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from typing import Any

from drivers.nav2.bridge import Nav2Bridge
from drivers.ports import Battery, Camera, Clock, Lidar, Map, Navigator, Operator, PortError, Ports, PoseSource, Safety
from drivers.ros.camera import PairingTolerance
from drivers.ros.topics import RosBattery, RosCamera, RosLidar, RosMap, RosPoseSource
from drivers.topics import BATTERY, CAMERA_INFO, LIDAR, MAP, color_topic, depth_topic
from openbelief.perception.ports import Perception, TextEncoder
from robot_app.config import Config
from robot_app.local_sensors import open_livox, open_realsense
from robot_app.perceptions import open_perception, text_encoder_of
from robot_app.wiring import Wire, Wiring, nobody_stops, open_wiring


@dataclass(frozen=True)
class Robot:
    """Every port of one robot. `simulation` is there where a body is simulated."""

    clock: Clock
    camera: Camera
    lidar: Lidar
    poses: PoseSource
    map: Map
    navigator: Navigator
    battery: Battery | None
    wiring: Wiring

    def ports(self, operator: Operator, perception: Perception, safety: Safety | None = None) -> Ports:
        """What a mission needs."""
        lidar = self.lidar if self.wiring.config.safety.lidar == "used" else None
        return Ports(self.clock, self.camera, self.poses, self.map, self.navigator, operator, perception, lidar, safety)


@contextmanager
def open_robot(config: Config, stop: Callable[[], str | None] = nobody_stops) -> Iterator[Robot]:
    """Open the bodies that robot.toml names; everything closes at the end. stop: the operator's, where there is one.

    Raises PortError, SceneError or LogError with a sentence that names the cause.
    """
    with ExitStack() as opened:
        wiring = open_wiring(config, opened, stop)
        body = {name: BODIES[name, word] for name, word in config.ports.model_dump().items()}
        poses, grid = body["pose"](wiring), body["map"](wiring)
        robot = Robot(
            clock=wiring.clock,
            camera=body["camera"](wiring),
            lidar=body["lidar"](wiring),
            poses=poses,
            map=grid,
            navigator=body["navigator"](wiring, poses, grid),
            battery=body["battery"](wiring),
            wiring=wiring,
        )
        if wiring.simulation is not None:
            wiring.simulation.graph.start(wiring.wires["sim"].link, ready=lambda: _heard(robot))
        yield robot


def _heard(robot: Robot) -> bool:
    """Whether a just started simulation is whole at our end."""
    return robot.navigator.unavailable() is None


def mission_perception(config: Config, encoder: TextEncoder) -> Perception:
    """What looks at the arrival views: `[perception] profile`; "scripted" alone is the simulated scene's own."""
    return open_perception(_perception_spec(config), encoder, config.sim.seed)


def mission_text_encoder(config: Config) -> TextEncoder:
    """What the memory is asked with: the text encoder of the arrival views' features."""
    return text_encoder_of(_perception_spec(config))


def _perception_spec(config: Config) -> str:
    profile = config.perception.profile
    return f"scripted:{config.sim.scene}" if profile == "scripted" else profile


def _wire(wiring: Wiring, word: str) -> Wire:
    return wiring.wires[word]


def _camera(wiring: Wiring, word: str) -> Camera:
    wire = _wire(wiring, word)
    camera = RosCamera(
        wire.link,
        wiring.clock,
        wire.keys,
        color=color_topic(wire.topics.color),
        depth=depth_topic(wire.topics.depth),
        camera_info=replace(CAMERA_INFO, name=wire.topics.camera_info),
        pairing=PairingTolerance(
            tolerance_s=wiring.config.pairing.tolerance_s, offset_s=wiring.config.pairing.depth_offset_s
        ),
    )
    camera.start()
    return camera


def _lidar(wiring: Wiring, word: str) -> Lidar:
    wire = _wire(wiring, word)
    lidar = RosLidar(wire.link, wiring.clock, wire.keys, topic=replace(LIDAR, name=wire.topics.lidar))
    lidar.start()
    return lidar


def _battery(wiring: Wiring, word: str) -> Battery:
    wire = _wire(wiring, word)
    battery = RosBattery(wire.link, wiring.clock, wire.keys, topic=replace(BATTERY, name=wire.topics.battery))
    battery.start()
    return battery


def _poses(wiring: Wiring, word: str) -> PoseSource:
    wire = _wire(wiring, word)
    poses = RosPoseSource(wire.link, wiring.clock, wire.keys, max_gap_s=wiring.config.pairing.max_tf_gap_s)
    poses.start()
    return poses


def _map(wiring: Wiring, word: str) -> Map:
    wire = _wire(wiring, word)
    grid = RosMap(wire.link, wire.keys, topic=replace(MAP, name=wire.topics.map))
    grid.start()
    return grid


def _navigator(wiring: Wiring, word: str, poses: PoseSource, grid: Map) -> Navigator:
    wire = _wire(wiring, word)
    bridge = Nav2Bridge(
        wire.link,
        wiring.clock,
        poses,
        grid,
        new_uuid=wiring.new_uuid,
        keys=wire.keys,
        distribution=wire.distribution,
        stop=wiring.stop,
    )
    bridge.start()
    return bridge


def _real(port: str, open_sensor: Callable[[Config, Clock, ExitStack], Any]) -> Callable[[Wiring], Any]:
    """The body raises PortError where there is no usable sensor, or no real clock to time it by."""

    def body(wiring: Wiring) -> Any:
        if wiring.simulation is not None:
            raise PortError(
                f'A real {port} cannot keep a simulated robot\'s time: set every port that says "sim" to another.'
            )
        return open_sensor(wiring.config, wiring.clock, wiring.opened)

    return body


def _replayed(name: str) -> Callable[[Wiring], Any]:
    def body(wiring: Wiring) -> Any:
        if wiring.recording is None:
            raise RuntimeError("robot.toml was checked: a replayed body has its recording.")
        return getattr(wiring.recording, name)(wiring.clock)

    return body


def _on(word: str, body: Callable[..., Any]) -> Callable[..., Any]:
    return lambda wiring, *more: body(wiring, word, *more)


# (port, word in robot.toml) -> the body. A simulated robot is the ROS driver in front of the simulated wire.
BODIES: dict[tuple[str, str], Callable[..., Any]] = {
    ("camera", "real"): _real("camera", open_realsense),
    ("lidar", "real"): _real("lidar", open_livox),
    ("battery", "none"): lambda _: None,
    ("battery", "ros"): _on("ros", _battery),
    **{(port, "replay"): _replayed(port) for port in ("camera", "lidar", "pose", "map")},
    **{
        (port, word): _on(word, body)
        for word in ("ros", "sim")
        for port, body in (
            ("camera", _camera),
            ("lidar", _lidar),
            ("pose", _poses),
            ("map", _map),
            ("navigator", _navigator),
        )
    },
}
