"""Rooms by what people call them."""

from __future__ import annotations

# The first name stands for all of a row. Not an exhaustive list of the world's rooms: what is not here is still a place
# where a memory has a room of that name.
PLACES: tuple[tuple[str, ...], ...] = tuple(
    tuple(name.strip() for name in row.split(","))
    for row in (
        "kitchen, kitchenette, galley, cookhouse, pantry kitchen",
        "bathroom, bath, restroom, washroom, wc, shower room, ensuite, en suite, lavatory, toilet room",
        "bedroom, bed room, guest room, guest bedroom, master bedroom, sleeping room, main bedroom",
        "living room, lounge, sitting room, family room, livingroom, parlour, parlor, front room",
        "office, workroom, work room, home office, working room, office room",
        "hallway, hall, corridor, passage, aisle, landing",
        "dining room, dining area, diner, diningroom",
        "kids room, kid's room, kids' room, children's room, childrens room, child's room, nursery, playroom",
        "laundry room, laundry, utility room, wash house",
        "study, library, reading room, study room",
        "garage, carport",
        "balcony, terrace, patio, veranda, deck",
        "storage room, storeroom, store room, storage, closet room, box room, pantry, larder",
        "entrance, entry, entryway, foyer, vestibule, lobby, entrance hall, reception, entrance area",
    )
)
# Places that no list of things hints at; said back where a site has none of them.
_OTHER = (
    "attic, backyard, ballroom, basement, break room, cafeteria, canteen, cellar, chapel, classroom, "
    "conference room, conservatory, courtyard, dressing room, driveway, elevator lobby, garden, gym, lab, "
    "laboratory, loft, meeting room, porch, roof, sauna, server room, shed, shop floor, staircase, "
    "stairwell, sunroom, waiting room, warehouse, wine cellar, workshop, yard "
)
OTHER_PLACES = frozenset(name.strip() for name in _OTHER.split(","))
# Where the one who asks stands: the room around them.
HERE = frozenset(("here", "over here", "right here", "this room", "the room"))
_NAMES = frozenset(name for row in PLACES for name in row) | OTHER_PLACES
# All of the map: said of a thing it tells nothing.
EVERYWHERE = frozenset(
    ("house", "flat", "apartment", "building", "home", "whole house", "whole flat", "whole apartment", "whole building")
)
_ENDINGS = ("room", "area", "hall", "corridor", "lobby", "department", "floor", "zone", "wing", "aisle")


def is_place(words: str) -> bool:
    """Whether words name a kind of room; a site may still give a room any other name."""
    if " or " in words:
        return all(map(is_place, words.split(" or ")))
    parts = words.split()
    return words in _NAMES or (len(parts) > 1 and parts[-1] in _ENDINGS)


def is_named_place(words: str) -> bool:
    """Whether words by themselves ask for a room: "the kitchen", "meeting room"; an area or a floor is none."""
    return words in _NAMES or (words.endswith(" room") and len(words.split()) == 2)


def kind_of_place(words: str) -> str | None:
    """The name that stands for all of its kind: "corridor" is a "hallway"; None where it is of no kind known here."""
    return next((row[0] for row in PLACES if words in row), None)
