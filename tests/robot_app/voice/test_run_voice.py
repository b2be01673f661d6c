"""`openbelief run --voice` as a whole: microphone, recogniser, mission, trial; and each way in which it is refused."""

from __future__ import annotations

import builtins
import json
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path

import pytest

from logs.trial.reader import TrialReader
from logs.trial.records import Spoken
from robot_app.cli import Failure
from robot_app.voice.local_talk import ASK, LISTENING
from robot_app.voice.microphone import LocalMicrophone
from tests.robot_app.voice.alsa_microphone import NAME, AlsaMicrophone
from tests.robot_app.voice.loudspeaker import FakeSounddevice

QUESTION = "May I walk"
HUNG_S = 120.0


@pytest.fixture
def config(small_site: Path) -> Path:
    """A person's yes before motion, the fake microphone, and no sound from the test."""
    path = small_site / "asking.toml"
    text = (small_site / "robot.toml").read_text().replace('motion = "allow"', 'motion = "ask"')
    assert 'microphone = ""' in text and 'speak = "auto"' in text
    path.write_text(
        text.replace('microphone = ""', f'microphone = "{NAME}"').replace('speak = "auto"', 'speak = "off"')
    )
    return path


@pytest.fixture
def sounddevice(monkeypatch) -> FakeSounddevice:
    made = FakeSounddevice(NAME)
    monkeypatch.setitem(sys.modules, "sounddevice", made)
    return made


def listens(screen, keyboard, after: str) -> None:
    """When those words are shown: Enter, and Enter again while it listens."""
    screen.reactions[LISTENING] = lambda: keyboard.type("")
    screen.reactions[after] = lambda: keyboard.type("")


def trial_of(capsys) -> TrialReader:
    return TrialReader(Path(json.loads(capsys.readouterr().out.splitlines()[-1])["trial"]))


def test_enter_speak_enter_ask_yes_is_a_confirmed_mission(
    terminal, config, keyboard, screen, capsys, speech, sounddevice
):
    sounddevice.says = [speech / "go_to_the_armchair.wav"]
    listens(screen, keyboard, "Ready over")
    screen.reactions[ASK] = lambda: keyboard.type("ask")
    screen.reactions[QUESTION] = lambda: keyboard.type("yes")
    screen.reactions["trial:"] = lambda: keyboard.type("end")
    assert terminal(["run", "--voice", "--config", str(config), "--json"]) == 0
    trial = trial_of(capsys)
    [said] = [record for record in trial.records if isinstance(record, Spoken)]
    assert trial.query.sentence == said.asked == said.transcript == "Go to the armchair."
    assert any("CONFIRMED" in line for line in screen.lines)
    assert sounddevice.opened == [{"samplerate": 16000, "channels": 1, "dtype": "int16"}]


def test_while_a_question_is_open_enter_listens_a_stop_counts_and_a_yes_does_not(
    terminal, config, keyboard, screen, capsys, speech, sounddevice
):
    sounddevice.says = [speech / "yes.wav", speech / "stop.wav"]
    screen.reactions["Ready over"] = lambda: keyboard.type("go to the armchair")
    listens(screen, keyboard, QUESTION)
    screen.reactions["its answer is typed"] = lambda: listens_again()
    screen.reactions["trial:"] = lambda: keyboard.type("end")

    def listens_again() -> None:
        screen.reactions[LISTENING] = lambda: keyboard.type("")
        keyboard.type("")

    assert terminal(["run", "--voice", "--config", str(config), "--json"]) == 0
    assert any('Heard "Yes."' in line for line in screen.lines)
    trial = trial_of(capsys)
    [reply] = [record for record in trial.records if record.topic == "/trial/operator_reply"]
    [said] = [record for record in trial.records if isinstance(record, Spoken)]
    assert (reply.reply, reply.how, said.asked) == ("stop", "voice", "stop")


def test_an_asked_sentence_needs_this_terminals_command(terminal, config, keyboard, screen, speech, sounddevice):
    """Who has taken over is not asked for in the name of."""
    from robot_app.mission.operator import SharedOperator

    taken: list[SharedOperator] = []
    whole = SharedOperator.take

    def take(self, *given, **options):
        taken.append(self)
        return whole(self, *given, **options)

    sounddevice.says = [speech / "go_to_the_armchair.wav"]
    listens(screen, keyboard, "Ready over")
    screen.reactions[ASK] = lambda: (whole(taken[0], "bob", "console", over=True), keyboard.type("ask", "end"))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(SharedOperator, "take", take)
        assert terminal(["run", "--voice", "--config", str(config)]) == 0
    assert any("bob (console) commands the robot" in line for line in screen.lines)


def test_a_microphone_that_is_lost_while_it_listens_is_said_and_the_run_goes_on(
    terminal, config, keyboard, screen, speech, sounddevice
):
    sounddevice.says, sounddevice.lost = [speech / "stop.wav"], True
    listens(screen, keyboard, "Ready over")
    screen.reactions["the microphone was lost"] = lambda: keyboard.type("end")
    assert terminal(["run", "--voice", "--config", str(config)]) == 0


def test_a_name_that_no_microphone_has_is_said_with_the_setting_and_the_run_goes_on(
    terminal, config, keyboard, screen, sounddevice
):
    sounddevice.device = "another"
    screen.reactions["Ready over"] = lambda: keyboard.type("")
    screen.reactions["the microphone cannot be opened"] = lambda: keyboard.type("end")
    assert terminal(["run", "--voice", "--config", str(config)]) == 0
    [line] = [line for line in screen.lines if "cannot be opened" in line]
    assert "[voice] microphone" in line and "python -m sounddevice" in line


def without(name: str, error: type[Exception]) -> Callable[..., object]:
    whole = builtins.__import__

    def imported(module, *arguments, **options):
        if module.split(".")[0] == name:
            raise error(name)
        return whole(module, *arguments, **options)

    return imported


@pytest.mark.parametrize(
    ("module", "error", "remedy"),
    [
        ("moonshine_voice", ImportError, "requirements/voice.txt"),
        ("sounddevice", ImportError, "requirements/voice.txt"),
        ("sounddevice", OSError, "sudo apt-get install libportaudio2"),  # as it says "PortAudio library not found"
    ],
)
def test_what_is_not_installed_is_refused_with_the_line_that_adds_it_before_a_robot_is_opened(
    terminal, config, screen, monkeypatch, module, error, remedy
):
    monkeypatch.delitem(sys.modules, module, raising=False)
    monkeypatch.setattr(builtins, "__import__", without(module, error))
    assert terminal(["run", "--voice", "--config", str(config)]) == 1
    assert remedy in screen.lines[-1] and not any("Ready over" in line for line in screen.lines)


def portaudio() -> object:
    try:
        import sounddevice
    except OSError as error:
        pytest.skip(f"{error}: sudo apt-get install libportaudio2")
    return sounddevice


def test_portaudio_itself_says_that_there_is_no_such_microphone():
    portaudio()
    with pytest.raises(Failure, match="No input device matching 'no such thing'") as refused:
        LocalMicrophone("no such thing").start()
    assert "\n" not in str(refused.value)


class VoiceProgram:
    """`run --voice` as a process of its own; `until` reads what it says."""

    def __init__(self, config: Path, environment: dict[str, str]) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-m", "robot_app.cli", "run", "--voice", "--config", str(config), "--json"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env=environment,
        )
        self._hung = threading.Timer(HUNG_S, self.process.kill)  # a test fails, and never hangs
        self._hung.start()

    def until(self, words: str) -> str:
        assert self.process.stderr is not None
        said = []
        for line in self.process.stderr:
            said.append(line)
            if words in line:
                return line
        raise AssertionError("".join(said))

    def type(self, line: str) -> None:
        assert self.process.stdin is not None
        self.process.stdin.write(f"{line}\n")
        self.process.stdin.flush()

    def end(self) -> str:
        """What it printed."""
        printed, _ = self.process.communicate()
        self._hung.cancel()
        return printed


def test_through_portaudio_and_alsa_a_spoken_command_is_heard_asked_and_confirmed(config, speech, tmp_path):
    portaudio()
    if not Path("/usr/share/alsa/alsa.conf").exists():
        pytest.skip("ALSA's configuration is not installed (apt-get install libasound2-data)")
    with AlsaMicrophone(tmp_path) as microphone:
        program = VoiceProgram(config, microphone.environment)
        program.until("Ready over")
        program.type("")
        program.until(LISTENING)
        microphone.says(speech / "go_to_the_armchair.wav")
        program.type("")
        assert "chair" in program.until("Heard ")
        program.type("ask")
        program.until(QUESTION)
        program.type("yes")
        program.until("CONFIRMED")
        program.until("trial:")
        program.type("end")
        [line] = program.end().splitlines()
    assert json.loads(line)["outcome"] == "CONFIRMED" and program.process.returncode == 0
