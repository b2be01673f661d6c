"""How long Nav2 is waited for, step by step."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Nav2Limits:
    """Seconds. Time-outs of queries are wall time, everything else is the clock's."""

    send_s: float = 1.0  # twice, a goal as a question for a path
    plan_s: float = 5.0
    result_wait_s: float = 600.0  # one get_result waits at the server, and is asked again where it ends unanswered
    result_ask_s: float = 0.5  # once the status says that the goal has ended
    cancel_s: float = 0.45  # twice; with a pause within the 1 s that the port allows
    silence_s: float = 5.0  # no feedback and no status: lost. A reconnection takes up to 4 s
    goal_s: float = 600.0  # no goal takes longer
    pose_age_s: float = 0.5
