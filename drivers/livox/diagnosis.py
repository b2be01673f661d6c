"""What a lidar says of itself, once a second, as findings for a person."""

from __future__ import annotations

from drivers.livox.intake import LidarState
from drivers.ros.diagnosis import Diagnosis, Severity

SAMPLING = "sampling"
AT_REST = {  # its other states -> what to do
    "idle": "set it to sampling with the vendor's tool, or with [livox] take_control = true",
    "error": "power-cycle the lidar; if it returns, have it serviced",
    "upgrading": "wait for the end of its firmware's upgrade",
}
SEVERITIES = {"info": Severity.OK, "warning": Severity.WARN, "error": Severity.ERROR, "fatal": Severity.ERROR}


def diagnoses(state: LidarState | None) -> list[Diagnosis]:
    """Its state with the temperature inside, and each health code in words. None: no push message has come."""
    if state is None:
        remedy = "let its push messages come to this host too: without them nobody hears of a dirty window or of heat"
        return [Diagnosis("lidar state", Severity.WARN, "it has said nothing of itself", remedy)]
    codes = [
        Diagnosis(
            "lidar health",
            SEVERITIES.get(code.level, Severity.WARN),
            f"{code.level}: {code.words} (HMS {code.id:04X})",
            code.remedy,
        )
        for code in state.health
    ]
    return [_state(state), *codes]


def _state(state: LidarState) -> Diagnosis:
    word = state.state or "state unknown"
    warm = "" if state.core_temperature_c is None else f", {state.core_temperature_c:.0f} degrees C inside"
    said = f"{word}{warm}, {len(state.health) or 'no'} health codes"
    if word == SAMPLING:
        return Diagnosis("lidar state", Severity.OK, said)
    severity = Severity.ERROR if word == "error" else Severity.WARN
    return Diagnosis("lidar state", severity, said, AT_REST.get(word, "wait until it has started, then ask again"))
