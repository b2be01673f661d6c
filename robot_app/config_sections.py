"""The tables of robot.toml: typed, frozen, unknown keys refused."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, field_validator, model_validator

from openbelief.arrays import Array
from openbelief.pose import quaternion_from_rpy, transform
from openbelief.settings import Positive

Body = Literal["real", "ros", "replay", "sim"]
Distribution = Literal["auto", "humble", "jazzy", "kilted", "lyrical"]
LOOPBACK = ("127.0.0.1", "localhost", "[::1]")
ENDPOINT = re.compile(r"(tcp|tls)/(\[[^]\s]+\]|[^][\s:/]+):(?P<port>\d{1,5})([?#]\S*)?")  # two of zenoh's protocols


def _one_line(text: str) -> str:
    if not text.isprintable():
        raise ValueError(f"one line of text is needed, not {text!r}")
    return text


Line = Annotated[str, Field(max_length=200), AfterValidator(_one_line)]


class Section(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class PortsSection(Section):
    """Which body stands behind each port. Any mix is allowed."""

    camera: Body = "sim"
    lidar: Body = "sim"
    pose: Literal["ros", "replay", "sim"] = "sim"
    map: Literal["ros", "replay", "sim"] = "sim"
    navigator: Literal["ros", "sim"] = "sim"
    battery: Literal["none", "ros"] = "none"

    def uses(self, body: Body) -> bool:
        return body in (self.camera, self.lidar, self.pose, self.map, self.navigator, self.battery)


class ZenohSection(Section):
    """Where the robot's zenoh-bridge-ros2dds (or its router) listens; with "tls/..." what `openbelief certs` made.

    distribution: the robot's ROS 2, whose messages differ in shape; "auto" tells it by what decodes.
    """

    endpoint: str = "tcp/127.0.0.1:7447"
    namespace: str = ""
    distribution: Distribution = "auto"
    ca: Path | None = None
    certificate: Path | None = None
    key: Path | None = None

    @field_validator("endpoint")
    @classmethod
    def _endpoint(cls, endpoint: str) -> str:
        found = ENDPOINT.fullmatch(endpoint)
        if not found or not 0 < int(found["port"]) < 65536:
            raise ValueError(
                f"an endpoint is tcp/HOST:PORT or tls/HOST:PORT, like tcp/127.0.0.1:7447, got {endpoint!r}"
            )
        return endpoint

    @model_validator(mode="after")
    def _whole(self) -> ZenohSection:
        named = [value is not None for value in (self.ca, self.certificate, self.key)]
        if any(named) and not all(named):
            raise ValueError("ca, certificate and key belong together: name all three, or none")
        if self.endpoint.startswith("tls/") != all(named):
            raise ValueError(
                "ca, certificate and key go with an endpoint tls/HOST:PORT, and such an endpoint needs them"
                " (openbelief certs makes them)"
            )
        return self

    @property
    def tls(self) -> dict[str, str | bool]:
        """What drivers.ros.zenoh_link.LinkConfig wants; empty where the link is plain TCP."""
        if self.ca is None:
            return {}
        return {
            "root_ca_certificate": str(self.ca),
            "connect_certificate": str(self.certificate),
            "connect_private_key": str(self.key),
            "enable_mtls": True,
            "close_link_on_expiration": True,
            "verify_name_on_connect": True,
        }


class TopicsSection(Section):
    """ROS names of the streams, as `ros2 topic list` prints them."""

    color: str = "/camera/color/image_raw"
    depth: str = "/camera/aligned_depth_to_color/image_raw"
    camera_info: str = "/camera/color/camera_info"
    lidar: str = "/livox/lidar"
    lidar_imu: str = "/livox/imu"
    camera_imu: str = "/camera/imu"
    battery: str = "/battery_state"
    map: str = "/map"


class PairingSection(Section):
    """What belongs together in time, where the robot's ROS nodes are slow or their clocks differ.

    tolerance_s: how far depth may be from its colour image. depth_offset_s: by how much the depth camera's stamps are
    late. max_tf_gap_s: the longest time between two transforms that is interpolated.
    """

    tolerance_s: Annotated[float, Field(ge=0, allow_inf_nan=False)] = 0.0
    depth_offset_s: Annotated[float, Field(allow_inf_nan=False)] = 0.0
    max_tf_gap_s: Positive = 0.25


class ReplaySection(Section):
    """The recording behind every port whose body is "replay"."""

    recording: Path | None = None


class SimSection(Section):
    """The simulated flat behind every port whose body is "sim"."""

    scene: str = "flat"
    seed: int = 1
    camera_rate_hz: Positive | None = 1.0  # None (not sayable in TOML): only when the walk asks for a picture


class OnboardSection(Section):
    """`openbelief onboard`: what it publishes for a robot without those ROS nodes. "sim": the emulated sensor.

    mounts: static transforms it publishes, "parent child x y z roll pitch yaw" each (metres, radians, URDF order).
    dds: how the watchdog cancels where the bridge is gone; "auto" takes the cyclonedds wheel, else the helper under ROS
    where ros_setup names its set-up file (/opt/ros/jazzy/setup.bash).
    """

    camera: Literal["off", "real", "sim"] = "off"
    lidar: Literal["off", "real", "sim"] = "off"
    camera_rate_hz: Positive = 15.0
    lidar_rate_hz: Positive = 10.0
    mounts: tuple[str, ...] = ()
    dds: Literal["auto", "cyclonedds", "ros", "off"] = "auto"
    ros_setup: str = ""

    @field_validator("mounts")
    @classmethod
    def _mounts(cls, mounts: tuple[str, ...]) -> tuple[str, ...]:
        for text in mounts:
            mount(text)
        return mounts


def mount(text: str) -> tuple[str, str, Array]:
    """(parent, child, (4, 4) T_parent_child) of "parent child x y z roll pitch yaw"; raises ValueError."""
    words = text.split()
    try:
        parent, child = words[:2]
        x, y, z, roll, pitch, yaw = map(float, words[2:])
        return parent, child, transform([x, y, z], quaternion_from_rpy(roll, pitch, yaw))
    except ValueError as error:
        raise ValueError(f"a mount is 'parent child x y z roll pitch yaw', got {text!r}") from error


class PerceptionSection(Section):
    """`scripted[:SCENE.json]`, `recorded:FILE.jsonl` or `paper[:PROFILE.toml]`."""

    profile: str = "scripted"


class VoiceSection(Section):
    """recogniser: "moonshine" or "sherpa:KIND:FOLDER", in `language`. microphone: part of its name, "": the usual one.

    speak: "auto" says what matters aloud, at `run --voice` and on the page that commands; "off" never.
    """

    recogniser: Line = "moonshine"
    language: Annotated[str, Field(pattern=r"^[a-z]{2,3}(-[A-Za-z0-9]{2,8})*$")] = "en"
    microphone: Line = ""
    speak: Literal["auto", "off"] = "auto"


class RemoteSection(Section):
    """Who may command a run over Zenoh. serve: "off"; "here": clients of this machine, at `endpoint`; "robot": through
    the robot's router, whose access rules and certificates say who.
    """

    serve: Literal["off", "here", "robot"] = "off"
    endpoint: str = "tcp/127.0.0.1:7450"

    @field_validator("endpoint")
    @classmethod
    def _of_this_machine(cls, endpoint: str) -> str:
        found = ENDPOINT.fullmatch(endpoint)
        if not found or found[1] != "tcp" or found[2] not in LOOPBACK:
            raise ValueError(
                f"an endpoint of this machine is needed, like tcp/127.0.0.1:7450, not {endpoint!r}: others would "
                'command the robot without a certificate; serve = "robot" is for them'
            )
        return endpoint


class RecordingSection(Section):
    """`openbelief record`: who and where, when a new file begins, and how much room the disk keeps. "": unknown."""

    operator: Line = ""
    site: Line = ""
    robot_serial: Line = ""
    firmware: Line = ""
    every_s: Positive = 300.0
    every_bytes: int = Field(default=1_000_000_000, ge=1_000_000)
    warn_bytes: int = Field(default=10_000_000_000, ge=0)
    stop_bytes: int = Field(default=2_000_000_000, ge=0)


class ConsoleSection(Section):
    """`openbelief run --console`: who may log in, and what it needs to be reached from elsewhere than this machine.

    hosts: names and addresses by which browsers reach it, besides the one that it listens at.
    """

    accounts: Path | None = None
    certificate: Path | None = None
    key: Path | None = None
    hosts: tuple[str, ...] = ()

    @model_validator(mode="after")
    def _whole(self) -> ConsoleSection:
        if (self.certificate is None) != (self.key is None):
            raise ValueError("certificate and key belong together: name both, or none (openbelief certs makes them)")
        return self
