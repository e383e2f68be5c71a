"""Roofs over a rectangle whose ridge runs along x: the top of each wall and everything above."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import TypeAlias

from envgen_usd.city.faces import Face, Point, Ring

Border: TypeAlias = list[tuple[float, float]]
"""Points in a vertical plane: metres along it, height."""


@dataclass(frozen=True)
class RoofSpec:
    """Measures of a roof; heights are above the floor, lengths in metres.

    Attributes:
        length: Of the rectangle along x.
        width: Of the rectangle along y.
        eaves: Height of the walls.
        slope: Tangent of the pitch.
        overhang: Beyond the walls at the eaves.
        verge: Beyond the walls at the gables; 0 at party walls, and where `overhang` is 0.
        thickness: Of the roof where it stands over; of no effect without an overhang.
        parapet: Height of the parapet of a flat roof; 0 for none.
    """

    length: float
    width: float
    eaves: float
    slope: float
    overhang: float = 0.0
    verge: float = 0.0
    thickness: float = 0.18
    parapet: float = 0.0


@dataclass(frozen=True)
class Roof:
    """A roof.

    Attributes:
        tops: For each wall (front, right, back, left) its upper border from its right end to its
            left end as seen from outside: (distance from the left end, height).
        faces: Everything above the walls.
        ridge: Height of the highest edge.
        carrier: Index in `faces` of the one that may carry a chimney.
        height: Height of that face over (x, y).
    """

    tops: tuple[Border, Border, Border, Border]
    faces: list[Face]
    ridge: float
    carrier: int
    height: Callable[[float, float], float]


def flat(spec: RoofSpec) -> Roof:
    """A flat roof: behind a parapet, standing over as a slab, or level with the walls."""
    if spec.parapet <= 0.0 or spec.overhang > 0.0:
        return extruded(spec, [(0.0, spec.eaves), (spec.width, spec.eaves)])
    length, width, floor, top = spec.length, spec.width, spec.eaves, spec.eaves + spec.parapet
    thick = min(0.25, 0.2 * min(length, width))
    inner = (thick, thick, length - thick, width - thick)
    low, high = rectangle(*inner, floor), rectangle(*inner, top)
    coping = Face("RoofSurface", "coping", rectangle(0.0, 0.0, length, width, top), [high[::-1]])
    faces = [Face("RoofSurface", "flat", low), coping]
    for a in range(4):
        b = (a + 1) % 4
        faces.append(Face("WallSurface", "parapet", [low[b], low[a], high[a], high[b]]))
    return Roof(_level_tops(spec, top), faces, top, 0, lambda _x, _y: floor)


def shed(spec: RoofSpec) -> Roof:
    """One slope that rises from the front to the back."""
    return extruded(spec, [(0.0, spec.eaves), (spec.width, spec.eaves + spec.width * spec.slope)])


def gabled(spec: RoofSpec) -> Roof:
    """Two slopes that meet in a ridge along x."""
    half = spec.width / 2
    ridge = spec.eaves + half * spec.slope
    return extruded(spec, [(0.0, spec.eaves), (half, ridge), (spec.width, spec.eaves)])


def extruded(spec: RoofSpec, section: Border) -> Roof:
    """A roof with the same section all along x.

    Args:
        spec: Measures; `slope` is not used.
        section: Underside of the roof from the front wall (0) to the back wall (width): (y, z).
    """
    over = spec.overhang
    thick = spec.thickness if over > 0.0 else 0.0
    verge = spec.verge if over > 0.0 else 0.0
    under = [_beyond(section[1], section[0], over), *section[1:-1]]
    under.append(_beyond(section[-2], section[-1], over))
    top = [(y, z + thick) for y, z in under]
    x0, x1 = -verge, spec.length + verge
    faces = [Face("RoofSurface", "slope", _strip(x0, x1, a, b)) for a, b in pairwise(top)]
    (y0, z0), (y1, z1) = top[-2:]
    if over > 0.0:
        faces.append(Face("RoofSurface", "fascia", _strip(x0, x1, under[0], top[0])))
        faces.append(Face("RoofSurface", "fascia", _strip(x0, x1, top[-1], under[-1])))
    if verge > 0.0:
        faces += _verges(x0, x1, under, top) + _soffits(spec, section, under, x0, x1)
        gable = section
    else:
        gable = section if over <= 0.0 else [section[0], under[0], *top, under[-1], section[-1]]
        if over > 0.0:
            ends = ((section[0], under[0]), (under[-1], section[-1]))
            faces += [Face("OuterCeilingSurface", "soffit", _strip(x0, x1, *end)) for end in ends]
    return Roof(
        _tops(spec, section, gable),
        faces,
        max(z for _, z in top),
        len(top) - 2,
        lambda _x, y: z0 + (y - y0) * (z1 - z0) / (y1 - y0),
    )


def hipped(spec: RoofSpec) -> Roof:
    """Four equal slopes: a ridge along x, or an apex over a square."""
    half = min(spec.length, spec.width) / 2
    length, width = max(spec.length - spec.width, 0.0), max(spec.width - spec.length, 0.0)
    ridge = (half, half, half + length, half + width)
    return _hips(spec, ridge, (half + spec.overhang) * spec.slope)


def pyramidal(spec: RoofSpec) -> Roof:
    """Four slopes that meet in an apex over the middle."""
    x, y = spec.length / 2, spec.width / 2
    return _hips(spec, (x, y, x, y), (min(x, y) + spec.overhang) * spec.slope)


def rectangle(x0: float, y0: float, x1: float, y1: float, z: float) -> Ring:
    """A level rectangle, counter-clockwise from above."""
    return [(x0, y0, z), (x1, y0, z), (x1, y1, z), (x0, y1, z)]


def _hips(spec: RoofSpec, ridge: tuple[float, float, float, float], rise: float) -> Roof:
    over = spec.overhang
    eaves = spec.eaves + (spec.thickness if over > 0.0 else 0.0)
    outer = (-over, -over, spec.length + over, spec.width + over)
    corners = rectangle(*outer, eaves)
    top = eaves + rise
    a, b, c, d = rectangle(*ridge, top)
    ends = ([b, a], [c, b], [d, c], [a, d])
    slopes = [
        [corners[side], corners[(side + 1) % 4], *dict.fromkeys(ends[side])] for side in range(4)
    ]
    faces = [Face("RoofSurface", "slope", slope) for slope in slopes]
    if over > 0.0:
        low = rectangle(*outer, spec.eaves)
        inner = rectangle(0.0, 0.0, spec.length, spec.width, spec.eaves)
        faces.append(Face("OuterCeilingSurface", "soffit", low[::-1], [inner]))
        for i in range(4):
            j = (i + 1) % 4
            faces.append(Face("RoofSurface", "fascia", [low[i], low[j], corners[j], corners[i]]))
    back, reach = outer[3], outer[3] - ridge[3]
    return Roof(
        _level_tops(spec, spec.eaves),
        faces,
        top,
        2,
        lambda _x, y: eaves + (back - y) * rise / reach,
    )


def _beyond(
    inside: tuple[float, float], at: tuple[float, float], over: float
) -> tuple[float, float]:
    """End of a section, prolonged in its own slope by a level distance."""
    if over <= 0.0:
        return at
    side = 1.0 if at[0] > inside[0] else -1.0
    slope = (at[1] - inside[1]) / (at[0] - inside[0])
    return at[0] + side * over, at[1] + side * over * slope


def _strip(x0: float, x1: float, a: tuple[float, float], b: tuple[float, float]) -> Ring:
    """Face along x between two lines; seen from outside, x grows to the right from a up to b."""
    return [(x0, *a), (x1, *a), (x1, *b), (x0, *b)]


def _verges(x0: float, x1: float, under: Border, top: Border) -> list[Face]:
    left: list[Point] = [(x0, y, z) for y, z in (*top, *under[::-1])]
    right: list[Point] = [(x1, y, z) for y, z in (*under, *top[::-1])]
    return [Face("RoofSurface", "verge", left), Face("RoofSurface", "verge", right)]


def _soffits(spec: RoofSpec, section: Border, under: Border, x0: float, x1: float) -> list[Face]:
    """Underside of the roof outside the walls, on all four sides."""
    length = spec.length
    if len(section) == 2:
        outer = _strip(x0, x1, under[1], under[0])
        return [Face("OuterCeilingSurface", "soffit", outer, [_strip(0.0, length, *section)])]
    first, last = section[0], section[-1]
    rings = [
        [
            (x0, *under[1]),
            (0.0, *under[1]),
            (0.0, *first),
            (length, *first),
            (length, *under[1]),
            (x1, *under[1]),
            (x1, *under[0]),
            (x0, *under[0]),
        ],
        [
            (x1, *under[-2]),
            (length, *under[-2]),
            (length, *last),
            (0.0, *last),
            (0.0, *under[-2]),
            (x0, *under[-2]),
            (x0, *under[-1]),
            (x1, *under[-1]),
        ],
    ]
    for a, b in pairwise(section[1:-1]):
        rings += [_strip(x0, 0.0, b, a), _strip(length, x1, b, a)]
    return [Face("OuterCeilingSurface", "soffit", ring) for ring in rings]


def _tops(spec: RoofSpec, section: Border, gable: Border) -> tuple[Border, Border, Border, Border]:
    front, back = section[0][1], section[-1][1]
    return (
        [(spec.length, front), (0.0, front)],
        gable[::-1],
        [(spec.length, back), (0.0, back)],
        [(spec.width - y, z) for y, z in gable],
    )


def _level_tops(spec: RoofSpec, height: float) -> tuple[Border, Border, Border, Border]:
    long: Border = [(spec.length, height), (0.0, height)]
    short: Border = [(spec.width, height), (0.0, height)]
    return long, short, long, short
