# ruff: noqa: E501  (one line a shape reads as the table it is)
"""Built-in furniture as data: each shape is a list of parts in fractions of the object's size.

x and y run from -0.5 to 0.5 (width and depth; the front looks along -y), z from 0 (floor) to 1 (top).
A part's tint is "main" (the object's colour), "dark" or "light" (shades of it), or a colour of the palette.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from openbelief.arrays import Array
from sim_fakes.world.mesh import Mesh, lathe, merge
from sim_fakes.world.mesh import box as box_mesh

PALETTE = {
    "red": (0.74, 0.09, 0.08), "orange": (0.90, 0.46, 0.13), "yellow": (0.91, 0.76, 0.24), "green": (0.27, 0.50, 0.26),
    "teal": (0.18, 0.47, 0.48), "blue": (0.20, 0.36, 0.62), "purple": (0.42, 0.28, 0.52), "pink": (0.86, 0.58, 0.62),
    "brown": (0.45, 0.30, 0.19), "wood": (0.66, 0.47, 0.29), "beige": (0.82, 0.74, 0.61), "white": (0.92, 0.91, 0.88),
    "grey": (0.55, 0.56, 0.58), "silver": (0.75, 0.77, 0.79), "black": (0.09, 0.09, 0.10), "terracotta": (0.70, 0.38, 0.25),
}  # fmt: skip
SHADES = {"main": 1.0, "dark": 0.62, "light": 1.25}


@dataclass(frozen=True)
class ShapePart:
    """One solid. low, high: its (x, y, z) box in fractions. kind: box, or a body of revolution with `profile`,
    rows of (radius, height), both in fractions of the part's own box."""

    low: tuple[float, float, float]
    high: tuple[float, float, float]
    tint: str
    material: str
    profile: tuple[tuple[float, float], ...] | None = None

    def mesh(self, size: Array, colour: Array) -> Mesh:
        low, high = np.array(self.low) * size, np.array(self.high) * size
        rgb = np.clip(colour * SHADES[self.tint], 0, 1) if self.tint in SHADES else np.array(PALETTE[self.tint])
        if self.profile is None:
            return box_mesh(low, high, rgb, self.material)
        radius, height = np.array(self.profile).T
        half = (high - low)[:2] / 2
        rows = np.column_stack((radius * half[0], radius * half[1], low[2] + height * (high - low)[2]))
        return lathe((low + high)[:2] / 2, rows, rgb, self.material)


def box(
    x0: float, x1: float, y0: float, y1: float, z0: float, z1: float, tint: str = "main", material: str = "plain"
) -> ShapePart:
    return ShapePart((x0, y0, z0), (x1, y1, z1), tint, material)


def tube(
    x: float,
    y: float,
    z0: float,
    z1: float,
    bottom: float,
    top: float | None = None,
    tint: str = "main",
    material: str = "plain",
) -> ShapePart:
    """A cylinder or cone; `bottom` and `top` are radii in fractions of the size."""
    top = bottom if top is None else top
    widest = max(bottom, top)
    profile = ((0, 0), (bottom / widest, 0), (top / widest, 1), (0, 1))
    return ShapePart((x - widest, y - widest, z0), (x + widest, y + widest, z1), tint, material, profile)


def ball(
    x: float, y: float, z: float, rx: float, ry: float, rz: float, tint: str = "main", material: str = "plain"
) -> ShapePart:
    angles = np.linspace(-np.pi / 2, np.pi / 2, 11)
    profile = tuple((float(np.cos(a)), float((np.sin(a) + 1) / 2)) for a in angles)
    return ShapePart((x - rx, y - ry, z - rz), (x + rx, y + ry, z + rz), tint, material, profile)


def legs(inset: float, top: float, thick: float, tint: str) -> list[ShapePart]:
    """Four legs at the corners."""
    return [
        box(sx * inset - thick, sx * inset + thick, sy * inset - thick, sy * inset + thick, 0, top, tint, "wood")
        for sx in (-1, 1)
        for sy in (-1, 1)
    ]


def grid_of(rows: int, tints: tuple[str, ...]) -> list[ShapePart]:
    """Rows of books between shelves."""
    height = 1 / rows
    return [
        box(-0.44 + 0.11 * k, -0.345 + 0.11 * k, -0.30, 0.40, r * height + 0.03, (r + 0.62 + 0.05 * ((k * 3 + r) % 4)) * height,
            tints[(k * 5 + r * 3) % len(tints)], "books")
        for r in range(rows) for k in range(8) if (k + 2 * r) % 7
    ]  # fmt: skip


SHAPES: dict[str, list[ShapePart]] = {
    "box": [box(-0.5, 0.5, -0.5, 0.5, 0, 1)],
    "cylinder": [tube(0, 0, 0, 1, 0.5)],
    "sphere": [ball(0, 0, 0.5, 0.5, 0.5, 0.5)],
    "table": [box(-0.5, 0.5, -0.5, 0.5, 0.94, 1, "main", "wood"), box(-0.44, 0.44, -0.44, 0.44, 0.86, 0.94, "dark"), *legs(0.45, 0.94, 0.03, "dark")],
    "round_table": [tube(0, 0, 0.93, 1, 0.5, None, "main", "wood"), tube(0, 0, 0.05, 0.93, 0.06, None, "dark"), tube(0, 0, 0, 0.05, 0.28, 0.2, "dark")],
    "desk": [
        box(-0.5, 0.5, -0.5, 0.5, 0.95, 1, "main", "wood"), box(-0.48, -0.45, -0.45, 0.48, 0, 0.95, "dark"),
        box(0.18, 0.48, -0.42, 0.48, 0.05, 0.95, "light", "wood"), *[box(0.2, 0.46, -0.44, -0.42, z, z + 0.24, "main", "wood") for z in (0.1, 0.39, 0.68)],
    ],
    "chair": [box(-0.45, 0.45, -0.45, 0.45, 0.47, 0.53), box(-0.45, 0.45, 0.38, 0.46, 0.62, 1), *legs(0.4, 0.5, 0.05, "wood"), box(-0.45, -0.36, 0.38, 0.46, 0.5, 0.7, "wood"), box(0.36, 0.45, 0.38, 0.46, 0.5, 0.7, "wood")],
    "office_chair": [
        box(-0.38, 0.38, -0.38, 0.36, 0.43, 0.52, "main", "fabric"), box(-0.34, 0.34, 0.32, 0.42, 0.58, 1, "main", "fabric"), tube(0, 0, 0.08, 0.43, 0.05, None, "silver"),
        box(-0.48, 0.48, -0.05, 0.05, 0.03, 0.09, "black"), box(-0.05, 0.05, -0.48, 0.48, 0.03, 0.09, "black"), box(-0.06, 0.06, 0.36, 0.42, 0.45, 0.6, "black"),
        *[ball(x, y, 0.03, 0.06, 0.06, 0.03, "black") for x, y in ((-0.44, 0), (0.44, 0), (0, -0.44), (0, 0.44))],
    ],
    "stool": [tube(0, 0, 0.9, 1, 0.48), *legs(0.3, 0.92, 0.05, "wood")],
    "armchair": [
        box(-0.5, 0.5, -0.45, 0.5, 0.08, 0.42, "main", "fabric"), box(-0.32, 0.32, -0.48, 0.3, 0.42, 0.55, "light", "fabric"), box(-0.5, 0.5, 0.28, 0.5, 0.42, 1, "main", "fabric"),
        box(-0.5, -0.33, -0.45, 0.3, 0.42, 0.68, "main", "fabric"), box(0.33, 0.5, -0.45, 0.3, 0.42, 0.68, "main", "fabric"), *legs(0.42, 0.1, 0.03, "wood"),
    ],
    "sofa": [
        box(-0.5, 0.5, -0.45, 0.5, 0.08, 0.42, "main", "fabric"), box(-0.41, -0.01, -0.48, 0.28, 0.42, 0.54, "light", "fabric"), box(0.01, 0.41, -0.48, 0.28, 0.42, 0.54, "light", "fabric"),
        box(-0.5, 0.5, 0.26, 0.5, 0.42, 1, "main", "fabric"), box(-0.5, -0.42, -0.45, 0.3, 0.42, 0.66, "main", "fabric"), box(0.42, 0.5, -0.45, 0.3, 0.42, 0.66, "main", "fabric"), *legs(0.46, 0.09, 0.012, "wood"),
    ],
    "bed": [
        box(-0.5, 0.5, -0.5, 0.5, 0.08, 0.42, "wood", "wood"), box(-0.48, 0.48, -0.48, 0.46, 0.42, 0.72, "white", "fabric"), box(-0.5, 0.5, -0.5, 0.18, 0.5, 0.77, "main", "fabric"),
        box(-0.5, 0.5, 0.46, 0.5, 0.08, 1, "wood", "wood"), box(-0.42, -0.06, 0.22, 0.44, 0.72, 0.88, "white", "fabric"), box(0.06, 0.42, 0.22, 0.44, 0.72, 0.88, "white", "fabric"),
    ],
    "shelf": [
        box(-0.5, -0.46, -0.5, 0.5, 0, 1, "main", "wood"), box(0.46, 0.5, -0.5, 0.5, 0, 1, "main", "wood"), box(-0.5, 0.5, 0.42, 0.5, 0, 1, "dark", "wood"),
        *[box(-0.47, 0.47, -0.48, 0.45, z - 0.01, z + 0.02, "main", "wood") for z in (0.01, 0.25, 0.5, 0.75, 0.98)], *grid_of(4, ("red", "blue", "beige", "teal", "brown", "white", "black", "orange")),
    ],
    "cabinet": [
        box(-0.5, 0.5, -0.46, 0.5, 0.06, 1, "main", "wood"), box(-0.47, 0.47, -0.42, 0.5, 0, 0.06, "black"), box(-0.48, -0.01, -0.5, -0.46, 0.1, 0.97, "light", "wood"),
        box(0.01, 0.48, -0.5, -0.46, 0.1, 0.97, "light", "wood"), box(-0.06, -0.03, -0.53, -0.5, 0.45, 0.62, "silver"), box(0.03, 0.06, -0.53, -0.5, 0.45, 0.62, "silver"),
    ],
    "drawers": [box(-0.5, 0.5, -0.46, 0.5, 0.04, 1, "main", "wood"), *[box(-0.47, 0.47, -0.5, -0.46, z, z + 0.27, "light", "wood") for z in (0.08, 0.39, 0.7)], *[box(-0.1, 0.1, -0.54, -0.5, z, z + 0.03, "black") for z in (0.2, 0.51, 0.82)]],
    "fridge": [box(-0.5, 0.5, -0.44, 0.5, 0.02, 1), box(-0.49, 0.49, -0.5, -0.45, 0.04, 0.6, "light"), box(-0.49, 0.49, -0.5, -0.45, 0.62, 0.99, "light"), box(-0.42, -0.38, -0.56, -0.5, 0.3, 0.57, "grey"), box(-0.42, -0.38, -0.56, -0.5, 0.65, 0.85, "grey")],
    "stove": [
        box(-0.5, 0.5, -0.46, 0.5, 0.02, 0.97), box(-0.5, 0.5, -0.48, 0.5, 0.97, 1, "black"), box(-0.42, 0.42, -0.49, -0.46, 0.15, 0.68, "black"), box(-0.4, 0.4, -0.54, -0.51, 0.71, 0.75, "silver"),
        *[tube(x, y, 1, 1.01, 0.17, None, "grey") for x in (-0.23, 0.23) for y in (-0.2, 0.24)], *[ball(x, -0.49, 0.86, 0.035, 0.03, 0.025, "silver") for x in (-0.3, -0.1, 0.1, 0.3)],
    ],
    "washer": [box(-0.5, 0.5, -0.47, 0.5, 0, 1), box(-0.48, 0.48, -0.5, -0.47, 0.84, 0.98, "light"), ball(0, -0.46, 0.44, 0.33, 0.05, 0.25, "grey"), ball(0, -0.48, 0.44, 0.25, 0.05, 0.19, "black"), box(-0.45, -0.15, -0.51, -0.5, 0.88, 0.95, "grey")],
    "sink": [box(-0.5, 0.5, -0.5, 0.5, 0, 0.86, "wood", "wood"), box(-0.5, 0.5, -0.5, 0.5, 0.86, 0.9, "white"), box(-0.4, 0.4, -0.42, 0.25, 0.9, 0.905, "silver"), tube(0, 0.35, 0.9, 1, 0.04, None, "silver"), box(-0.04, 0.04, 0.1, 0.38, 0.98, 1, "silver")],
    "toilet": [box(-0.45, 0.45, 0.2, 0.5, 0.45, 1), tube(0, -0.12, 0, 0.42, 0.24, 0.3), ball(0, -0.14, 0.44, 0.46, 0.36, 0.1), tube(0, -0.14, 0.5, 0.53, 0.42, None, "light"), box(-0.08, 0.08, 0.3, 0.4, 1, 1.01, "silver")],
    "bathtub": [box(-0.5, 0.5, -0.5, 0.5, 0, 0.5), box(-0.5, -0.42, -0.5, 0.5, 0.5, 1), box(0.42, 0.5, -0.5, 0.5, 0.5, 1), box(-0.42, 0.42, -0.5, -0.4, 0.5, 1), box(-0.42, 0.42, 0.4, 0.5, 0.5, 1), box(-0.42, 0.42, -0.4, 0.4, 0.5, 0.52, "teal")],
    "lamp": [tube(0, 0, 0, 0.025, 0.42, None, "black"), tube(0, 0, 0.02, 0.76, 0.045, None, "black"), tube(0, 0, 0.72, 1, 0.5, 0.32)],
    "plant": [
        tube(0, 0, 0, 0.3, 0.2, 0.29, "terracotta"), tube(0, 0, 0.3, 0.31, 0.26, None, "brown"), tube(0, 0, 0.3, 0.6, 0.025, None, "brown"),
        *[ball(x, y, z, 0.2, 0.2, 0.1, t, "leaf") for x, y, z, t in ((0, 0, 0.86, "main"), (0.25, 0.1, 0.66, "main"), (-0.22, 0.16, 0.7, "dark"), (0.05, -0.28, 0.62, "main"), (-0.26, -0.14, 0.52, "dark"), (0.22, -0.2, 0.48, "main"), (0.02, 0.28, 0.52, "dark"))],
    ],
    "cactus": [tube(0, 0, 0, 0.3, 0.3, 0.42, "terracotta"), tube(0, 0, 0.28, 0.85, 0.2), ball(0, 0, 0.85, 0.2, 0.2, 0.15), ball(0.28, 0, 0.6, 0.1, 0.1, 0.16), ball(-0.26, 0, 0.52, 0.1, 0.1, 0.13)],
    "extinguisher": [
        tube(0, 0, 0, 0.72, 0.42), ball(0, 0, 0.72, 0.42, 0.42, 0.1), tube(0, 0, 0.78, 0.88, 0.13, None, "black"), box(-0.12, 0.42, -0.08, 0.08, 0.88, 0.92, "black"), box(-0.12, 0.36, -0.07, 0.07, 0.96, 1, "black"),
        tube(0.44, 0, 0.25, 0.86, 0.05, None, "black"), tube(0, 0, 0.3, 0.5, 0.425, None, "white"), tube(0, 0, 0.02, 0.05, 0.43, None, "black"), ball(-0.15, -0.1, 0.85, 0.08, 0.08, 0.035, "silver"),
    ],
    "gas_bottle": [tube(0, 0, 0.04, 0.7, 0.5), ball(0, 0, 0.7, 0.5, 0.5, 0.14), tube(0, 0, 0, 0.05, 0.4, None, "dark"), tube(0, 0, 0.82, 1, 0.3, None, "dark"), tube(0, 0, 0.8, 0.95, 0.08, None, "silver")],
    "umbrella_stand": [
        tube(0, 0, 0, 0.62, 0.42), tube(0, 0, 0.62, 0.65, 0.45, None, "dark"), tube(0, 0, 0.65, 0.652, 0.38, None, "black"), tube(0, 0, 0, 0.03, 0.46, None, "dark"),
        tube(0.15, 0.08, 0.5, 0.95, 0.07, 0.03, "blue", "fabric"), tube(-0.14, 0.1, 0.5, 0.9, 0.07, 0.03, "black", "fabric"), ball(0.15, 0.08, 0.97, 0.05, 0.05, 0.03, "wood"), ball(-0.14, 0.1, 0.93, 0.05, 0.05, 0.03, "brown"),
    ],
    "vacuum": [ball(0, 0, 0.42, 0.45, 0.38, 0.4), tube(-0.3, 0.42, 0, 0.4, 0.1, None, "black"), tube(-0.3, -0.42, 0, 0.4, 0.1, None, "black"), tube(0.3, 0, 0.1, 1, 0.06, None, "black"), box(0.15, 0.5, -0.3, 0.3, 0, 0.12, "black")],
    "bin": [tube(0, 0, 0, 0.9, 0.36, 0.48), tube(0, 0, 0.9, 0.94, 0.5, None, "dark"), ball(0, 0, 0.94, 0.47, 0.47, 0.06, "light")],
    "basket": [tube(0, 0, 0, 0.95, 0.4, 0.5, "main", "fabric"), tube(0, 0, 0.95, 1, 0.5, None, "dark", "fabric"), ball(0.05, 0, 0.98, 0.38, 0.36, 0.1, "white", "fabric"), ball(-0.15, 0.1, 1, 0.2, 0.2, 0.08, "blue", "fabric")],
    "bucket": [tube(0, 0, 0, 0.95, 0.36, 0.49), tube(0, 0, 0.95, 1, 0.5, None, "dark"), tube(0, 0, 0.97, 1.004, 0.44, None, "black")],
    "bottle": [tube(0, 0, 0, 0.6, 0.45), tube(0, 0, 0.6, 0.78, 0.45, 0.16), tube(0, 0, 0.78, 0.95, 0.16), tube(0, 0, 0.95, 1, 0.19, None, "white"), tube(0, 0, 0.2, 0.45, 0.455, None, "white")],
    "crate": [box(-0.5, 0.5, -0.5, 0.5, 0, 0.06), *[box(s * 0.47 - 0.03, s * 0.47 + 0.03, -0.5, 0.5, 0, 1, "main") for s in (-1, 1)], *[box(-0.5, 0.5, s * 0.46 - 0.04, s * 0.46 + 0.04, 0, 1, "dark") for s in (-1, 1)], *[ball(x, y, 0.75, 0.14, 0.2, 0.25, "white") for x in (-0.28, 0, 0.28) for y in (-0.2, 0.2)]],
    "carton": [box(-0.5, 0.5, -0.5, 0.5, 0, 1), box(-0.5, 0.5, -0.06, 0.06, 1, 1.005, "beige"), box(-0.06, 0.06, -0.505, 0.505, 0.75, 1.004, "beige")],
    "toolbox": [box(-0.5, 0.5, -0.5, 0.5, 0, 0.62), box(-0.5, 0.5, -0.5, 0.5, 0.62, 0.8, "dark"), box(-0.3, 0.3, -0.08, 0.08, 0.92, 1, "black"), box(-0.3, -0.22, -0.08, 0.08, 0.8, 0.95, "black"), box(0.22, 0.3, -0.08, 0.08, 0.8, 0.95, "black"), box(-0.34, -0.24, -0.54, -0.5, 0.5, 0.7, "silver"), box(0.24, 0.34, -0.54, -0.5, 0.5, 0.7, "silver")],
    "first_aid_kit": [box(-0.5, 0.5, -0.5, 0.5, 0, 0.9), box(-0.06, 0.06, -0.3, 0.3, 0.9, 0.91, "red"), box(-0.2, 0.2, -0.09, 0.09, 0.9, 0.911, "red"), box(-0.05, 0.05, -0.52, -0.5, 0.2, 0.75, "red"), box(-0.17, 0.17, -0.521, -0.5, 0.37, 0.58, "red"), box(-0.2, 0.2, 0.1, 0.2, 0.9, 1, "black")],
    "suitcase": [box(-0.5, 0.5, -0.45, 0.45, 0.08, 0.9, "main", "fabric"), box(-0.44, 0.44, -0.5, -0.45, 0.14, 0.84, "dark", "fabric"), box(-0.2, -0.16, 0.3, 0.42, 0.9, 1, "silver"), box(0.16, 0.2, 0.3, 0.42, 0.9, 1, "silver"), box(-0.22, 0.22, 0.28, 0.44, 0.97, 1, "black"), *[tube(x, 0, 0, 0.1, 0.07, None, "black") for x in (-0.38, 0.38)]],
    "speaker": [box(-0.5, 0.5, -0.46, 0.5, 0, 1), box(-0.46, 0.46, -0.5, -0.46, 0.03, 0.97, "dark", "fabric"), ball(0, -0.5, 0.32, 0.34, 0.06, 0.2, "black"), ball(0, -0.5, 0.74, 0.2, 0.05, 0.1, "silver")],
    "backpack": [ball(0, 0, 0.45, 0.5, 0.4, 0.45, "main", "fabric"), ball(0, -0.34, 0.32, 0.34, 0.2, 0.26, "dark", "fabric"), box(-0.3, -0.2, 0.3, 0.42, 0.2, 0.85, "black"), box(0.2, 0.3, 0.3, 0.42, 0.2, 0.85, "black"), box(-0.08, 0.08, 0.1, 0.2, 0.88, 1, "black")],
    "rug": [box(-0.5, 0.5, -0.5, 0.5, 0, 1, "main", "rug")],
    "cushion": [ball(0, 0, 0.5, 0.5, 0.5, 0.5, "main", "fabric")],
    "pet_bed": [tube(0, 0, 0, 0.5, 0.48, 0.5, "main", "fabric"), tube(0, 0, 0.5, 1, 0.5, 0.42, "main", "fabric"), ball(0, 0, 0.9, 0.34, 0.34, 0.2, "white", "fabric")],
    "tv": [box(-0.5, 0.5, -0.15, 0.15, 0.12, 1, "black"), box(-0.48, 0.48, -0.2, -0.15, 0.15, 0.98, "dark"), box(-0.2, 0.2, -0.5, 0.5, 0, 0.03, "black"), box(-0.04, 0.04, -0.1, 0.1, 0, 0.15, "black")],
    "laptop": [box(-0.5, 0.5, -0.5, 0.3, 0, 0.08, "silver"), box(-0.42, 0.42, -0.2, 0.24, 0.08, 0.1, "black"), box(-0.5, 0.5, 0.3, 0.4, 0.06, 1, "silver"), box(-0.46, 0.46, 0.28, 0.3, 0.14, 0.94, "blue")],
    "shoes": [ball(s * 0.27, -0.15, 0.35, 0.19, 0.34, 0.32, "main") for s in (-1, 1)] + [ball(s * 0.27, 0.22, 0.5, 0.18, 0.26, 0.48, "dark") for s in (-1, 1)],
    "watering_can": [tube(-0.1, 0, 0, 0.75, 0.3, 0.26), tube(0.3, 0, 0.3, 0.95, 0.05, 0.05), tube(0.36, 0, 0.9, 1, 0.07, 0.13), box(-0.46, -0.38, -0.05, 0.05, 0.2, 0.9, "dark"), box(-0.46, -0.05, -0.05, 0.05, 0.84, 0.92, "dark")],
    "kettle": [tube(0, 0, 0, 0.75, 0.42, 0.32), ball(0, 0, 0.75, 0.32, 0.32, 0.12), ball(0, 0, 0.92, 0.07, 0.07, 0.07, "black"), box(0.36, 0.46, -0.06, 0.06, 0.15, 0.85, "black")],
    "scale": [box(-0.5, 0.5, -0.5, 0.5, 0, 0.9), box(-0.14, 0.14, 0.22, 0.4, 0.9, 1, "black")],
    "guitar": [ball(0, 0, 0.2, 0.5, 0.5, 0.2, "main", "wood"), ball(0, 0, 0.42, 0.38, 0.4, 0.14, "main", "wood"), box(-0.07, 0.07, -0.2, 0.2, 0.4, 0.9, "brown", "wood"), box(-0.1, 0.1, -0.2, 0.2, 0.9, 1, "black"), ball(0, -0.45, 0.38, 0.14, 0.08, 0.05, "black")],
    "fan": [tube(0, 0, 0, 0.05, 0.4, 0.36), tube(0, 0, 0.05, 0.6, 0.05, None, "silver"), ball(0, 0, 0.74, 0.5, 0.2, 0.26, "light"), ball(0, -0.15, 0.74, 0.14, 0.12, 0.07, "dark")],
    "heater": [*[box(-0.5 + 0.14 * k, -0.39 + 0.14 * k, -0.5, 0.5, 0.1, 1) for k in range(8)], box(-0.48, 0.5, -0.3, 0.3, 0, 0.1, "dark")],
}  # fmt: skip


def furniture(shape: str, size: Array, colour: Array) -> Mesh:
    """The mesh of a shape in its own frame: (3,) size in metres (width, depth, height), standing on z = 0."""
    return merge([part.mesh(np.asarray(size, float), colour) for part in SHAPES[shape]])
