"""Write the generated parts of docs/: between `<!-- generated NAME -->` and `<!-- end NAME -->` of each page.

`python scripts/write_docs.py` writes them, `--check` names the stale ones and exits 1. To add one, add a row to
GENERATED: (page, name) -> a function that returns the text.
"""

from __future__ import annotations

import argparse
import json
import re
import sys
from collections.abc import Callable
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "scripts")]

import architecture  # noqa: E402 - beside this script


def mission_diagram() -> str:
    from behaviors.machine import MissionMachine

    diagram = f"{MissionMachine:mermaid}".strip()
    return f"```mermaid\n{diagram}\n```"


def mission_ends() -> str:
    from behaviors.events import ENDS

    return table(["end", "when"], [[f"`{end}`", words] for end, words in ENDS.items()])


def mission_navigation() -> str:
    from behaviors.events import NAVIGATION_EVENTS

    rows = [[f"{status}", f"`{event}`"] for status, event in NAVIGATION_EVENTS.items()]
    return table(["the goal's end", "event"], rows)


def trial_records() -> str:
    from logs.trial.records import RECORDS

    rows = [[f"`{topic}`", kind.role, summary(kind)] for topic, kind in RECORDS.items()]
    return table(["topic", "role", "what"], rows)


def safety_conditions() -> str:
    from behaviors.safety_conditions import CONDITIONS

    rows = [[name, f"`{reaction}`", (test.__doc__ or "").strip()] for name, (reaction, test) in CONDITIONS.items()]
    return table(["condition", "reaction", "when"], rows)


def ros_topics() -> str:
    from drivers.topics import TOPICS

    head = ["topic", "type", "Hz", "at most", "latched"]
    rows = [
        [
            f"`{t.name}`",
            f"`{t.type_name}`",
            f"{t.rate_hz:g}" if t.rate_hz else "once",
            f"{t.max_bytes >> 10} KiB",
            "yes" if t.latched else "",
        ]
        for t in TOPICS
    ]
    return table(head, rows)


def remote_requests() -> str:
    """One line a verb, and their JSON Schemas."""
    from robot_app.remote.messages import REQUESTS

    rows = [
        [f"`{kind.verb}`", summary(kind), ", ".join(f"`{name}`" for name in kind.model_fields) or "-"]
        for kind in REQUESTS
    ]
    schemas = [f"```json\n{json.dumps({kind.verb: kind.model_json_schema()})}\n```" for kind in REQUESTS]
    return "\n\n".join([table(["verb", "what", "fields"], rows), "Their JSON Schemas:", *schemas])


def table(head: list[str], rows: list[list[str]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |" for line in lines)


def summary(kind: type) -> str:
    """The first line of a class's own docstring, its name where it has none."""
    text = kind.__dict__.get("__doc__")
    return text.strip().splitlines()[0] if text else f"`{kind.__name__}`"


GENERATED: dict[tuple[str, str], Callable[[], str]] = {
    ("docs/api.md", "requests"): remote_requests,
    ("docs/architecture.md", "rooms"): architecture.diagram,
    ("docs/architecture.md", "contracts"): architecture.contract_list,
    ("docs/architecture.md", "walks"): architecture.walks,
    ("docs/mission.md", "diagram"): mission_diagram,
    ("docs/mission.md", "ends"): mission_ends,
    ("docs/mission.md", "navigation"): mission_navigation,
    ("docs/mission.md", "records"): trial_records,
    ("docs/nav2.md", "topics"): ros_topics,
    ("docs/watchdog.md", "conditions"): safety_conditions,
}


def rewritten(page: str, text: str) -> str:
    """The page with all of its generated parts as they should be; ValueError where a marker is missing."""
    for (owner, name), generate in GENERATED.items():
        if owner == page:
            text = replaced(text, name, generate(), page)
    return text


def replaced(text: str, name: str, part: str, page: str) -> str:
    begin, end = f"<!-- generated {name} -->", f"<!-- end {name} -->"
    pattern = re.compile(f"{re.escape(begin)}.*?{re.escape(end)}", re.DOTALL)
    if len(pattern.findall(text)) != 1:
        raise ValueError(f"{page} should have one pair of markers {begin} ... {end}")
    return pattern.sub(lambda _: f"{begin}\n{part}\n{end}", text)


def stale_pages(root: Path = ROOT) -> list[str]:
    pages = dict.fromkeys(page for page, _ in GENERATED)
    return [page for page in pages if rewritten(page, (root / page).read_text()) != (root / page).read_text()]


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--check", action="store_true", help="name the stale pages, write nothing")
    stale, check = stale_pages(), parser.parse_args().check
    for page in stale:
        print(f"{page}: {'stale, run python scripts/write_docs.py' if check else 'written'}")
        if not check:
            (ROOT / page).write_text(rewritten(page, (ROOT / page).read_text()))
    return int(check and bool(stale))


if __name__ == "__main__":
    sys.exit(main())
