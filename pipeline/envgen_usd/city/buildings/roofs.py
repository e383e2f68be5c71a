"""Roofs over a rectangle with the ridge along x: upper borders of walls, and faces above."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

from envgen_usd.city.buildings.building_faces import Face, Point, Ring
from envgen_usd.city.buildings.roof_sections import SECTIONS, Border

_NO_OVERHANG = frozenset(("sawtooth", "barrel", "mansard"))
_PARAPET = 0.25
"""Thickness of a parapet, metres."""


@dataclass(frozen=True)
class RoofSpec:
    """Dimensions of a roof; heights are above the floor, lengths in metres.

    Attributes:
        kind: ``flat``, ``shed``, ``gabled``, ``mansard``, ``barrel``, ``sawtooth``, ``hipped`` or
            ``pyramidal``.
        length: Length of the rectangle along x.
        width: Width of the rectangle along y.
        eaves: Height of the walls.
        slope: Tangent of the pitch.
        overhang: Width outside the walls at the eaves.
        verge: Width outside the walls at the gables; 0 at party walls, and if `overhang` is 0.
        thickness: Thickness of the overhanging roof; unused without an overhang.
        parapet: Height of the parapet of a flat roof; 0 without a parapet.
    """

    kind: str
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
        faces: All faces above the walls.
        ridge: Height of the highest edge.
        front: Index in `faces` of the slope over the front wall.
        back: Index in `faces` of the slope over the back wall, which may carry a chimney.
        height: Function from (x, y) to the height of the back slope.
    """

    tops: tuple[Border, Border, Border, Border]
    faces: list[Face]
    ridge: float
    front: int
    back: int
    height: Callable[[float, float], float]


def make_roof(spec: RoofSpec) -> Roof:
    """Returns the roof of that kind; raises `KeyError` for an unknown kind."""
    if spec.kind == "hipped":
        return _hipped(spec)
    if spec.kind == "pyramidal":
        x, y = spec.length / 2, spec.width / 2
        return _hips(spec, (x, y, x, y), (min(x, y) + spec.overhang) * spec.slope)
    if spec.kind == "flat" and spec.parapet > 0.0 and spec.overhang <= 0.0:
        return _parapet(spec)
    return _extruded(spec, SECTIONS[spec.kind](spec.width, spec.eaves, spec.slope))


def rectangle(x0: float, y0: float, x1: float, y1: float, z: float) -> Ring:
    """A horizontal rectangle, counter-clockwise from above."""
    return [(x0, y0, z), (x1, y0, z), (x1, y1, z), (x0, y1, z)]


def _parapet(spec: RoofSpec) -> Roof:
    length, width, floor, top = spec.length, spec.width, spec.eaves, spec.eaves + spec.parapet
    thick = min(_PARAPET, 0.2 * min(length, width))
    inner = (thick, thick, length - thick, width - thick)
    low, high = rectangle(*inner, floor), rectangle(*inner, top)
    coping = Face("RoofSurface", "coping", rectangle(0.0, 0.0, length, width, top), [high[::-1]])
    faces = [Face("RoofSurface", "flat", low), coping]
    for a in range(4):
        b = (a + 1) % 4
        faces.append(Face("WallSurface", "parapet", [low[b], low[a], high[a], high[b]]))
    return Roof(_level_tops(spec, top), faces, top, 0, 0, lambda _x, _y: floor)


def _extruded(spec: RoofSpec, section: Border) -> Roof:
    """A roof with a constant section along x; the underside runs from front to back wall."""
    over = 0.0 if spec.kind in _NO_OVERHANG else spec.overhang
    thick = spec.thickness if over > 0.0 else 0.0
    verge = spec.verge if over > 0.0 else 0.0
    under = [_beyond(section[1], section[0], over), *section[1:-1]]
    under.append(_beyond(section[-2], section[-1], over))
    top = [(y, z + thick) for y, z in under]
    x0, x1 = -verge, spec.length + verge
    faces = [_slope(x0, x1, a, b) for a, b in pairwise(top)]
    gable = section
    if over > 0.0:
        faces.append(Face("RoofSurface", "fascia", _strip(x0, x1, under[0], top[0])))
        faces.append(Face("RoofSurface", "fascia", _strip(x0, x1, top[-1], under[-1])))
    if verge > 0.0:
        faces += _verges(x0, x1, under, top) + _soffits(spec, section, under, verge)
    elif over > 0.0:
        gable = [section[0], under[0], *top, under[-1], section[-1]]
        ends = ((section[0], under[0]), (under[-1], section[-1]))
        faces += [Face("OuterCeilingSurface", "soffit", _strip(x0, x1, *end)) for end in ends]
    (y0, z0), (y1, z1) = top[-2:]
    rise = (z1 - z0) / (y1 - y0)
    return Roof(
        _tops(spec, section, gable),
        faces,
        max(z for _, z in top),
        0,
        len(top) - 2,
        lambda _x, y: z0 + (y - y0) * rise,
    )


def _slope(x0: float, x1: float, a: tuple[float, float], b: tuple[float, float]) -> Face:
    """A roof face between two lines; vertical between saw-teeth."""
    if a[0] == b[0]:
        return Face("WallSurface", "riser", _strip(x0, x1, a, b))
    return Face("RoofSurface", "slope", _strip(x0, x1, a, b))


def _hipped(spec: RoofSpec) -> Roof:
    """Four equal slopes: a ridge along the longer side, or an apex over a square."""
    half = min(spec.length, spec.width) / 2
    length, width = max(spec.length - spec.width, 0.0), max(spec.width - spec.length, 0.0)
    ridge = (half, half, half + length, half + width)
    return _hips(spec, ridge, (half + spec.overhang) * spec.slope)


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
        0,
        2,
        lambda _x, y: eaves + (back - y) * rise / reach,
    )


def _beyond(
    inside: tuple[float, float], at: tuple[float, float], over: float
) -> tuple[float, float]:
    """End of a section, extended along its slope by a horizontal distance."""
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


def _soffits(spec: RoofSpec, section: Border, under: Border, verge: float) -> list[Face]:
    """Underside of the overhang on all four sides."""
    length, x0, x1 = spec.length, -verge, spec.length + verge
    if len(section) == 2:
        outer = _strip(x0, x1, under[1], under[0])
        return [Face("OuterCeilingSurface", "soffit", outer, [_strip(0.0, length, *section)])]
    rings: list[Ring] = []
    # Around the lower end of the first and of the last slope it is U-shaped.
    for eave, bend, wall, a, b in (
        (under[0], under[1], section[0], 0.0, length),
        (under[-1], under[-2], section[-1], length, 0.0),
    ):
        outside_a, outside_b = (x0, x1) if a < b else (x1, x0)
        rings.append(
            [
                (outside_a, *bend),
                (a, *bend),
                (a, *wall),
                (b, *wall),
                (b, *bend),
                (outside_b, *bend),
                (outside_b, *eave),
                (outside_a, *eave),
            ]
        )
    for low, high in pairwise(section[1:-1]):
        rings += [_strip(x0, 0.0, high, low), _strip(length, x1, high, low)]
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
