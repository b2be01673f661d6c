"""Rooms in German, Spanish, French and Italian: "der Stuhl in der Küche" is a chair in the kitchen.

The encoder knows the nouns of things in these languages, and places a dining room nearer to a bedroom than to its own
English name. So rooms are a table, and read only behind a preposition of their own language: a bureau is a dresser
elsewhere.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable

# What stands before a room, and by English kind (request.places) what the room is called.
LANGUAGES: dict[str, tuple[str, dict[str, str]]] = {
    "German": (
        "in der, in dem, in die, in das, im, ins, in meiner, in meinem, in unserer, in unserem",
        {
            "kitchen": "küche, kochnische",
            "bathroom": "badezimmer, bad",
            "bedroom": "schlafzimmer",
            "living room": "wohnzimmer, stube",
            "office": "büro",
            "hallway": "flur, gang, korridor, diele",
            "dining room": "esszimmer, speisezimmer",
            "kids room": "kinderzimmer",
            "laundry room": "waschküche, waschraum",
            "study": "arbeitszimmer",
            "garage": "garage",
            "balcony": "balkon, terrasse",
            "storage room": "abstellraum, abstellkammer, lagerraum",
            "entrance": "eingang, eingangsbereich",
        },
    ),
    "Spanish": (
        "en la, en el, en mi, en nuestra, en nuestro",
        {
            "kitchen": "cocina",
            "bathroom": "cuarto de baño, baño, aseo",
            "bedroom": "dormitorio, habitación, recámara",
            "living room": "sala de estar, salón, sala",
            "office": "oficina, despacho",
            "hallway": "pasillo",
            "dining room": "comedor",
            "kids room": "cuarto de los niños, habitación de los niños",
            "laundry room": "lavandería, lavadero",
            "study": "estudio",
            "garage": "garaje",
            "balcony": "balcón, terraza",
            "storage room": "trastero, despensa",
            "entrance": "entrada, recibidor, vestíbulo",
        },
    ),
    "French": (
        "dans la, dans le, dans l', dans ma, dans mon, dans notre",
        {
            "kitchen": "cuisine",
            "bathroom": "salle de bains, salle de bain",
            "bedroom": "chambre à coucher, chambre",
            "living room": "salle de séjour, salon, séjour",
            "office": "bureau",
            "hallway": "couloir",
            "dining room": "salle à manger",
            "kids room": "chambre des enfants, chambre d'enfant",
            "laundry room": "buanderie",
            "garage": "garage",
            "balcony": "balcon, terrasse",
            "storage room": "débarras, cellier",
            "entrance": "entrée, vestibule",
        },
    ),
    "Italian": (
        "nella, nel, nell', nello, nella mia, nel mio, in",
        {
            "kitchen": "cucina",
            "bathroom": "bagno",
            "bedroom": "camera da letto, camera",
            "living room": "soggiorno, salotto",
            "office": "ufficio",
            "hallway": "corridoio",
            "dining room": "sala da pranzo",
            "kids room": "camera dei bambini, cameretta",
            "laundry room": "lavanderia",
            "study": "studio",
            "garage": "garage",
            "balcony": "balcone, terrazza",
            "storage room": "ripostiglio",
            "entrance": "ingresso",
        },
    ),
}
NOT = frozenset(("nicht", "no", "non", "pas"))  # right before a place: not there
_REFUSING = "kein keine keinen ohne sondern sin ni ningún ninguna sans aucun aucune senza nessun nessuna"
REFUSING = NOT | frozenset(_REFUSING.split())  # elsewhere: what is refused cannot be told here
_GOING = "geh gehe fahr fahre komm ve vete ir va vas vai vado vieni entra entre viens aller"
GOING = frozenset(_GOING.split())
PLEASE = re.compile(r"[\s,]*\b(?:bitte|por favor|s'il (?:vous|te) pla[iî]t|per favore)(?=[\s,]|$)")
UMLAUTS = str.maketrans({"ä": "ae", "ö": "oe", "ü": "ue", "ß": "ss"})


def in_english(words: str) -> str:
    """The place behind all else: "stuhl im flur neben dem tisch" -> "stuhl neben dem tisch in the hallway".

    Where something is refused in that language and it cannot be told what, the words stay as they are.
    """
    words = PLEASE.sub("", words)
    found, kinds = next(((found, kinds) for pattern, kinds in _PLACED if (found := pattern.search(words))), (None, {}))
    if found is None:
        return words
    before, place = words[: found.start()].split(), f"in the {kinds[found['room']]}"
    if before and before[-1].strip(",") in NOT:
        before, place = before[:-1], f"not {place}"
    rest = " ".join([*before, words[found.end() :]]).strip(" ,")
    if not REFUSING.isdisjoint(rest.replace(",", " ").split()):
        return words
    return place.removeprefix("in ") if not rest or rest in GOING else f"{rest} {place}"


def kind_abroad(name: str) -> str | None:
    """The English kind of a room that bears such a name."""
    return next((kinds[name] for _, kinds in _PLACED if name in kinds), None)


def _spellings(name: str) -> set[str]:
    """As it is written, without its accents, and as on a keyboard without umlauts."""
    plain = "".join(c for c in unicodedata.normalize("NFD", name) if not unicodedata.combining(c))
    return {name, plain, name.translate(UMLAUTS)}


def _pattern(before: str, rooms: dict[str, str]) -> tuple[re.Pattern[str], dict[str, str]]:
    """What finds a place, and the kind of each name. "im bad at this" is English."""
    kinds = {spelt: kind for kind, names in rooms.items() for name in names.split(", ") for spelt in _spellings(name)}
    where, room = (_longest_first(words) for words in (before.split(", "), kinds))
    return re.compile(rf"(?:^(?!im bad\b)|(?<=\s))(?:{where})(?:(?<=')|\s+)(?P<room>{room})(?=[\s,]|$)"), kinds


def _longest_first(words: Iterable[str]) -> str:
    return "|".join(sorted(map(re.escape, words), key=len, reverse=True))


_PLACED = tuple(_pattern(before, rooms) for before, rooms in LANGUAGES.values())
