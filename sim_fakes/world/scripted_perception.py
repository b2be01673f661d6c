"""What a vision-language model and a segmenter would say of a simulated view, with their errors.

Everything is drawn from (seed, frame stamp, object id): the order of calls does not matter, and neither the query nor
the mission is known here. What a thing is called follows from the scene file and from how far away it is.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache

import numpy as np

from openbelief.arrays import Array, normalize
from openbelief.observation import Mask, RgbdFrame
from openbelief.perception.ports import FrameUnseen, TextEncoder
from openbelief.perception.stages import Stage
from sim_fakes.world.mask_noise import MaskNoise, ragged_masks
from sim_fakes.world.renderer import Renderer
from sim_fakes.world.scene import SceneObject, Vocabulary
from sim_fakes.world.world import FLOOR_ID, WALL_ID, World, WorldObject

BACKGROUND = {FLOOR_ID: ("floor", "wooden floor", "tiled floor"), WALL_ID: ("wall", "white wall", "skirting board")}
BACKGROUND_SHARE = 0.25  # of the frames in which a floor or wall is named at all
COLOUR_NAMED = 0.12  # of the names that get the thing's colour in front
LABEL_COSINE = 0.30  # between a feature and the embedding of the thing's true name
SAME_KIND_COSINE = 0.6  # between the looks of two things of the same label, shape and colour
FEATURE_NOISE = 0.27  # so that two views of one thing have a cosine of about 1 - 0.27^2 = 0.93
CONFIDENCE = (0.45, 0.92)
ANOTHER_PLACE_M, ANOTHER_PLACE_SHARE = 0.5, 0.5  # depth further off than any pose error, in most of the picture
RANGE_MAX_M = 5.0  # nothing further away is named


class ScriptedPerception:
    """The Perception port over a world. `id` names the scene's hash and the seed."""

    feature_text_aligned = True

    def __init__(
        self, world: World, text_encoder: TextEncoder, *, seed: int = 0, renderer: Renderer | None = None
    ) -> None:
        self._world, self._encoder, self._seed = world, text_encoder, seed
        self._renderer = renderer or Renderer(world)
        self._noise = MaskNoise(missed=world.scene.missed)
        self._look = lru_cache(maxsize=None)(self._appearance)

    @property
    def id(self) -> str:
        return f"scripted:{self._world.name}@{self._world.hash}:seed={self._seed}:{self._encoder.id}"

    @property
    def stages(self) -> tuple[Stage, ...]:
        """One, so that mapping decodes and back-projects other frames meanwhile."""
        return (Stage("masks", lambda frame, _: self.perceive(frame)),)

    def close(self) -> None:
        """Nothing is waited for."""

    def perceive(self, frame: RgbdFrame) -> list[Mask]:
        """The masks of what the frame's camera truly sees, largest id last.

        Raises FrameUnseen where the frame measured another place than the scene shows there.
        """
        depth_m, instances = self._renderer.segment(frame.T_map_camera, frame.intrinsics)
        self._require_same_place(frame, depth_m)
        masks: list[Mask] = []
        for instance in np.unique(instances):
            silhouette = instances == instance
            rng = _generator(self._seed, frame.stamp_ns, int(instance))
            if instance in BACKGROUND:
                masks += self._background(int(instance), silhouette, len(masks), rng)
            elif instance > 0:
                range_m = _range(silhouette, depth_m, frame)
                masks += self._object(self._world.object(int(instance)), silhouette, range_m, len(masks), rng)
        return masks

    def _require_same_place(self, frame: RgbdFrame, depth_m: Array) -> None:
        measured = (frame.depth_m > 0) & (depth_m > 0)
        apart = np.abs(frame.depth_m[measured] - depth_m[measured]) > ANOTHER_PLACE_M
        if apart.size and apart.mean() > ANOTHER_PLACE_SHARE:
            raise FrameUnseen(f"the recording shows another place than the scene {self._world.name}")

    def _object(
        self, thing: WorldObject, silhouette: Array, range_m: float, first: int, rng: np.random.Generator
    ) -> list[Mask]:
        if range_m > RANGE_MAX_M:
            return []
        scene = self._world.scene
        far = float(np.clip((range_m - scene.near_m) / max(scene.far_m - scene.near_m, 1e-6), 0, 1))
        kind = scene.vocabulary.get(thing.label, Vocabulary())
        return [
            Mask(
                first + i,
                pixels,
                phrase(thing.spec, kind, far, rng),
                _confidence(pixels, rng),
                self._feature(thing, rng),
            )
            for i, pixels in enumerate(ragged_masks(silhouette, self._noise, rng))
        ]

    def _background(self, instance: int, silhouette: Array, first: int, rng: np.random.Generator) -> list[Mask]:
        if rng.random() > BACKGROUND_SHARE:
            return []
        name = str(rng.choice(BACKGROUND[instance]))
        look = self._direction(name, key=f"background {instance}")
        return [
            Mask(first + i, pixels, name, _confidence(pixels, rng), _viewed(look, rng))
            for i, pixels in enumerate(ragged_masks(silhouette, self._noise, rng)[:1])
        ]

    def _feature(self, thing: WorldObject, rng: np.random.Generator) -> Array:
        return _viewed(self._look(thing.id), rng)

    def _appearance(self, object_id: int) -> Array:
        """What the thing looks like from anywhere: its name's direction, its kind's, and its own."""
        spec = self._world.object(object_id).spec
        return self._direction(spec.label, key=f"{spec.shape} {spec.colour}", own=str(object_id))

    def _direction(self, label: str, key: str, own: str = "") -> Array:
        text = np.asarray(self._encoder.encode([label])[0], dtype=np.float64)
        kind, individual = (_unit(self._encoder.dim, word) for word in (f"{label} {key}", f"{label} {key} {own}"))
        rest = normalize(np.sqrt(SAME_KIND_COSINE) * kind + np.sqrt(1 - SAME_KIND_COSINE) * individual)
        rest = normalize(rest - (rest @ text) * text)
        return LABEL_COSINE * text + np.sqrt(1 - LABEL_COSINE**2) * rest


def phrase(spec: SceneObject, kind: Vocabulary, far: float, rng: np.random.Generator) -> str:
    """What one mask of a thing is called; far in [0, 1] is the chance that it is seen as from far.

    The thing's own words go before those of its kind, and where there are none it is called by its label.
    """
    seen_far = rng.random() < far
    confusion = spec.confusion or kind.confusion
    if confusion and (seen_far or confusion.seen_from == "anywhere") and rng.random() < confusion.rate:
        return confusion.phrase
    near = spec.names_near or kind.names_near or {spec.label: 1.0}
    names = (spec.names_far or kind.names_far or near) if seen_far else near
    name = _draw(names, rng)
    with_colour = rng.random() < COLOUR_NAMED and spec.colour not in name.split()
    return f"{spec.colour} {name}" if with_colour else name


def _draw(names: Mapping[str, float], rng: np.random.Generator) -> str:
    shares = np.array(list(names.values()))
    return str(rng.choice(list(names), p=shares / shares.sum()))


def _generator(seed: int, stamp_ns: int, instance: int) -> np.random.Generator:
    return np.random.default_rng([seed, stamp_ns & 0xFFFFFFFF, stamp_ns >> 32, instance, 0x0B5E])


def _unit(dim: int, words: str) -> Array:
    """A direction that follows from words alone."""
    rng = np.random.default_rng(list(words.encode()))
    return normalize(rng.standard_normal(dim))


def _viewed(look: Array, rng: np.random.Generator) -> Array:
    """(d,) float32: the look as one view gives it."""
    noise = normalize(rng.standard_normal(len(look)))
    return normalize(np.sqrt(1 - FEATURE_NOISE**2) * look + FEATURE_NOISE * noise).astype(np.float32)


def _confidence(pixels: Array, rng: np.random.Generator) -> float:
    """Bigger masks are surer, up to about 10 000 pixels."""
    low, high = CONFIDENCE
    size = min(np.count_nonzero(pixels) / 10_000, 1.0)
    return float(np.clip(low + (high - low) * (0.35 * size + 0.65 * rng.beta(3, 2)), 0.05, 0.99))


def _range(silhouette: Array, depth_m: Array, frame: RgbdFrame) -> float:
    """Metres from the camera to the middle of what is seen of a thing."""
    v, u = np.nonzero(silhouette)
    z = float(np.median(depth_m[silhouette]))
    ray = frame.intrinsics.rays(np.array([np.median(u)]), np.array([np.median(v)]))[0]
    return z * float(np.sqrt(1 + ray @ ray))
