"""A random site: its memory, and the truth by which answers about it are judged."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from openbelief.memory import ObjectMemory
from openbelief.parameters import Parameters
from openbelief.perception.ports import TextEncoder
from openbelief.rooms import Room, rooms_of
from openbelief.surroundings import StoreyMap, Surroundings
from sim_fakes.world.sites.layout import furnished
from sim_fakes.world.sites.plan import site_map
from sim_fakes.world.sites.questions import Questions, unsaid_names
from sim_fakes.world.sites.views import Views


@dataclass(frozen=True)
class Site:
    """memory: without rooms, with a map. rooms: the true ones. truth, relations: documents of `openbelief.truth/1`."""

    seed: int
    memory: ObjectMemory
    rooms: tuple[Room, ...]
    truth: dict[str, Any]
    relations: dict[str, Any]


def make_site(seed: int, encoder: TextEncoder) -> Site:
    """Everything follows from the seed. Takes some seconds."""
    rooms, placed = furnished(seed)
    rng = np.random.default_rng([seed, 0xA5C])
    unsaid = unsaid_names(placed, rng)
    views, questions = Views(encoder, rooms, unsaid, seed), Questions(placed, unsaid, rng)
    of_things = list(views.of(placed))
    evidence = [*(observation for observation, _ in of_things), *views.of_background()]
    origin = [[o.provenance.stamp_ns, o.mask, true_id] for o, true_id in of_things if o.provenance]
    shared = {"format": "openbelief.truth/1", "frame": "map", "objects": [p.as_json() for p in placed]}
    room_rows = [room.as_json() for room in rooms]
    truth = {"name": f"site {seed}", **shared, "rooms": room_rows, "mask_origin": origin}
    around = Surroundings(maps=(StoreyMap("site", site_map(rooms, placed)),))
    truth["queries"] = questions.queries()
    return Site(
        seed,
        ObjectMemory.build(evidence, encoder, Parameters(), surroundings=around),
        tuple(rooms_of(room_rows)),
        truth | {"absent_nouns": questions.absent()},
        {"name": f"site {seed}, relations", **shared, "queries": questions.relations()},
    )
