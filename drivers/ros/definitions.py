"""The ROS 2 types that the type store does not bring, as text, and how their shapes differ between distributions.

Source: nav2_msgs Humble 1.1.20, Jazzy 1.3.13, Kilted 1.4.2, Lyrical 1.5.1. A distribution is one entry in each table.
"""

from __future__ import annotations

NO_MEMBERS = "uint8 structure_needs_at_least_one_member"

SERVICES = {
    "action_msgs/srv/CancelGoal_Request": "action_msgs/GoalInfo goal_info",
    "action_msgs/srv/CancelGoal_Response": "int8 return_code\naction_msgs/GoalInfo[] goals_canceling",
    "std_srvs/srv/Trigger_Request": NO_MEMBERS,
    "std_srvs/srv/Trigger_Response": "bool success\nstring message",
}

LIVOX = {  # livox_ros_driver2 1.2.4: what comes on a cloud's topic with xfer_format 1
    "livox_ros_driver2/msg/CustomPoint": "uint32 offset_time\nfloat32 x\nfloat32 y\nfloat32 z\n"
    "uint8 reflectivity\nuint8 tag\nuint8 line",
    "livox_ros_driver2/msg/CustomMsg": "std_msgs/Header header\nuint64 timebase\nuint32 point_num\nuint8 lidar_id\n"
    "uint8[3] rsvd\nlivox_ros_driver2/CustomPoint[] points",
}

NAVIGATE_GOAL = "geometry_msgs/PoseStamped pose\nstring behavior_tree"
NAVIGATE_FEEDBACK = """geometry_msgs/PoseStamped current_pose
builtin_interfaces/Duration navigation_time
builtin_interfaces/Duration estimated_time_remaining
int16 number_of_recoveries
float32 distance_remaining"""
PLAN_GOAL = """geometry_msgs/PoseStamped goal
geometry_msgs/PoseStamped start
string planner_id
bool use_start"""
PLAN_RESULT = "nav_msgs/Path path\nbuiltin_interfaces/Duration planning_time"
ERROR = "uint16 error_code\nstring error_msg"

JAZZY = {
    "NavigateToPose": (NAVIGATE_GOAL, ERROR, NAVIGATE_FEEDBACK),
    "ComputePathToPose": (PLAN_GOAL, f"{PLAN_RESULT}\n{ERROR}", NO_MEMBERS),
}
ACTIONS = {
    "humble": {
        "NavigateToPose": (NAVIGATE_GOAL, "std_msgs/Empty result", NAVIGATE_FEEDBACK),
        "ComputePathToPose": (PLAN_GOAL, PLAN_RESULT, NO_MEMBERS),
    },
    "jazzy": JAZZY,
    "kilted": JAZZY,
    "lyrical": {  # names are not on the wire, shapes are: two more float32, and a list before planner_id
        "NavigateToPose": (
            NAVIGATE_GOAL,
            ERROR,
            f"{NAVIGATE_FEEDBACK}\nfloat32 position_tracking_error\nfloat32 heading_tracking_error",
        ),
        "ComputePathToPose": (
            PLAN_GOAL.replace("string planner_id", "geometry_msgs/PoseStamped[] viapoints\nstring planner_id"),
            f"{PLAN_RESULT}\n{ERROR}",
            NO_MEMBERS,
        ),
    },
}


def definitions(distribution: str) -> dict[str, str]:
    """Type name -> text, in the order in which they need each other."""
    texts = SERVICES | LIVOX
    for action, (goal, result, feedback) in ACTIONS[distribution].items():
        texts |= action_definitions(f"nav2_msgs/action/{action}", goal, result, feedback)
    return texts


def action_definitions(action: str, goal: str, result: str, feedback: str) -> dict[str, str]:
    """The messages that rosidl makes of one .action file."""
    uuid = "unique_identifier_msgs/UUID goal_id"
    return {
        f"{action}_Goal": goal,
        f"{action}_Result": result,
        f"{action}_Feedback": feedback,
        f"{action}_SendGoal_Request": f"{uuid}\n{action}_Goal goal",
        f"{action}_SendGoal_Response": "bool accepted\nbuiltin_interfaces/Time stamp",
        f"{action}_GetResult_Request": uuid,
        f"{action}_GetResult_Response": f"int8 status\n{action}_Result result",
        f"{action}_FeedbackMessage": f"{uuid}\n{action}_Feedback feedback",
    }
