"""What a scene file may say (`openbelief.scene/1`): checked here once; errors name object and field."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from openbelief.documents import from_json
from sim_fakes.world.furniture import PALETTE, SHAPES
from sim_fakes.world.mask_noise import MaskNoise

FORMAT = "openbelief.scene/1"
SCENES = Path(__file__).parent / "scenes"

Number = Annotated[float, Field(allow_inf_nan=False, ge=-1000, le=1000)]
Length = Annotated[float, Field(allow_inf_nan=False, gt=0, le=100)]
Share = Annotated[float, Field(ge=0, le=1)]
Phrase = Annotated[str, Field(min_length=1, max_length=60)]
Names = Annotated[dict[Phrase, Annotated[float, Field(gt=0, le=1)]], Field(min_length=1)]
Point = tuple[Number, Number]


class SceneError(ValueError):
    """The scene file cannot be used; one line naming file, object and field."""


class SceneModel(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=False)


class SceneRoom(SceneModel):
    """polygon: corners counter-clockwise, metres. floor: its texture."""

    name: str
    polygon: Annotated[list[Point], Field(min_length=3)]
    floor: Literal["planks", "parquet", "tiles", "carpet"] = "planks"
    wall: str = "white"


class Door(SceneModel):
    """An opening in every wall that passes through `at`."""

    at: Point
    width: Length


class Confusion(SceneModel):
    """A wrong name that this object gets in `rate` of its masks: seen from far, or from anywhere."""

    phrase: Phrase
    rate: Share
    seen_from: Literal["far", "anywhere"] = "far"


class Vocabulary(SceneModel):
    """What a vision-language model calls a thing, with probabilities; what is left to 1 goes to the first name."""

    names_near: Names | None = None
    names_far: Names | None = None
    confusion: Confusion | None = None


class SceneObject(Vocabulary):
    """One thing. Either `shape` with `size` (width, depth, height) or `mesh`, an OBJ file beside the scene."""

    id: Annotated[int, Field(ge=100)]  # ids below 100 are floors and walls
    label: Phrase
    shape: str | None = None
    mesh: str | None = None
    position: Annotated[list[Number], Field(min_length=2, max_length=3)]  # of its middle on the floor, or at z
    yaw_deg: Number = 0.0
    size: tuple[Length, Length, Length] | None = None
    colour: str

    @model_validator(mode="after")
    def _one_body(self) -> SceneObject:
        if (self.shape is None) == (self.mesh is None):
            raise ValueError("field 'shape': give either 'shape' or 'mesh', not both and not neither")
        if self.shape is not None and self.shape not in SHAPES:
            raise ValueError(f"field 'shape': unknown shape {self.shape!r}; known are {', '.join(sorted(SHAPES))}")
        if self.shape is not None and self.size is None:
            raise ValueError("field 'size': a built-in shape needs [width, depth, height] in metres")
        if self.mesh is not None and self.size is not None:
            raise ValueError("field 'size': a mesh comes in metres and takes no size")
        if self.colour not in PALETTE:
            raise ValueError(f"field 'colour': unknown colour {self.colour!r}; known are {', '.join(sorted(PALETTE))}")
        return self


class SceneQuery(SceneModel):
    """A question for `openbelief eval retrieval` and the ids that answer it."""

    query: str
    kind: str
    accept: list[int]


class Scene(SceneModel):
    """The whole file. start, walk: [x, y, yaw_deg]; the walk's straight lines lead from one to the next."""

    format: Literal["openbelief.scene/1"]
    name: str
    near_m: Length = 1.6  # nearer than this the camera sees enough to name a thing rightly
    far_m: Length = 1.9  # beyond this it is called by its far names; in between the chance grows linearly
    missed: Share = MaskNoise.missed  # of the things in a frame, by the segmenter
    start: tuple[Number, Number, Number]
    walk: Annotated[list[tuple[Number, Number, Number]], Field(min_length=1)]
    rooms: Annotated[list[SceneRoom], Field(min_length=1)]
    doors: list[Door] = []
    vocabulary: dict[Phrase, Vocabulary] = {}
    objects: Annotated[list[SceneObject], Field(min_length=1)]
    queries: list[SceneQuery] = []

    @model_validator(mode="after")
    def _whole(self) -> Scene:
        ids = [o.id for o in self.objects]
        for o in self.objects:
            if ids.count(o.id) > 1:
                raise ValueError(f"object {o.id} ({o.label}): field 'id': used by {ids.count(o.id)} objects")
        for room in self.rooms:
            if room.wall not in PALETTE:
                raise ValueError(f"room {room.name}: field 'wall': unknown colour {room.wall!r}")
        for query in self.queries:
            if unknown := [i for i in query.accept if i not in ids]:
                raise ValueError(f"query {query.query!r}: field 'accept': there is no object {unknown[0]}")
        if self.far_m < self.near_m:
            raise ValueError("field 'far_m': must not be less than 'near_m'")
        return self


def read_scene(path: Path) -> tuple[Scene, str]:
    """The scene and the hash of its bytes. Raises SceneError."""
    try:
        data = path.read_bytes()
        raw = from_json(data, object_pairs_hook=_no_duplicates)
        return Scene.model_validate(raw), hashlib.sha256(data).hexdigest()[:16]
    except OSError as error:
        raise SceneError(f"Scene {path}: {error.strerror}.") from error
    except ValidationError as error:
        raise SceneError(f"Scene {path.name}: {_first_error(error, raw)}.") from error
    except ValueError as error:
        raise SceneError(f"Scene {path.name} is not a JSON scene: {error}.") from error


def _no_duplicates(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    keys = [key for key, _ in pairs]
    if repeated := [key for key in keys if keys.count(key) > 1]:
        raise ValueError(f"key {repeated[0]!r} appears twice in one object")
    return dict(pairs)


def _first_error(error: ValidationError, raw: Any) -> str:
    """`object 12 (chair): field 'size': ...` of pydantic's first complaint."""
    first = error.errors()[0]
    location, message = list(first["loc"]), first["msg"].removeprefix("Value error, ")
    if first["type"] == "extra_forbidden":
        message = "unknown key"
    thing = ""
    if location[:1] == ["objects"] and len(location) > 1:
        entry = raw["objects"][location[1]]
        known = isinstance(entry, dict)
        thing = f"object {entry.get('id', '?')} ({entry.get('label', '?')}): " if known else f"objects[{location[1]}]: "
        location = location[2:]
    field = ".".join(str(part) for part in location)
    return thing + (f"field '{field}': " if field else "") + message[:1].lower() + message[1:]
