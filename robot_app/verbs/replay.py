"""Run a recorded trial's mission again from what it consumed, and compare decision by decision.

Ranking, goal poses, arrival checks and transitions are computed anew; sensors, navigation, operator and perception
answer as they did. With --perception, that perception looks at the recorded arrival frames again. Exit status 0:
identical (the same discrete decisions, floats within 1e-6; with --perception, similarity and overlap within 0.05, and
the words of a reason may differ). 1: the first difference is printed, with how far the values are apart.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from robot_app.cli import Failure, Usage, print_json

if TYPE_CHECKING:
    from logs.trial.compare import Difference
    from logs.trial.records import Checks, Record
    from robot_app.mission.replay import Replayed

EXAMPLE = "openbelief replay demo-out/trial.mcap"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    from robot_app import arguments
    from robot_app.perceptions import FORMS

    parser.add_argument("trial", type=Path, metavar="TRIAL.mcap", help="a recorded trial")
    parser.add_argument("--memory", type=Path, help="the .belief file, where the trial names it only by its hash")
    parser.add_argument(
        "--perception",
        type=arguments.perception,
        metavar="KIND:ARGUMENT",
        help=f"looks at the arrival frames again: {FORMS}",
    )
    parser.add_argument("--seed", type=int, metavar="N", help="of a simulated perception (default: the trial's)")


def run(options: argparse.Namespace) -> int:
    from logs.mcap_io.reader import LogError
    from logs.trial.header import TrialError
    from openbelief.store import BeliefFileError
    from robot_app.mission.replay import replay_trial

    if options.seed is not None and options.perception is None:
        raise Usage("--seed is for --perception: nothing is simulated without it")
    try:
        replayed = replay_trial(options.trial, options.memory, options.perception, options.seed)
    except (LogError, TrialError, BeliefFileError, ValueError, OSError) as error:
        raise Failure(str(error)) from error
    if options.json:
        print_json(_as_json(options.trial, replayed))
    else:
        print("\n".join(_story(replayed)))
    return 0 if replayed.difference is None else 1


def _story(replayed: Replayed) -> Iterator[str]:
    from logs.structured import neutralise

    if replayed.again is not None:
        yield neutralise(f"perception then {_recorded_perception(replayed)}, now {replayed.again.id}")
        yield from (neutralise(_look_line(number, look)) for number, look in enumerate(_looks(replayed), start=1))
    if replayed.difference is not None:
        yield neutralise(f"different: {replayed.difference}")
        if replayed.again is not None and _verdicts(replayed.trial.decisions) == _verdicts(replayed.decisions):
            yield "every verdict is the same"
    else:
        yield f"identical: {len(replayed.decisions)} decisions, outcome {_outcome(replayed)}"


def _outcome(replayed: Replayed) -> str:
    ended = replayed.trial.outcome
    return "none" if ended is None else f"{ended.end} ({ended.reason})"


def _as_json(path: Path, replayed: Replayed) -> dict[str, Any]:
    from behaviors.to_records import outcome_of

    difference, ended = replayed.difference, replayed.trial.outcome
    report = {
        "trial": str(path),
        "replay": "identical" if difference is None else "different",
        "decisions": len(replayed.decisions),
        **(outcome_of(ended).as_json() if ended else {"outcome": None}),
        "difference": None if difference is None else _difference(difference),
    }
    if replayed.again is None:
        return report
    return report | {
        "perception": {"recorded": _recorded_perception(replayed), "replayed": replayed.again.id},
        "looks": _looks(replayed),
        "verdicts_same": _verdicts(replayed.trial.decisions) == _verdicts(replayed.decisions),
    }


def _difference(difference: Difference) -> dict[str, Any]:
    return {
        "step": difference.step,
        "decision": difference.decision,
        "record": difference.topic,
        "field": difference.field,
        "recorded": difference.recorded,
        "replayed": difference.replayed,
        "by": difference.by,
        "sentence": str(difference),
    }


def _recorded_perception(replayed: Replayed) -> str:
    from logs.trial.records import Segments

    return next((r.perception for r in replayed.trial.records if isinstance(r, Segments)), "none")


def _looks(replayed: Replayed) -> list[dict[str, Any]]:
    """Every frame that was looked at again, with the checks then and now."""
    then, now = _checks(replayed.trial.decisions), _checks(replayed.decisions)
    return [
        {
            "frame_stamp_ns": look.stamp_ns,
            "masks": {"recorded": len(look.before), "replayed": len(look.now)},
            "recorded": _values(then.get(look.stamp_ns)),
            "replayed": _values(now.get(look.stamp_ns)),
        }
        for look in (replayed.again.looks if replayed.again else [])
    ]


def _checks(decisions: list[Record]) -> dict[int, Checks]:
    from logs.trial.records import Checks

    return {record.frame_stamp_ns: record for record in decisions if isinstance(record, Checks)}


def _verdicts(decisions: list[Record]) -> list[tuple[int, str]]:
    return [(checks.object_id, checks.verdict) for checks in _checks(decisions).values()]


def _values(checks: Checks | None) -> dict[str, Any] | None:
    if checks is None:
        return None
    values: dict[str, Any] = {"semantic": checks.semantic.value, "geometric": checks.geometric.value}
    values["relative"] = None if checks.relative is None else checks.relative.model_dump()
    return {"object_id": checks.object_id, **values, "verdict": checks.verdict, "reason": checks.reason}


def _look_line(number: int, look: dict[str, Any]) -> str:
    """`look 1: 6 masks, now 5; like the query 0.61, now 0.43; at its place 0.80, now -; confirmed, now ...`"""
    then, now = look["recorded"] or {}, look["replayed"] or {}
    parts = [
        f"{look['masks']['recorded']} masks, now {look['masks']['replayed']}",
        f"like the query {_number(then.get('semantic'))}, now {_number(now.get('semantic'))}",
        *_relative_parts(then.get("relative"), now.get("relative")),
        f"at its place {_number(then.get('geometric'))}, now {_number(now.get('geometric'))}",
        f"{then.get('verdict', '-')}, now {now.get('verdict', '-')}",
    ]
    return f"look {number}: " + "; ".join(parts)


def _relative_parts(then: dict[str, Any] | None, now: dict[str, Any] | None) -> Iterator[str]:
    """What the relative check held against what; nothing under the paper's."""
    if then or now:
        for name in ("contrast", "lead"):
            yield f"{name} {_number((then or {}).get(name))}, now {_number((now or {}).get(name))}"


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.3f}"
