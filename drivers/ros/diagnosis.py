"""What is wrong with a part, for a person: diagnostic_msgs/DiagnosticArray and back."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum

from drivers.ros.messages import Message, WireError, header, make

HARDWARE_ID = "openbelief onboard"  # others speak on /diagnostics, too
REMEDY = "remedy"


class Severity(IntEnum):
    """As DiagnosticStatus numbers them."""

    OK = 0
    WARN = 1
    ERROR = 2


@dataclass(frozen=True)
class Diagnosis:
    """One finding. remedy: what to do, empty where all is well. `str()` is the operator's sentence."""

    name: str
    severity: Severity
    said: str
    remedy: str = ""

    def __str__(self) -> str:
        return f"{self.said}; {self.remedy}." if self.remedy else f"{self.said}."


def diagnostics_message(stamp_ns: int, diagnoses: Sequence[Diagnosis]) -> Message:
    return make(
        "diagnostic_msgs/msg/DiagnosticArray", header=header(stamp_ns, ""), status=[_status(d) for d in diagnoses]
    )


def diagnoses_of(message: Message) -> tuple[Diagnosis, ...]:
    """Those of `openbelief onboard`. Raises WireError on a level that is none of ours."""
    return tuple(_diagnosis(status) for status in message.status if status.hardware_id == HARDWARE_ID)


def _status(diagnosis: Diagnosis) -> Message:
    values = [make("diagnostic_msgs/msg/KeyValue", key=REMEDY, value=diagnosis.remedy)] if diagnosis.remedy else []
    return make(
        "diagnostic_msgs/msg/DiagnosticStatus",
        level=int(diagnosis.severity),
        name=diagnosis.name,
        message=diagnosis.said,
        hardware_id=HARDWARE_ID,
        values=values,
    )


def _diagnosis(status: Message) -> Diagnosis:
    try:
        severity = Severity(status.level)
    except ValueError as error:
        raise WireError(f"A diagnosis of level {status.level} is none of openbelief's.") from error
    remedies = [pair.value for pair in status.values if pair.key == REMEDY]
    return Diagnosis(status.name, severity, status.message, "".join(remedies))
