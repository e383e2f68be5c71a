"""Wooden poles along roads, and the wires between neighbours."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from envgen_usd.chunks import chunk_at, snap
from envgen_usd.city.city_scene import Scene
from envgen_usd.city.feature_ids import ncname
from envgen_usd.city.headings import heading_of
from envgen_usd.city.plots.roadside_rows import row_places
from envgen_usd.city.road_plan import RoadPlan
from envgen_usd.models.array_types import BoolArray, FloatArray
from envgen_usd.models.city_model import CityObject, Placement
from envgen_usd.models.road_surface import RoadLine
from envgen_usd.seeds import generator

POLE = "utility_pole"
"""Template of the poles."""
POLE_HEIGHT = 8.0
"""Height of a pole, metres."""
WIRE = "wire"
"""Template of the wires of a span."""
WIRE_FEET = ((-0.9, 7.58), (0.9, 7.58), (0.12, 6.7), (0.12, 6.2))
"""Where wires are fixed to a pole: metres to the left of its front, and above its foot."""
SAGS = (0.02, 0.02, 0.016, 0.014)
"""Sag of each wire at midspan as a share of its span; a larger value hangs lower."""
_CHORDS = 10
"""Chords of a wire; more follow the curve closer (0.2 % of the sag for 10)."""
_CLEARANCE = 0.25
"""Least distance of a pole from every road surface, metres; a larger value places fewer poles."""
_REACH = 1.5
"""Spans beyond a chunk in which its wires may end."""
# SIG3D code list CityFurniture_function: pole, other.
_POLE, _OTHER = "1270", "1540"


@dataclass(frozen=True)
class _Row:
    """Rules of a row of poles; see `RowRules`."""

    spacing: tuple[float, float]
    jitter: float = 0.05
    offset: tuple[float, float] = (0.5, 0.8)
    sides: str = "one"


@dataclass(frozen=True)
class _Pole:
    """A pole: its place along the row, its foot (3), and its heading along the road."""

    number: int
    foot: FloatArray
    heading: float


def place_utility_lines(scene: Scene, spacing: float) -> tuple[CityObject, ...]:
    """Returns the poles and the wires of a chunk as ``CityFurniture``.

    A line runs along a side of a road; it depends on the seed and the roads alone, so that all
    chunks agree. Wires hang between neighbouring poles, as curves; those of a span belong to the
    chunk of its first pole.

    Args:
        scene: Scene of the chunk; motorways and roads within junctions get no poles.
        spacing: Metres between poles; 0 for none.
    """
    if spacing <= 0.0:
        return ()
    rules = _Row((0.9 * spacing, 1.1 * spacing))
    reach = _REACH * rules.spacing[1]
    features: list[CityObject] = []
    for line in scene.roads.lines_near(scene.chunk.bounds, max(rules.offset) + reach):
        if not line.junction and not line.is_motorway:
            features += _along(line, rules, scene, reach)
    return tuple(features)


def _along(line: RoadLine, rules: _Row, scene: Scene, reach: float) -> Iterator[CityObject]:
    """The poles of a road in the chunk, and the wires that leave them."""
    name = ncname(line.road)
    poles = _poles(line, rules, scene, reach)
    for index, pole in enumerate(poles):
        if chunk_at(pole.foot) != scene.chunk:
            continue
        placement = Placement(pole.foot, pole.heading, np.array([0.0, 0.0, POLE_HEIGHT]), POLE)
        yield CityObject(
            f"{POLE}_{name}_{pole.number}",
            "CityFurniture",
            {"class": "1000", "function": _POLE, "height": POLE_HEIGHT},
            placement=placement,
        )
        after = poles[index + 1] if index + 1 < len(poles) else None
        if after is not None and after.number == pole.number + 1:
            yield CityObject(
                f"{WIRE}_{name}_{pole.number}",
                "CityFurniture",
                {"class": "1000", "function": _OTHER, "template": WIRE},
                curves={"lod2MultiCurve": _wires(pole, after)},
            )


def _poles(line: RoadLine, rules: _Row, scene: Scene, reach: float) -> list[_Pole]:
    """The poles of a road near the chunk, in order, clear of all roads."""
    draws = generator(scene.seed, "city", POLE, line.road)
    places = list(row_places(line, rules, draws, scene.chunk, reach))
    if not places:
        return []
    points = snap(np.array([place.position for place in places]))
    feet = np.column_stack([points, snap(scene.ground.heights(points))])
    return [
        # The front looks along the road, so that the arm lies across it.
        _Pole(int(place.number[:-1]), foot, _turned(place.heading))
        for place, foot, blocked in zip(places, feet, _on_roads(points, scene), strict=True)
        if not blocked
    ]


def _turned(heading: float) -> float:
    return heading_of(np.array([np.cos(heading + np.pi / 2), np.sin(heading + np.pi / 2)]))


def _on_roads(points: FloatArray, scene: Scene) -> BoolArray:
    """Mask of the points (N x 2) on any road, also outside of the chunk."""
    low, high = points.min(axis=0), points.max(axis=0)
    bounds = (float(low[0]), float(low[1]), float(high[0]), float(high[1]))
    return RoadPlan(scene.roads.triangles_near(bounds, 1.0)).near(points, _CLEARANCE)


def _wires(first: _Pole, second: _Pole) -> tuple[FloatArray, ...]:
    """The wires between two poles, each N x 3."""
    fixed = np.stack([_fixings(pole) for pole in (first, second)], axis=1)
    return tuple(
        snap(catenary(start, end, sag, _CHORDS))
        for (start, end), sag in zip(fixed, SAGS, strict=True)
    )


def _fixings(pole: _Pole) -> FloatArray:
    """Where wires are fixed to a pole, W x 3."""
    left = np.array([-np.sin(pole.heading), np.cos(pole.heading), 0.0])
    feet = np.array(WIRE_FEET)
    fixings: FloatArray = pole.foot + feet[:, :1] * left + feet[:, 1:] * [0.0, 0.0, 1.0]
    return fixings


def catenary(start: FloatArray, end: FloatArray, sag: float, chords: int) -> FloatArray:
    """Returns points of a wire that hangs between two points.

    Its parameter is that of a level wire with the sag, a = L / (8 sag) to second order; the lowest
    point follows from the difference in height.

    Args:
        start: 3, metres; not above or below `end`.
        end: 3, metres.
        sag: Sag at midspan as a share of the level span.
        chords: Number of chords.

    Returns:
        (chords + 1) x 3, evenly spaced in plan.
    """
    span, rise = float(np.hypot(*(end - start)[:2])), float(end[2] - start[2])
    a = span / (8.0 * sag)
    lowest = span / 2 - a * np.arcsinh(rise / (2 * a * np.sinh(span / (2 * a))))
    share = np.linspace(0.0, 1.0, chords + 1)
    height = a * (np.cosh((share * span - lowest) / a) - np.cosh(lowest / a))
    wire: FloatArray = start + share[:, None] * (end - start)
    wire[:, 2] = start[2] + height
    wire[-1] = end
    return wire
