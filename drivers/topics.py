"""The table of topics: everything that the workstation hears from the robot, and the actions and services it asks."""

from __future__ import annotations

from dataclasses import dataclass, replace


@dataclass(frozen=True)
class Topic:
    """One ROS topic. latched: TRANSIENT_LOCAL, so that who comes late still gets the last message.

    rate_hz: as a robot sends it; None where it is sent once. max_bytes: a larger payload is dropped. How old a sample
    may be is for its reader to say (MissionPolicy, SafetyPolicy).
    """

    name: str
    type_name: str
    rate_hz: float | None
    max_bytes: int
    latched: bool = False


@dataclass(frozen=True)
class Action:
    """One ROS action; `type_name` has no suffix."""

    name: str
    type_name: str


@dataclass(frozen=True)
class Service:
    """One ROS service; its messages are `type_name` + _Request and _Response."""

    name: str
    type_name: str


KIB, MIB = 1 << 10, 1 << 20
IMAGE, COMPRESSED = "sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage"

CAMERA_INFO_TYPE, CLOUD = "sensor_msgs/msg/CameraInfo", "sensor_msgs/msg/PointCloud2"
IMU_TYPE = "sensor_msgs/msg/Imu"
BATTERY_TYPE = "sensor_msgs/msg/BatteryState"
TRANSFORMS, GRID = "tf2_msgs/msg/TFMessage", "nav_msgs/msg/OccupancyGrid"

# fmt: off
#                   ROS name                                     type               Hz     bytes
COLOR = Topic(      "/camera/color/image_raw",                   IMAGE,            15.0,  8 * MIB)
COLOR_JPEG = Topic( "/camera/color/image_raw/compressed",        COMPRESSED,       15.0,  4 * MIB)
DEPTH = Topic(      "/camera/aligned_depth_to_color/image_raw",  IMAGE,            15.0,  8 * MIB)
CAMERA_INFO = Topic("/camera/color/camera_info",                 CAMERA_INFO_TYPE, 15.0,  4 * KIB)
LIDAR = Topic(      "/livox/lidar",                              CLOUD,            10.0,  8 * MIB)
LIDAR_IMU = Topic(  "/livox/imu",                                IMU_TYPE,        200.0,  4 * KIB)
CAMERA_IMU = Topic( "/camera/imu",                               IMU_TYPE,        200.0,  4 * KIB)
DEPTH_PNG = Topic(  "/camera/aligned_depth_to_color/image_raw/compressedDepth", COMPRESSED, 15.0, 4 * MIB)
BATTERY = Topic(    "/battery_state",                            BATTERY_TYPE,      1.0,  4 * KIB)
TF = Topic(         "/tf",                                       TRANSFORMS,       30.0, 64 * KIB)
TF_STATIC = Topic(  "/tf_static",                                TRANSFORMS,       None, 64 * KIB, latched=True)
MAP = Topic(        "/map",                                      GRID,             None, 64 * MIB, latched=True)
# what `openbelief onboard` says of its sensors; Zenoh alone carries it: on ROS's own topic of that name others speak
DIAGNOSTICS = Topic("/diagnostics", "diagnostic_msgs/msg/DiagnosticArray",          1.0, 64 * KIB)
# fmt: on

TOPICS = (COLOR, COLOR_JPEG, DEPTH, CAMERA_INFO, LIDAR, LIDAR_IMU, CAMERA_IMU, DEPTH_PNG, BATTERY, TF, TF_STATIC, MAP)

NAVIGATE_TO_POSE = Action("/navigate_to_pose", "nav2_msgs/action/NavigateToPose")
COMPUTE_PATH_TO_POSE = Action("/compute_path_to_pose", "nav2_msgs/action/ComputePathToPose")
IS_ACTIVE = Service("/lifecycle_manager_navigation/is_active", "std_srvs/srv/Trigger")

MAX_BYTES = max(topic.max_bytes for topic in TOPICS)  # what the link lets in at all
ACTION_MAX_BYTES = 4 * MIB  # feedback, status and replies; a path of 10 000 poses has 1 MB


def color_topic(name: str) -> Topic:
    """The colour topic of that ROS name: image_transport's `.../compressed` is JPEG, anything else raw."""
    return replace(COLOR_JPEG if name.endswith("/compressed") else COLOR, name=name)


def depth_topic(name: str) -> Topic:
    """The depth topic of that ROS name: image_transport's `.../compressedDepth` is PNG, anything else raw."""
    return replace(DEPTH_PNG if name.endswith("/compressedDepth") else DEPTH, name=name)
