"""What a trial holds, record by record: the inputs that a mission consumed, its decisions, and notes beside them.

A record's topic names it in the file. Inputs are read back in order by a replay, decisions are compared with the
replay's, notes are for people only. Decisions carry no wall-clock time, so that a replay writes the same bytes.
"""

from __future__ import annotations

from logs.trial.decisions import (
    Asked,
    Check,
    Checks,
    Chosen,
    Ended,
    Exclusion,
    Feedback,
    Goal,
    Ranking,
    Relative,
    Scored,
    Spoken,
    Told,
    Transition,
)
from logs.trial.inputs import (
    CancelAnswer,
    Cloud,
    Frame,
    GoalAnswer,
    HaltAnswer,
    MapUsed,
    NavigationEnd,
    NavigatorState,
    OperatorReply,
    Plan,
    PortFailure,
    PoseLook,
    Query,
    RobotPose,
    Segments,
    Stop,
    Supervised,
    Transform,
)
from logs.trial.parts import Calibration, Decision, Input, Note, PlanarPose, Record, Segment

__all__ = [
    "RECORDS",
    "Asked",
    "Calibration",
    "CancelAnswer",
    "Check",
    "Checks",
    "Chosen",
    "Cloud",
    "Decision",
    "Ended",
    "Exclusion",
    "Feedback",
    "Frame",
    "Goal",
    "GoalAnswer",
    "HaltAnswer",
    "Input",
    "MapUsed",
    "NavigationEnd",
    "NavigatorState",
    "Note",
    "OperatorReply",
    "Plan",
    "PlanarPose",
    "PortFailure",
    "PoseLook",
    "Query",
    "Ranking",
    "Record",
    "Relative",
    "RobotPose",
    "Scored",
    "Segment",
    "Segments",
    "Spoken",
    "Stop",
    "Supervised",
    "Told",
    "Transform",
    "Transition",
]

# topic -> the record that it carries
RECORDS: dict[str, type[Record]] = {
    kind.topic: kind for role in (Input, Decision, Note) for kind in role.__subclasses__()
}
