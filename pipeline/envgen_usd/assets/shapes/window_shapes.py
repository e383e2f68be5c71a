"""Windows of houses in a unit box: x along the width, z up, y out of the wall in metres.

Their scale is (width, 1, height), and y = 0 is the panel that closes the opening. Frames of 3 cm
lie in an embrasure of 6 to 9 cm, so that its reveal shows; sills and lintels stand out of the wall
around it.
"""

from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np

from envgen_usd.assets.asset_design import Model, Part
from envgen_usd.assets.polygon_mesh import Mesh, merge
from envgen_usd.assets.shapes.simple_solids import box, flat, raised

PANE = 0.010
"""Distance of a pane from the panel, metres."""
LAP = 0.002
"""Overlap of adjacent bars, metres, so that no two vertices coincide."""
_FRAME = 0.034
"""Depth of a frame, metres."""
_PROUD = 0.105
"""Distance of a lintel's face from the panel, metres; a larger value stands farther out."""
Box = tuple[tuple[float, float, float], tuple[float, float, float]]
"""Low and high corner."""


def front(low: tuple[float, float, float], high: tuple[float, float, float]) -> Mesh:
    """The outer face of a box, for the distance."""
    (x0, _, z0), (x1, y, z1) = low, high
    return pane((x0, z0), (x1, z1), y)


def pane(low: tuple[float, float], high: tuple[float, float], y: float = PANE) -> Mesh:
    """A rectangle that faces out of the wall; its corners are (x, z)."""
    (x0, z0), (x1, z1) = low, high
    points = np.array([[x1, y, z0], [x0, y, z0], [x0, y, z1], [x1, y, z1]])
    return flat(points, np.array([4]), np.arange(4))


def solid_part(
    name: str,
    boxes: Sequence[Box],
    material: str,
    label: str,
    fields: Sequence[tuple[Box, tuple[float, float]]] = (),
) -> tuple[Part, Part]:
    """A part of boxes and raised fields, and its proxy of the boxes' outer faces.

    Args:
        name: Of the part.
        boxes: Low and high corners.
        material: Of all.
        label: Of the taxonomy `part`.
        fields: Corners of raised fields, and the slopes of their sides along x and z.
    """
    near = merge([*(box(*each) for each in boxes), *(raised(*each, by) for each, by in fields)])
    far = merge([front(*each) for each in boxes])
    proxy = Part(f"{name}Proxy", far, material, label, proxy_of=name)
    return Part(name, near, material, label), proxy


def in_unit_box(parts: Sequence[Part]) -> Model:
    """The model of an opening: what lies in the unit box is scaled to its size."""
    low, high = Model(tuple(parts)).extent()
    return Model(tuple(parts), (1.0, round(float(high[1] - low[1]), 3), 1.0))


def frame_boxes(side: float, end: float, depth: float = _FRAME) -> list[Box]:
    """Four bars around the unit square; `side` and `end` are shares of its width and height."""
    return [
        ((0.0, 0.0, 0.0), (side, depth, 1.0)),
        ((1 - side, 0.0, 0.0), (1.0, depth, 1.0)),
        ((side - LAP, 0.0, 0.0), (1 - side + LAP, depth - LAP, end)),
        ((side - LAP, 0.0, 1 - end), (1 - side + LAP, depth - LAP, 1.0)),
    ]


def _posts(*places: float, low: float = 0.04, high: float = 0.96, half: float = 0.025) -> list[Box]:
    """Mullions about places along the width."""
    return [((x - half, 0.0, low - LAP), (x + half, 0.031, high + LAP)) for x in places]


def _rails(*places: float, left: float = 0.05, right: float = 0.95, half: float = 0.02,
           depth: float = 0.029) -> list[Box]:  # fmt: skip
    """Transoms about places along the height."""
    return [((left - LAP, 0.0, z - half), (right + LAP, depth, z + half)) for z in places]


def _muntins(columns: Sequence[float], rows: Sequence[float]) -> list[Box]:
    """Thin bars that divide a light."""
    upright = [((x - 0.009, 0.0, 0.05), (x + 0.009, 0.022, 0.95)) for x in columns]
    level = [((0.05, 0.0, z - 0.007), (0.95, 0.020, z + 0.007)) for z in rows]
    return [*upright, *level]


def _lights(*edges: float, low: float = 0.04, high: float = 0.96) -> list[Box]:
    """The frames of casements side by side between edges along the width."""
    boxes: list[Box] = []
    for left, right in pairwise(edges):
        a, b = left + 0.026, right - 0.026
        boxes += [
            ((a, 0.0, low), (a + 0.035, 0.027, high)),
            ((b - 0.035, 0.0, low), (b, 0.027, high)),
        ]
        boxes += [
            ((a + 0.03, 0.0, low), (b - 0.03, 0.025, low + 0.03)),
            ((a + 0.03, 0.0, high - 0.03), (b - 0.03, 0.025, high)),
        ]
    return boxes


_SILL: list[Box] = [((-0.05, 0.0, -0.045), (1.05, 0.14, -0.001))]
_LINTEL: list[Box] = [((-0.11, 0.0, 1.0), (1.11, _PROUD, 1.12))]
_ARCHITRAVE: list[Box] = [
    ((-0.1, 0.0, 0.0), (0.0, _PROUD, 1.0)),
    ((1.0, 0.0, 0.0), (1.1, _PROUD, 1.0)),
    ((-0.1, 0.0, 1.0), (1.1, _PROUD + LAP, 1.085)),
    ((-0.14, 0.0, 1.085), (1.14, 0.17, 1.13)),
]
_KEYSTONE: list[Box] = [*_LINTEL, ((0.43, 0.0, 0.985), (0.57, _PROUD + 0.025, 1.16))]
_APRON: list[Box] = [*_SILL, ((-0.02, 0.0, -0.2), (1.02, _PROUD - 0.01, -0.045))]
_SHUTTERS: list[Box] = [
    *(((a, 0.0, 0.0), (a + 0.27, _PROUD, 1.0)) for a in (-0.3, 1.03)),
]
_SLATS: list[tuple[Box, tuple[float, float]]] = [
    (((a, _PROUD - LAP, z), (a + 0.21, _PROUD + 0.014, z + 0.085)), (0.012, 0.03))
    for a in (-0.27, 1.06)
    for z in (0.05, 0.16, 0.27, 0.38, 0.54, 0.65, 0.76, 0.87)
]
_RAILING: list[Box] = [
    ((-0.04, 0.09, 0.02), (1.04, 0.115, 0.035)),
    ((-0.04, 0.09, 0.43), (1.04, 0.12, 0.455)),
    *(
        ((x - 0.008, 0.095, 0.03), (x + 0.008, 0.11, 0.44))
        for x in np.linspace(0.03, 0.97, 11).tolist()
    ),
]
_SASH: list[Box] = [
    *frame_boxes(0.075, 0.045),
    *_rails(0.5, left=0.07, right=0.93, depth=0.030),
    ((0.07, 0.0, 0.04), (0.93, 0.027, 0.105)),
    ((0.07, 0.0, 0.04), (0.115, 0.026, 0.5)),
    ((0.885, 0.0, 0.04), (0.93, 0.026, 0.5)),
]

_BARS: Mapping[str, list[Box]] = {
    "single": [*frame_boxes(0.06, 0.045), *_lights(0.03, 0.97)],
    "cross": [
        *frame_boxes(0.06, 0.045),
        *_posts(0.5, half=0.03),
        *_rails(0.665, right=0.472, depth=0.027),
        *_rails(0.665, left=0.528, depth=0.027),
    ],
    "sash": [*_SASH, *_muntins((0.5,), ())],
    "georgian": [*_SASH, *_muntins((1 / 3, 2 / 3), (0.275, 0.73))],
    "two_light": [*frame_boxes(0.055, 0.04), *_posts(0.5), *_lights(0.03, 0.5, 0.97)],
    "three_light": [
        *frame_boxes(0.04, 0.045),
        *_posts(1 / 3, 2 / 3, half=0.018),
        *_rails(0.72, left=0.35, right=0.65),
        *_lights(0.012, 1 / 3),
        *_lights(2 / 3, 0.988),
    ],
    "top_hung": [*frame_boxes(0.055, 0.045), *_rails(0.7), *_lights(0.03, 0.97, low=0.72)],
    "french": [
        *frame_boxes(0.06, 0.03),
        *_posts(0.5, half=0.035),
        *_rails(0.78, left=0.05),
        *_rails(0.3, left=0.05, half=0.012, depth=0.023),
        *_muntins((), (0.54,)),
    ],
    "shuttered": [*frame_boxes(0.055, 0.04), *_posts(0.5), *_muntins((0.27, 0.73), (0.35, 0.66))],
}  # fmt: skip
"""Frame, sashes and bars of each window of a house."""
_TRIM: Mapping[str, list[Box]] = {
    "single": [*_SILL],
    "cross": [*_SILL, *_LINTEL],
    "sash": [*_SILL, *_KEYSTONE],
    "georgian": [*_SILL, *_ARCHITRAVE],
    "two_light": [*_SILL, *_LINTEL],
    "three_light": [*_SILL],
    "top_hung": [*_APRON],
    "french": [*_SILL, *_ARCHITRAVE],
    "shuttered": [*_SILL],
}
"""Sill, lintel and surround of each window of a house."""


def house_windows() -> dict[str, Model]:
    """The windows of houses by their glazing."""
    return {name: _house_window(name) for name in _BARS}


def _house_window(name: str) -> Model:
    parts = [
        *solid_part("Frame", _BARS[name], "paint_white", "window_frame"),
        Part("Pane", pane((0.05, 0.04), (0.95, 0.96)), "glass", "window_pane"),
        *solid_part("Trim", _TRIM[name], "trim_stone", "window_frame"),
    ]
    if name == "french":
        parts += solid_part("Railing", _RAILING, "metal_dark", "railing")
    if name == "shuttered":
        parts += solid_part("Shutters", _SHUTTERS, "paint_green", "window_frame", _SLATS)
    return in_unit_box(parts)


def hall_window(*, strip: bool) -> Model:
    """A window of a hall: narrow bars, several lights side by side, or a single light."""
    bars = frame_boxes(0.03, 0.06, 0.05)
    if strip:
        bars += [((x - 0.012, 0.0, 0.06), (x + 0.012, 0.045, 0.94)) for x in (0.25, 0.5, 0.75)]
    parts = (
        *solid_part("Frame", bars, "paint_white", "window_frame"),
        Part("Pane", pane((0.03, 0.06), (0.97, 0.94)), "glass", "window_pane"),
    )
    return in_unit_box(parts)


def roof_window() -> Model:
    """A window in the slope of a roof: casing, sash and flashing."""
    casing = frame_boxes(0.09, 0.07, 0.09)
    flashing = [
        ((-0.12, 0.0, -0.14), (1.12, 0.02, -0.001)),
        ((-0.12, 0.0, 0.0), (-0.001, 0.03, 1.1)),
        ((1.001, 0.0, 0.0), (1.12, 0.03, 1.1)),
        ((0.0, 0.0, 1.001), (1.0, 0.031, 1.1)),
    ]
    parts = (
        *solid_part("Frame", casing, "metal_dark", "window_frame"),
        *solid_part("Flashing", flashing, "metal_dark", "window_frame"),
        Part("Pane", pane((0.085, 0.065), (0.915, 0.935), 0.05), "glass", "window_pane"),
    )
    return in_unit_box(parts)
