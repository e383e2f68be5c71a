"""Front doors in a unit box: x along the width, z up, y out of the wall in metres.

Their scale is (width, 1, height), and y = 0 is the panel that closes the opening. Surrounds and
canopies stand out of the wall, which lies 6 to 9 cm before the panel.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from envgen_usd.assets.asset_design import Model, Part
from envgen_usd.assets.polygon_mesh import merge
from envgen_usd.assets.shapes.window_shapes import (
    LAP,
    Box,
    frame_boxes,
    in_unit_box,
    pane,
    solid_part,
)

_LEAF = 0.035
"""Depth of a leaf, metres."""
_SLOPE = (0.05, 0.022)
"""Width of the sloping sides of panels along x and z."""


@dataclass(frozen=True)
class _Door:
    """A front door.

    Attributes:
        leaf: Boxes of the leaf.
        lights: Panes, each (low, high) as (x, z).
        surround: Boxes around the opening; empty for none.
        head: Height of the rail between leaf and fanlight; 1 without a fanlight.
        handle: x of the handle.
        frame: Further bars of the frame.
        panels: Raised fields of the leaf.
    """

    leaf: list[Box]
    lights: list[tuple[tuple[float, float], tuple[float, float]]]
    surround: list[Box]
    head: float = 0.965
    handle: float = 0.86
    frame: tuple[Box, ...] = ()
    panels: tuple[Box, ...] = ()


def _slab(left: float = 0.07, right: float = 0.93, top: float = 0.965) -> Box:
    return (left, 0.0, 0.012), (right, _LEAF, top)


def _panels(rows: tuple[tuple[float, float], ...], columns: tuple[tuple[float, float], ...] = (
    (0.16, 0.46), (0.54, 0.84))) -> tuple[Box, ...]:  # fmt: skip
    """Raised fields, by rows (from, to) and columns (from, to).

    Their sides slope: upright ones, a few millimetres deep, break up into dots at a distance.
    """
    return tuple(
        ((a, _LEAF - LAP, low), (b, 0.052, high)) for low, high in rows for a, b in columns
    )


def _boards(count: int) -> list[Box]:
    """Vertical boards with open joints."""
    edges = np.linspace(0.07, 0.93, count + 1).tolist()
    return [((a + 0.004, 0.0, 0.012), (b - 0.004, 0.045, 0.965)) for a, b in pairwise(edges)]


def _pilasters() -> list[Box]:
    """A classical surround: plinths, pilasters, entablature and a flat hood."""
    boxes: list[Box] = []
    for a, b in ((-0.24, -0.02), (1.02, 1.24)):
        boxes.append(((a - 0.02, 0.0, 0.0), (b + 0.02, 0.17, 0.08)))
        boxes.append(((a, 0.0, 0.08), (b, 0.15, 1.0)))
        boxes.append(((a - 0.02, 0.0, 0.965), (b + 0.02, 0.175, 1.01)))
    return [
        *boxes,
        ((-0.26, 0.0, 1.01), (1.26, 0.16, 1.08)),
        ((-0.3, 0.0, 1.08), (1.3, 0.36, 1.115)),
    ]


def _brackets() -> list[Box]:
    """A flat hood on two brackets."""
    steps: list[Box] = [
        ((x, 0.0, z), (x + 0.09, out, z + 0.05))
        for x in (-0.16, 1.07)
        for z, out in ((0.9, 0.18), (0.95, 0.3), (1.0, 0.45))
    ]
    return [
        *steps,
        ((-0.28, 0.0, 1.05), (1.28, 0.75, 1.085)),
        ((-0.3, 0.0, 1.085), (1.3, 0.78, 1.1)),
    ]


def _architrave(width: float, out: float) -> list[Box]:
    return [
        ((-width, 0.0, 0.0), (0.0, out, 1.0)),
        ((1.0, 0.0, 0.0), (1.0 + width, out, 1.0)),
        ((-width, 0.0, 1.0), (1.0 + width, out + 0.004, 1.0 + width * 0.5)),
    ]


_SIX = ((0.09, 0.29), (0.33, 0.53), (0.57, 0.77))
_ONE = ((0.17, 0.83),)
_DOORS: Mapping[str, Callable[[], _Door]] = {
    "panelled": lambda: _Door(
        [_slab(top=0.79)], [((0.09, 0.82), (0.91, 0.96))], _architrave(0.09, 0.105), 0.8,
        panels=_panels(_SIX),
    ),
    "classical": lambda: _Door(
        [_slab(top=0.76)],
        [((0.09, 0.79), (0.485, 0.96)), ((0.515, 0.79), (0.91, 0.96))], _pilasters(), 0.77,
        frame=(((0.485, 0.0, 0.78), (0.515, 0.04, 0.965)),),
        panels=_panels(((0.07, 0.25), (0.29, 0.5), (0.54, 0.73))),
    ),
    "hooded": lambda: _Door(
        [_slab()], [((0.17, 0.5), (0.46, 0.9)), ((0.54, 0.5), (0.83, 0.9))], _brackets(),
        panels=_panels(((0.07, 0.4),)),
    ),
    "boarded": lambda: _Door(_boards(7), [((0.36, 0.68), (0.64, 0.82))], _architrave(0.12, 0.1)),
    "half_glazed": lambda: _Door(
        [_slab()], [((0.17, 0.46), (0.83, 0.9))], _architrave(0.06, 0.1),
        panels=_panels(((0.07, 0.38),), _ONE),
    ),
    "glazed": lambda: _Door(
        [
            ((0.07, 0.0, 0.012), (0.18, 0.04, 0.965)), ((0.82, 0.0, 0.012), (0.93, 0.04, 0.965)),
            ((0.17, 0.0, 0.012), (0.83, 0.038, 0.13)), ((0.17, 0.0, 0.45), (0.83, 0.038, 0.5)),
            ((0.17, 0.0, 0.9), (0.83, 0.038, 0.965)),
        ],
        [((0.17, 0.12), (0.83, 0.46)), ((0.17, 0.49), (0.83, 0.91))], _architrave(0.06, 0.1),
        handle=0.85,
    ),
    "flush": lambda: _Door(
        [_slab()], [((0.2, 0.14), (0.34, 0.86))],
        [((-0.1, 0.0, 1.02), (1.1, 0.9, 1.06))],
    ),
    "side_light": lambda: _Door(
        [_slab(left=0.33)],
        [((0.07, 0.03), (0.28, 0.96)), ((0.43, 0.56), (0.83, 0.88))], _architrave(0.05, 0.1),
        handle=0.38, frame=(((0.28, 0.0, 0.012), (0.33, 0.06, 0.965)),),
        panels=_panels(((0.07, 0.3), (0.36, 0.5)), ((0.41, 0.85),)),
    ),
}  # fmt: skip


def front_doors() -> dict[str, Model]:
    """The front doors of houses by their style."""
    return {name: _front_door(make()) for name, make in _DOORS.items()}


def _front_door(door: _Door) -> Model:
    frame = [*frame_boxes(0.07, 0.035, 0.06), *door.frame]
    frame[2] = ((0.0, 0.0, 0.0), (1.0, 0.09, 0.012))
    if door.head < 0.9:
        frame.append(((0.068, 0.0, door.head - 0.012), (0.932, 0.055, door.head + 0.015)))
    hand = door.handle
    fittings: list[Box] = [
        ((hand - 0.02, 0.035, 0.44), (hand + 0.02, 0.06, 0.52)),
        ((hand - 0.09 if hand > 0.5 else hand, 0.08, 0.474),
         (hand if hand > 0.5 else hand + 0.09, 0.095, 0.486)),
        ((hand - 0.01, 0.05, 0.474), (hand + 0.01, 0.09, 0.486)),
        ((0.38, 0.035, 0.415), (0.62, 0.056, 0.438)),
    ]  # fmt: skip
    fields = [(panel, _SLOPE) for panel in door.panels]
    lights = merge([pane(*light, y=0.038) for light in door.lights])
    parts = [
        *solid_part("Frame", frame, "paint_white", "door_frame"),
        *solid_part("Leaf", door.leaf, "paint_brown", "door_leaf", fields),
        *solid_part("Handle", fittings, "metal_galvanised", "door_handle"),
        Part("Pane", lights, "glass", "door_pane"),
        *solid_part("Surround", door.surround, "trim_stone", "door_frame"),
    ]
    return in_unit_box(parts)
