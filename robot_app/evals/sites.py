"""Answers at random furnished sites, so that "a new site" is a number: no constant was chosen on them.

Each seed is a home or a small office with other things than the development recordings have, called by the names of
the LVIS categories; perception errs as often as in the development recording. Simulated: no camera, no robot.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from robot_app.arguments import from_one
from robot_app.cli import print_json

if TYPE_CHECKING:
    from sim_fakes.world.sites.site import Site

HEADS = {
    "consensus": "consensus",
    "grounded": "grounded",
    "grounded_rooms": "with rooms",
    "kept": "kept",
    "refused": "refused",
    "own_colour": "own colour",
    "other_colour": "no such colour",
    "relations_consensus": "relations, consensus",
    "relations": "relations",
}
ROOM_HEADS = {"in_right_room": "things in the right room", "rooms_named": "rooms named right"}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--seeds", type=from_one, default=12, metavar="N", help="so many sites (default 12)")
    parser.add_argument("--first", type=from_one, default=1, metavar="SEED", help="the first seed (default 1)")
    parser.add_argument("-o", "--output", type=Path, metavar="DIR", help="keep the memories and truths here")


def run(options: argparse.Namespace) -> None:
    from openbelief.evaluation.sites import evaluate_site, summed
    from openbelief.evaluation.truth import truth_of
    from openbelief.perception.sentence import SentenceEncoder
    from sim_fakes.world.sites.site import make_site

    encoder, sites = SentenceEncoder(), []
    for seed in range(options.first, options.first + options.seeds):
        site = make_site(seed, encoder)
        if options.output:
            _keep(site, options.output)
        scores = evaluate_site(site.memory, site.rooms, truth_of(site.truth), truth_of(site.relations))
        sites.append({"seed": seed, **scores})
        print(f"site {seed}: {_told(scores)}", file=sys.stderr, flush=True)
    result = {"sites": sites, "all": summed(sites)}
    print_json(result) if options.json else _show(result)


def _keep(site: Site, folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    site.memory.save(folder / f"site{site.seed}.belief")
    documents = {"truth": site.truth, "relations": site.relations, "rooms": site.truth["rooms"]}
    for name, document in documents.items():
        (folder / f"site{site.seed}.{name}.json").write_text(json.dumps(document), encoding="utf-8")


def _told(scores: dict[str, Any]) -> str:
    return ", ".join(
        f"{head} {scores[name]['right']}/{scores[name]['of']}" for name, head in (HEADS | ROOM_HEADS).items()
    )


def _show(result: dict[str, Any]) -> None:
    from rich.table import Table

    from robot_app.tables import number, show

    table = Table(title="SR@1m; relations: R@1", title_justify="left")
    for head in ("site", *HEADS.values()):
        table.add_column(head, justify="right")
    for site in result["sites"]:
        table.add_row(str(site["seed"]), *(number(site[n]["right"] / site[n]["of"], 2) for n in HEADS))
    table.add_section()
    table.add_row("all", *(number(result["all"][n]["rate"], 3) for n in HEADS))
    table.add_row("95 %", *("-".join(number(x, 3) for x in result["all"][n]["interval"]) for n in HEADS))
    show(table)
    kinds = result["all"]["by_kind"].items()
    print("grounded by kind: " + ", ".join(f"{kind} {r['right']}/{r['of']}" for kind, r in kinds))
    found = (f"{head} {result['all'][n]['right']}/{result['all'][n]['of']}" for n, head in ROOM_HEADS.items())
    print("derived from their maps: " + ", ".join(found))
