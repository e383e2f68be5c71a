"""Flower beds: earth within an edging, with plants as cards; they face +x and lie along y."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from envgen_usd.assets.asset_design import Model, Part
from envgen_usd.assets.polygon_mesh import Mesh, merge, normalised
from envgen_usd.assets.shapes.foliage_cards import Shoots, Tiles, cards, distant_cards
from envgen_usd.assets.shapes.simple_solids import box, flat, moved, tube
from envgen_usd.models.array_types import FloatArray

_TILES = 4
"""Tiles along each side of the atlas of flowers."""
_EDGE = 0.07
"""Height of the edging, metres."""
_SKY = np.array([0.2, 0.0, 1.0])
"""What is added to the normals of plants; a larger value lights all sides alike."""
_BREADTH = 0.9
"""Width of a card as a share of its length."""


@dataclass(frozen=True)
class Bed:
    """A bed; lengths in metres.

    Attributes:
        depth: Extent along x.
        length: Extent along y.
        rows: Row of the atlas, number of plants and mean height, from the back to the front.
        edging: Material of the edging.
        around: True for a round bed.
    """

    depth: float
    length: float
    rows: tuple[tuple[int, int, float], ...]
    edging: str
    around: bool = False


BEDS: Mapping[str, Bed] = {
    "border": Bed(0.9, 2.4, ((1, 26, 0.62), (2, 28, 0.42), (3, 30, 0.28)), "trim_stone"),
    "roses": Bed(0.7, 2.4, ((0, 46, 0.6), (3, 22, 0.26)), "brick_red"),
    "round": Bed(1.6, 1.6, ((1, 20, 0.6), (2, 30, 0.42), (3, 34, 0.28)), "trim_stone", True),
    "cottage": Bed(0.8, 2.4, ((2, 30, 0.5), (0, 24, 0.42), (1, 24, 0.36)), "wood"),
}
"""Designs by name, default first."""


def flower_bed(bed: Bed, rng: np.random.Generator) -> Model:
    """A bed with its plants, and a simpler one for the distance.

    Args:
        bed: Its design.
        rng: Random generator.
    """
    groups = [_plants(bed, index, rng) for index in range(len(bed.rows))]
    middle = np.array([0.0, 0.0, -0.3])
    near = [
        _lit(cards(shoots, Tiles(row, _TILES), _BREADTH, middle, rng))
        for shoots, (row, _, _) in zip(groups, bed.rows, strict=True)
    ]
    far = [
        _lit(distant_cards(shoots, Tiles(row, _TILES), 3, middle, rng))
        for shoots, (row, _, _) in zip(groups, bed.rows, strict=True)
    ]
    flowers = Part("Flowers", merge(near), "flowers", "crown", double_sided=True)
    edging = Part("Edging", merge(_edging(bed)), bed.edging, "body", of_class="terrain")
    parts = (
        edging,
        replace(edging, name="EdgingProxy", mesh=merge(_far_edging(bed)), proxy_of="Edging"),
        Part("Soil", _soil(bed), "soil", "ground", of_class="terrain"),
        flowers,
        replace(flowers, name="FlowersProxy", mesh=merge(far), proxy_of="Flowers"),
    )
    return Model(parts)


def _lit(mesh: Mesh) -> Mesh:
    """The mesh with normals towards the sky, which lights a low bed."""
    return replace(mesh, normals=normalised(0.8 * mesh.normals + _SKY))


def _plants(bed: Bed, index: int, rng: np.random.Generator) -> Shoots:
    """The plants of a row: a strip from the back to the front, or a ring from the inside."""
    _, count, height = bed.rows[index]
    share = (index + rng.uniform(0.05, 0.95, count)) / len(bed.rows)
    if bed.around:
        bearing = 2.399963 * np.arange(count) + rng.normal(0, 0.2, count)
        reach = (bed.depth / 2 - 0.2) * np.sqrt(share)
        place = np.stack([reach * np.cos(bearing), reach * np.sin(bearing)], axis=1)
    else:
        along = (np.arange(count) + rng.uniform(0.1, 0.9, count)) / count - 0.5
        x = (share - 0.5) * (bed.depth - 0.42)
        place = np.stack([x, along * (bed.length - 0.5)], axis=1)
    feet = np.column_stack([place, np.full(count, 0.04)])
    lean = np.column_stack([rng.normal(0.0, 0.2, (count, 2)), np.ones(count)])
    return Shoots(feet, normalised(lean), height * rng.uniform(0.75, 1.2, count))


def _soil(bed: Bed) -> Mesh:
    """Earth that rises towards the middle."""
    if bed.around:
        angle = np.linspace(0.0, 2 * np.pi, 16, endpoint=False)
        rim = (bed.depth / 2 - 0.05) * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    else:
        x, y = bed.depth / 2 - 0.05, bed.length / 2 - 0.05
        rim = np.array([[x, -y], [x, 0.0], [x, y], [-x, y], [-x, 0.0], [-x, -y]])
    count = len(rim)
    points = np.concatenate([np.c_[rim, np.full(count, 0.03)], [[0.0, 0.0, 0.09]]])
    side = np.arange(count)
    faces = np.stack([side, (side + 1) % count, np.full(count, count)], axis=1)
    return flat(points, np.full(count, 3), faces.reshape(-1))


def _edging(bed: Bed) -> list[Mesh]:
    """Stones, bricks or boards along the border."""
    if bed.around:
        angle = np.linspace(0.0, 2 * np.pi, 25)
        reach = bed.depth / 2 - 0.04
        ring = np.stack([reach * np.cos(angle), reach * np.sin(angle), np.full(25, 0.035)], axis=1)
        return [tube(ring, np.full(25, 0.05), 5, caps=False)]
    x, y = bed.depth / 2, bed.length / 2
    count = 1 if bed.edging == "wood" else 12
    wide = bed.length / count
    gap = 0.004 if count > 1 else 0.0
    stone = [_stone(wide - 2 * gap, number) for number in range(count)]
    fronts = [
        moved(stone[number], (at, -y + (number + 0.5) * wide, 0.0))
        for number in range(count)
        for at in (x - 0.035, -x + 0.035)
    ]
    ends = [
        box((-x + 0.07, at - 0.03, -0.01), (x - 0.07, at + 0.03, _EDGE))
        for at in (-y + 0.03, y - 0.03)
    ]
    return [*fronts, *ends]


def _far_edging(bed: Bed) -> list[Mesh]:
    """The edging as four bars, or as a ring of few sides."""
    if bed.around:
        angle = np.linspace(0.0, 2 * np.pi, 9)
        reach = bed.depth / 2 - 0.04
        ring = np.stack([reach * np.cos(angle), reach * np.sin(angle), np.full(9, 0.035)], axis=1)
        return [tube(ring, np.full(9, 0.05), 3, caps=False)]
    x, y = bed.depth / 2, bed.length / 2
    long = [box((at - 0.035, -y, 0.0), (at + 0.035, y, _EDGE)) for at in (x - 0.035, 0.035 - x)]
    return [
        *long,
        *(box((0.07 - x, at, 0.0), (x - 0.07, at + 0.06, _EDGE)) for at in (-y, y - 0.06)),
    ]


def _stone(wide: float, number: int) -> Mesh:
    """An edging stone; neighbours differ a little in height."""
    high = _EDGE + 0.008 * np.sin(2.4 * number)
    low: FloatArray = np.array([-0.035, -wide / 2, -0.01])
    return box(low, np.array([0.035, wide / 2, high]))
