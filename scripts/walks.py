"""Four walks through the house: where each step of what happens is done. docs/architecture.md shows them."""

from __future__ import annotations

Stop = tuple[str, str, str]  # file, definition in it, what happens there

# Walks that come back into a room that they left, and why they must.
RETURNS: dict[str, str] = {
    "A query to its outcome": "Algorithm 1 asks the core, and goes on with its answer",
    "An input to its replayed comparison": "the mission lies between its inputs and the comparison",
}

WALKS: dict[str, list[Stop]] = {
    "A query to its outcome": [
        ("robot_app/verbs/ask.py", "run", "the configuration, the operator at a terminal, the robot"),
        ("robot_app/mission/missions.py", "Missions.ask", "one sentence becomes one mission, recorded"),
        ("robot_app/mission/recorded.py", "run_recorded", "the trial's file is opened before anything happens"),
        ("behaviors/mission.py", "Mission.run", "Algorithm 1: state by state, each with its reason"),
        ("openbelief/memory.py", "ObjectMemory.rank", "retrieve: the candidates outside R and U, best first"),
        ("openbelief/goal_pose.py", "goal_poses", "where candidate i can be looked at from"),
        ("behaviors/attempt.py", "Attempt.next_approach", "the first of them that the planner reaches"),
        ("behaviors/drive.py", "drive", "the goal, watched to its end"),
        ("behaviors/arrival.py", "arrival_frame", "the arrival RGB-D observation"),
        ("openbelief/verification.py", "verify", "visibility, semantic, geometric: confirmed, or why not"),
        ("behaviors/events.py", "Outcome", "the end, in the one form that all verbs print"),
    ],
    "A frame to an observation": [
        ("robot_app/verbs/map.py", "run", "recordings, perception, options"),
        ("logs/frames/reader.py", "FrameReader.frames", "messages to posed RGB-D frames; what is left out is counted"),
        ("openbelief/mapping.py", "map_frames", "the paper's five steps over the frames"),
        ("openbelief/acquisition.py", "acquire", "masks and depth to observations o_e"),
        ("openbelief/store.py", "BeliefStore.add_frame", "one transaction a frame: what is in, is safe"),
        ("openbelief/memory.py", "ObjectMemory.build", "association and belief over all evidence"),
    ],
    "STOP to the cancel on the wire": [
        ("robot_app/mission/operator.py", "SharedOperator.stop", "latched, whoever said it and wherever"),
        ("behaviors/drive.py", "drive", "every poll of a drive asks for STOP first"),
        ("drivers/nav2/cancelling.py", "Cancelling.cancel", "the goal; where that was not taken, all goals"),
        ("drivers/ros/action.py", "ActionClient.cancel", "CancelGoal as CDR, and its reply"),
        ("drivers/ros/zenoh_link.py", "ZenohLink.get", "the query on the wire"),
    ],
    "An input to its replayed comparison": [
        ("logs/trial/recording_ports.py", "recorded", "every port writes what it answered, in order"),
        ("logs/trial/inputs.py", "Frame", "the record: what the decision saw, losslessly"),
        ("logs/trial/writer.py", "TrialWriter.write", "into the trial"),
        ("logs/trial/reader.py", "TrialReader", "read back, every byte checked"),
        ("logs/trial/replay_ports.py", "replay_ports", "the same answers in the same order"),
        ("behaviors/mission.py", "Mission.run", "the same mission, computed anew"),
        ("logs/trial/compare.py", "compare_decisions", "identical, or the first difference"),
    ],
}
