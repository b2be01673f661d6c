"""`openbelief ask` for what the map may not hold: nothing is driven to unless a person insists."""

from __future__ import annotations

import json
from pathlib import Path

from logs.trial import records
from logs.trial.reader import TrialReader
from robot_app.mission.replay import replay_trial


def ask(terminal, capsys, config: Path, sentence: str, *arguments: str) -> tuple[int, dict, list[object]]:
    trial = config.parent / "doubt.mcap"
    status = terminal(["ask", sentence, "--config", str(config), "--trial", str(trial), "--json", *arguments])
    return status, json.loads(capsys.readouterr().out), list(TrialReader(trial).records)


def goals(found: list[object]) -> list[object]:
    return [record for record in found if isinstance(record, records.GoalAnswer)]


def test_not_found_drives_nowhere_and_a_yes_to_all_is_no_yes_to_a_doubt(terminal, config, screen, capsys):
    status, report, found = ask(terminal, capsys, config, "find the saxophone", "--yes")
    assert (status, report["outcome"], report["reason"], report["visits"]) == (1, "FAILED", "not found", 0)
    assert not goals(found)
    assert any("the nearest are" in line for line in screen.lines)


def test_who_insists_is_driven_to_the_nearest(terminal, config, screen, capsys):
    status, report, found = ask(terminal, capsys, config, "find the saxophone", "--yes", "--insist")
    assert status == 1 and report["outcome"] == "FAILED" and goals(found)
    assert any("you insist" in line for line in screen.lines)


def test_unsure_with_yes_drives_nowhere(terminal, config, capsys):
    status, report, found = ask(terminal, capsys, config, "the armchair next to the aquarium", "--yes")
    assert (status, report["outcome"], report["visits"]) == (1, "FAILED", 0)
    assert report["reason"].startswith("unsure: ") and "aquarium" in report["reason"] and not goals(found)


def test_unsure_asks_a_person_whose_yes_drives(terminal, config, keyboard, screen, capsys):
    screen.reactions["I am not sure"] = lambda: keyboard.type("yes")
    _, report, found = ask(terminal, capsys, config, "the armchair next to the aquarium")
    assert report["visits"] == 1 and goals(found)


def test_what_the_sentence_came_to_stands_in_the_trial(terminal, config, capsys):
    _, _, found = ask(terminal, capsys, config, "find the armchair in the attic, please", "--yes")
    [ranking] = [record for record in found if isinstance(record, records.Ranking)]
    assert ranking.understood["place"] == "attic" and "attic" in ranking.understood["unused"]
    assert (ranking.readout, ranking.answer) == ("grounded", "unsure")
    queries = [record.sentence for record in found if isinstance(record, records.Query)]
    assert queries == ["find the armchair in the attic, please"]


def test_the_other_one_is_of_the_sentence_before_and_its_trial_says_so(terminal, config, keyboard, screen, capsys):
    """There is one armchair, so the other one is unsure; the second trial replays by itself."""
    screen.reactions["Ready over"] = lambda: keyboard.type("go to the armchair")
    screen.reactions["May I walk"] = lambda: keyboard.type("no")

    def after_the_first() -> None:
        screen.reactions["trial: "] = lambda: keyboard.type("")
        keyboard.type("the other one")

    screen.reactions["trial: "] = after_the_first
    screen.reactions["the map holds only 1"] = lambda: keyboard.type("no")
    assert terminal(["run", "--config", str(config), "--json"]) == 0
    first, second = (json.loads(line) for line in capsys.readouterr().out.splitlines())
    trials = [TrialReader(Path(report["trial"])) for report in (first, second)]
    [one], [two] = ([r for r in trial.records if isinstance(r, records.Query)] for trial in trials)
    assert (one.after, two.sentence, two.after) == ("", "the other one", "go to the armchair")
    [ranking] = [r for r in trials[1].records if isinstance(r, records.Ranking)]
    assert (ranking.understood["target"], ranking.understood["which"]) == ("armchair", "other")
    assert replay_trial(Path(second["trial"])).difference is None
