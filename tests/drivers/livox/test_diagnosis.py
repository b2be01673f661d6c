"""A lidar's own words as findings for a person, here and over the wire."""

from __future__ import annotations

import pytest

from drivers.livox.diagnosis import diagnoses
from drivers.livox.hms import health_code
from drivers.livox.intake import LidarState
from drivers.ros.diagnosis import Diagnosis, Severity, diagnoses_of, diagnostics_message
from drivers.ros.messages import WireError, decode, encode

TYPE = "diagnostic_msgs/msg/DiagnosticArray"


@pytest.mark.parametrize(
    ("state", "severity", "words"),
    [
        (None, Severity.WARN, "said nothing"),
        ("sampling", Severity.OK, "sampling, 45 degrees C inside, no health codes"),
        ("idle", Severity.WARN, "idle"),
        ("motor starting", Severity.WARN, "motor starting"),
        ("error", Severity.ERROR, "error"),
    ],
)
def test_the_state_of_a_lidar_is_judged_and_what_is_not_well_has_a_remedy(state, severity, words):
    [found] = diagnoses(LidarState(0, state=state, core_temperature_c=45.25) if state else None)
    assert found.severity is severity and words in found.said and bool(found.remedy) is (severity is not Severity.OK)


@pytest.mark.parametrize(
    ("raw", "severity", "words"),
    [
        (0x01040002, Severity.WARN, "warning: the window is dirty (HMS 0104)"),
        (0x01040001, Severity.OK, "info: the window is dirty (HMS 0104)"),
        (0x04010003, Severity.ERROR, "error: the network link dropped (HMS 0401)"),
        (0x02150004, Severity.ERROR, "fatal: the scan module has a fault (HMS 0215)"),
        (0x09990007, Severity.WARN, "level 7: a code this program does not know (HMS 0999)"),
    ],
)
def test_each_health_code_is_a_finding_in_words(raw, severity, words):
    _, found = diagnoses(LidarState(0, state="sampling", health=(health_code(raw),)))
    assert (found.severity, found.said) == (severity, words) and found.remedy


def test_findings_survive_the_wire():
    found = diagnoses(LidarState(0, state="sampling", health=(health_code(0x01040002), health_code(0x04010003))))
    assert list(diagnoses_of(decode(encode(diagnostics_message(7, found)), TYPE))) == found


def test_what_others_say_is_passed_over_and_a_level_that_is_none_of_ours_refused():
    message = diagnostics_message(7, [Diagnosis("lidar state", Severity.OK, "sampling")] * 2)
    message.status[0].hardware_id = "a motor"
    assert len(diagnoses_of(message)) == 1
    message.status[1].level = 3
    with pytest.raises(WireError, match="level 3"):
        diagnoses_of(message)
