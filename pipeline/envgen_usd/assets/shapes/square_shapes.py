"""What stands on town squares: fountains, monuments, planters, and the pits of trees."""

from dataclasses import replace

import numpy as np

from envgen_usd.assets.asset_design import Model, Part
from envgen_usd.assets.polygon_mesh import Mesh, merge
from envgen_usd.assets.shapes.shrubs import Shrub, shrub
from envgen_usd.assets.shapes.simple_solids import box, flat, lathe, moved, tube
from envgen_usd.models.array_types import FloatArray
from envgen_usd.seeds import generator

_ROUND = 24
"""Corners of the cross-section of basins."""
_PLANT = Shrub(0.75, 1.05, 1, 2, 110, 0.30, 0.5)


def bowl_fountain() -> Model:
    """A round basin of 4.8 m with a bowl of 2 m on a pedestal."""
    step = lathe(np.array([[2.4, 0.0], [2.4, 0.12], [2.2, 0.121]]), _ROUND)
    basin = _basin(2.15, 0.12, 0.62)
    pedestal = lathe(
        np.array(
            [[0.48, 0.2], [0.48, 0.66], [0.34, 0.76], [0.19, 1.2], [0.28, 1.42],
             [0.34, 1.46]]
        ), 12,
    )  # fmt: skip
    bowl = lathe(
        np.array(
            [[0.30, 1.44], [0.90, 1.68], [1.02, 1.82], [1.02, 1.88], [0.92, 1.88],
             [0.80, 1.76], [0.0, 1.74]]
        ), _ROUND,
    )  # fmt: skip
    finial = lathe(
        np.array(
            [[0.20, 1.70], [0.16, 1.95], [0.09, 2.08], [0.16, 2.22], [0.20, 2.36], [0.14, 2.50],
             [0.0, 2.58]]
        ), 12,
    )  # fmt: skip
    water = [_disc(1.97, 0.40, 0.46), _disc(0.93, 1.78, 1.84)]
    return Model(
        (
            Part("Body", merge([step, basin, pedestal, bowl, finial]), "trim_stone", "body"),
            Part("Water", merge(water), "water", "water"),
        )
    )


def trough_fountain() -> Model:
    """An eight-sided trough of 4.4 m around a pillar with four spouts."""
    trough = _basin(2.2, 0.0, 0.78, sides=8, thick=0.24)
    foot = lathe(np.array([[0.50, 0.1], [0.50, 0.95], [0.40, 1.0]]), 8)
    pillar = lathe(np.array([[0.36, 0.9], [0.32, 2.1], [0.44, 2.2], [0.44, 2.32], [0.30, 2.4]]), 8)
    urn = lathe(
        np.array(
            [[0.16, 2.36], [0.12, 2.5], [0.26, 2.66], [0.30, 2.84], [0.20, 2.98], [0.24, 3.04],
             [0.10, 3.1], [0.0, 3.22]]
        ), 16,
    )  # fmt: skip
    spouts = []
    for turn in range(4):
        out = np.array([np.cos(turn * np.pi / 2), np.sin(turn * np.pi / 2), 0.0])
        up = np.array([0.0, 0.0, 1.0])
        path = np.array([0.25 * out + 1.55 * up, 0.55 * out + 1.6 * up, 0.75 * out + 1.5 * up])
        spouts.append(tube(path, np.array([0.035, 0.035, 0.03]), 8))
    return Model(
        (
            Part("Body", merge([trough, foot, pillar, urn]), "trim_stone", "body"),
            Part("Spouts", merge(spouts), "metal_cast", "body"),
            Part("Water", _disc(1.92, 0.5, 0.6, sides=8), "water", "water"),
        )
    )


def obelisk() -> Model:
    """A shaft of granite on a pedestal and three steps, 7 m high."""
    steps = [
        box((-half, -half, low), (half, half, low + 0.16))
        for half, low in ((1.9, 0.0), (1.55, 0.16), (1.2, 0.32))
    ]
    pedestal = [
        _frustum(0.80, 0.74, 0.48, 0.72),
        _frustum(0.66, 0.64, 0.72, 1.75),
        _frustum(0.66, 0.80, 1.75, 1.88),
        _frustum(0.80, 0.80, 1.88, 1.98),
    ]
    shaft = [_frustum(0.46, 0.30, 1.98, 6.5), _frustum(0.30, 0.0, 6.5, 7.0)]
    plates = [
        box((0.60, -0.42, 0.95), (0.675, 0.42, 1.5)),
        box((-0.675, -0.42, 0.95), (-0.60, 0.42, 1.5)),
    ]
    return Model(
        (
            Part("Body", merge([*steps, *pedestal, *shaft]), "curb_stone", "body"),
            Part("Plates", merge(plates), "metal_cast", "body"),
        )
    )


def column() -> Model:
    """A column on an eight-sided foot, with an urn of bronze, 7.6 m high."""
    foot = [
        lathe(np.array([[2.0, 0.0], [2.0, 0.17], [1.7, 0.171]]), 8),
        lathe(np.array([[1.6, 0.1], [1.6, 0.34], [1.3, 0.341]]), 8),
        lathe(np.array([[1.05, 0.3], [1.05, 0.55], [0.9, 0.62], [0.9, 1.75]]), 8),
        lathe(np.array([[1.08, 1.75], [1.08, 1.92], [0.8, 1.93]]), 8),
    ]
    shaft = lathe(
        np.array(
            [[0.62, 1.9], [0.62, 2.05], [0.52, 2.15], [0.46, 2.25], [0.45, 4.0], [0.38, 6.0],
             [0.40, 6.06], [0.44, 6.1], [0.60, 6.3]]
        ), 24,
    )  # fmt: skip
    abacus = box((-0.62, -0.62, 6.3), (0.62, 0.62, 6.45))
    urn = lathe(
        np.array(
            [[0.30, 6.45], [0.30, 6.53], [0.14, 6.62], [0.16, 6.7], [0.40, 6.95], [0.42, 7.1],
             [0.30, 7.25], [0.34, 7.3], [0.18, 7.42], [0.0, 7.6]]
        ), 16,
    )  # fmt: skip
    return Model(
        (
            Part("Body", merge([*foot, shaft, abacus]), "trim_stone", "body"),
            Part("Urn", urn, "metal_cast", "body"),
        )
    )


def round_planter() -> Model:
    """A round pot of 1.1 m with a shrub."""
    pot = lathe(
        np.array(
            [[0.42, 0.0], [0.42, 0.05], [0.50, 0.12], [0.56, 0.48], [0.58, 0.55], [0.50, 0.55],
             [0.48, 0.46], [0.0, 0.46]]
        ), 24,
    )  # fmt: skip
    soil = _disc(0.49, 0.44, 0.50, sides=16)
    return Model((*_planted(0.48), Part("Pot", pot, "concrete", "body"), _soil(soil)))


def square_planter() -> Model:
    """A box of boards, 1.2 m wide, with a shrub."""
    half, thick = 0.6, 0.05
    boards = []
    for number in range(4):
        low = 0.06 + 0.12 * number
        boards += _frame(half, thick, low, low + 0.112)
    boards += _frame(half + 0.03, 0.10, 0.54, 0.58)
    posts = [
        box((x - 0.05, y - 0.05, 0.0), (x + 0.05, y + 0.05, 0.55))
        for x in (-0.53, 0.53)
        for y in (-0.53, 0.53)
    ]
    soil = box((-0.56, -0.56, 0.08), (0.56, 0.56, 0.50))
    return Model(
        (*_planted(0.48), Part("Pot", merge([*boards, *posts]), "wood", "body"), _soil(soil))
    )


def kerbed_pit() -> Model:
    """The pit of a tree, 1.6 m wide: earth within a low kerb."""
    kerb = merge(_frame(0.8, 0.12, -0.02, 0.09))
    return Model(
        (
            Part("Kerb", kerb, "curb_stone", "body"),
            Part("Soil", box((-0.69, -0.69, -0.02), (0.69, 0.69, 0.05)), "soil", "ground"),
        )
    )


def grille_pit() -> Model:
    """The pit of a tree under a grille of cast iron, 1.6 m wide."""
    bars = []
    for half in (0.79, 0.62, 0.45):
        bars += _frame(half, 0.09, -0.01, 0.022)
    for a, b in (((0.3, -0.045), (0.8, 0.045)), ((-0.8, -0.045), (-0.3, 0.045))):
        bars.append(box((*a, -0.01), (*b, 0.024)))
        bars.append(box((a[1], a[0], -0.01), (b[1], b[0], 0.024)))
    soil = box((-0.75, -0.75, -0.02), (0.75, 0.75, 0.006))
    return Model(
        (
            Part("Grille", merge(bars), "metal_cast", "body"),
            Part("Soil", soil, "soil", "ground"),
        )
    )


def _basin(
    radius: float, low: float, high: float, sides: int = _ROUND, thick: float = 0.20
) -> Mesh:
    """A wall around a floor, with a coping that reaches out.

    Args:
        radius: Outer radius of the coping, metres.
        low: Height of its foot, metres.
        high: Height of its rim, metres.
        sides: Corners of its cross-section.
        thick: Thickness of the wall, metres.
    """
    wall, inner = radius - 0.06, radius - 0.06 - thick
    profile = [
        [wall, low], [wall, high - 0.12], [radius, high - 0.10], [radius, high - 0.02],
        [inner - 0.03, high], [inner - 0.03, high - 0.10],
        [inner, high - 0.12], [inner, low + 0.10], [0.0, low + 0.10],
    ]  # fmt: skip
    return lathe(np.array(profile), sides)


def _disc(radius: float, low: float, high: float, sides: int = _ROUND) -> Mesh:
    """A flat body of revolution, metres."""
    return lathe(np.array([[radius, low], [radius, high], [0.0, high]]), sides)


def _frustum(half: float, top: float, low: float, high: float) -> Mesh:
    """A square shaft that tapers: half its width below and above, and its heights, metres."""
    square = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    points: FloatArray = np.concatenate(
        [np.c_[half * square, np.full(4, low)], np.c_[top * square, np.full(4, high)]]
    )
    if top <= 0.0:
        sides = np.array([[0, 1], [1, 2], [2, 3], [3, 0]])
        faces = np.concatenate([[3, 2, 1, 0], np.c_[sides, np.full(4, 4)].reshape(-1)])
        return flat(points[:5], np.array([4, 3, 3, 3, 3]), faces)
    walls = [[0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]
    faces = np.array([[3, 2, 1, 0], [4, 5, 6, 7], *walls])
    return flat(points, np.full(6, 4), faces.reshape(-1))


def _frame(half: float, thick: float, low: float, high: float) -> list[Mesh]:
    """Four bars around a square: half its width, their width and heights, metres."""
    inner = half - thick
    return [
        box((-half, -half, low), (half, -inner, high)),
        box((-half, inner, low), (half, half, high)),
        box((-half, -inner, low), (-inner, inner, high)),
        box((inner, -inner, low), (half, inner, high)),
    ]


def _planted(height: float) -> tuple[Part, ...]:
    """The parts of a shrub that stands at a height, metres."""
    plant = shrub(_PLANT, "leaves_evergreen", generator(0, "planter"))
    return tuple(
        replace(part, mesh=moved(part.mesh, (0.0, 0.0, height)), of_class="vegetation")
        for part in plant.parts
    )


def _soil(mesh: Mesh) -> Part:
    return Part("Soil", mesh, "soil", "ground", of_class="terrain")
