"""Shop fronts: display windows and doors in a unit box, fascias, signs and awnings.

Windows and doors are as in `window_shapes`. The others stand before a wall at x = 0 and face +x;
their width lies along y.
"""

from collections.abc import Mapping
from itertools import pairwise

import numpy as np

from envgen_usd.assets.asset_design import Model, Part
from envgen_usd.assets.polygon_mesh import Mesh, merge
from envgen_usd.assets.shapes.simple_solids import box, flat
from envgen_usd.assets.shapes.window_shapes import (
    LAP,
    Box,
    frame_boxes,
    in_unit_box,
    pane,
    solid_part,
)

_RISER: list[Box] = [
    ((0.0, 0.0, -0.19), (1.0, 0.1, 0.0)),
]
_FIELDS: list[tuple[Box, tuple[float, float]]] = [
    (((a, 0.1 - LAP, -0.16), (a + 0.28, 0.12, -0.035)), (0.02, 0.025)) for a in (0.04, 0.36, 0.68)
]
_SHELF: list[Box] = [((-0.01, 0.0, -0.02), (1.01, 0.15, 0.008))]


def _uprights(*places: float, half: float = 0.011, high: float = 0.98) -> list[Box]:
    return [((x - half, 0.0, 0.01), (x + half, 0.07, high)) for x in places]


def _rail(z: float, half: float = 0.014) -> list[Box]:
    return [((0.01, 0.0, z - half), (0.99, 0.066, z + half))]


_DISPLAYS: Mapping[str, list[Box]] = {
    "plain": [*frame_boxes(0.02, 0.025, 0.08), *_uprights(0.5), *_SHELF],
    "panelled": [
        *frame_boxes(0.03, 0.03, 0.09), *_uprights(1 / 3, 2 / 3), *_rail(0.8), *_RISER, *_SHELF
    ],
    "small_paned": [
        *frame_boxes(0.025, 0.03, 0.08),
        *_uprights(*np.linspace(0.0, 1.0, 6)[1:-1].tolist(), half=0.007),
        *_rail(0.27, 0.009), *_rail(0.51, 0.009), *_rail(0.75, 0.009), *_RISER,
    ],
    "transom": [*frame_boxes(0.02, 0.025, 0.08), *_uprights(0.32), *_rail(0.77, 0.02), *_SHELF],
}  # fmt: skip


def displays() -> dict[str, Model]:
    """Display windows by their design."""
    models = {}
    for name, boxes in _DISPLAYS.items():
        fields = _FIELDS if _RISER[0] in boxes else []
        parts = (
            *solid_part("Frame", boxes, "paint_black", "window_frame", fields),
            Part("Pane", pane((0.015, 0.02), (0.985, 0.98)), "glass_shop", "window_pane"),
        )
        models[name] = in_unit_box(parts)
    return models


def shop_door() -> Model:
    """A glazed door with a fanlight, a kicking plate and a long handle."""
    frame = [*frame_boxes(0.05, 0.02, 0.08), ((0.045, 0.0, 0.8), (0.955, 0.07, 0.83))]
    leaf: list[Box] = [
        ((0.05, 0.0, 0.01), (0.14, 0.05, 0.8)),
        ((0.86, 0.0, 0.01), (0.95, 0.05, 0.8)),
        ((0.13, 0.0, 0.01), (0.87, 0.048, 0.11)),
        ((0.13, 0.0, 0.755), (0.87, 0.048, 0.8)),
    ]
    handle: list[Box] = [((0.885, 0.075, 0.3), (0.905, 0.095, 0.6))]
    handle += [((0.885, 0.04, z), (0.905, 0.08, z + 0.01)) for z in (0.32, 0.57)]
    panes = merge([pane((0.13, 0.1), (0.87, 0.76)), pane((0.05, 0.83), (0.95, 0.985))])
    parts = (
        *solid_part("Frame", frame, "paint_black", "door_frame"),
        *solid_part("Leaf", leaf, "paint_black", "door_leaf"),
        *solid_part("Handle", handle, "metal_galvanised", "door_handle"),
        Part("Pane", panes, "glass", "door_pane"),
    )
    return in_unit_box(parts)


def standing_part(name: str, boxes: list[Box], material: str, label: str = "body") -> Part:
    """A part of boxes that look any way."""
    return Part(name, merge([box(*each) for each in boxes]), material, label)


def fascia() -> Model:
    """The board above a shop front: a cornice over it and a bracket at each end."""
    board: list[Box] = [
        ((0.0, -1.96, 0.03), (0.09, 1.96, 0.5)),
        ((0.0, -1.96, 0.0), (0.12, 1.96, 0.03)),
    ]
    trim: list[Box] = [
        ((0.0, -2.0, 0.5), (0.2, 2.0, 0.53)),
        ((0.0, -2.0, 0.53), (0.24, 2.0, 0.56)),
        *(((0.0, y - 0.04, -0.0), (0.16, y + 0.04, 0.5)) for y in (-1.95, 1.95)),
    ]
    return Model(
        (standing_part("Board", board, "paint_green"), standing_part("Trim", trim, "paint_white"))
    )


def awning(*, striped: bool) -> Model:
    """A fabric awning on two arms, with a valance; stripes across its width."""
    edges = np.linspace(-1.5, 1.5, 13)
    strips: dict[int, list[Mesh]] = {0: [], 1: []}
    for number, (left, right) in enumerate(pairwise(edges)):
        profile = np.array([[0.0, 0.92], [0.55, 0.66], [1.25, 0.24], [1.26, 0.0]])
        for low, high in pairwise(profile[::-1]):
            corners = [(low, left), (low, right), (high, right), (high, left)]
            points = np.array([[place[0], y, place[1]] for place, y in corners])
            strips[number % 2 if striped else 0].append(flat(points, np.array([4]), np.arange(4)))
    arms = [box((0.0, y - 0.015, 0.2), (1.24, y + 0.015, 0.23)) for y in (-1.45, 1.45)]
    arms.append(box((0.0, -1.5, 0.88), (0.1, 1.5, 0.97)))
    parts = [
        Part("Fabric", merge(strips[0]), "paint_red", "body", double_sided=True),
        Part("Frame", merge(arms), "metal_galvanised", "body"),
    ]
    if striped:
        parts.append(Part("Stripes", merge(strips[1]), "paint_white", "body", double_sided=True))
    return Model(tuple(parts))
