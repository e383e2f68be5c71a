"""Sets the buildings of a given city model onto the ground."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from envgen_usd.chunks import snap
from envgen_usd.city.footprints import footprint_of
from envgen_usd.city.plots.moved_city import shifted
from envgen_usd.errors import Issue, Severity
from envgen_usd.models.array_types import BoolArray, FloatArray
from envgen_usd.models.city_model import CityObject
from envgen_usd.models.ground import Heights

FLOATING = 0.5
"""Height of a building's foot above the ground that counts as an error, metres.

A larger value leaves more buildings above the ground.
"""
SUNKEN = 3.0
"""Depth of a building's foot below the ground that counts as an error, metres: a basement.

A larger value leaves more buildings in the ground.
"""


@dataclass(frozen=True)
class Levelled:
    """Buildings on the ground.

    Attributes:
        buildings: The buildings in the same order, some at another height.
        issues: What was moved, and how far.
    """

    buildings: tuple[CityObject, ...]
    issues: tuple[Issue, ...]


def set_down(
    buildings: Sequence[CityObject],
    ground: Heights,
    over_road: Callable[[shapely.Geometry], bool],
    *,
    each: bool,
) -> Levelled:
    """Returns buildings at the height of the ground.

    First all buildings move by the median of their distances to the ground, which is a difference
    of vertical datums. Then each building moves that still floats or is deep in the ground.

    Args:
        buildings: Buildings in the road frame, at least one.
        ground: Heights of the ground.
        over_road: True for a footprint over the road; such a building may float.
        each: False to move the model as a whole only, because the ground is a true one.
    """
    gaps = np.array([_gap(building, ground) for building in buildings])
    middle = float(np.median(gaps))
    shift = -float(snap(np.array(middle))) if abs(middle) > FLOATING else 0.0
    moves = np.full(len(buildings), shift)
    issues = [_whole(middle, len(buildings))] if shift else []
    gaps += shift
    floating = (gaps > FLOATING) & each
    for n in np.flatnonzero(floating).tolist():
        floating[n] = not over_road(footprint_of(buildings[n]))
    sunken = (gaps < -SUNKEN) & each
    for chosen, what in ((floating, "float above"), (sunken, "stand in")):
        if chosen.any():
            issues.append(_single(buildings, gaps, chosen, what))
    moves -= np.where(floating | sunken, snap(gaps), 0.0)
    return Levelled(
        tuple(
            shifted(building, np.array([0.0, 0.0, move])) if move else building
            for building, move in zip(buildings, moves.tolist(), strict=True)
        ),
        tuple(issues),
    )


def _gap(building: CityObject, ground: Heights) -> float:
    """Height of a building's lowest point above the lowest ground under it, metres."""
    points = np.concatenate([_finest(part) for part in building.walk()])
    return float(points[:, 2].min() - ground(points[:, :2]).min())


def _finest(part: CityObject) -> FloatArray:
    """Points of a part at its highest level of detail; a footprint may have no true height."""
    shapes = [
        *((surface.lod, surface.polygons) for surface in part.surfaces),
        *((_level(name), shape) for name, shape in part.geometry.items()),
    ]
    finest = max((lod for lod, shape in shapes if len(shape)), default=0)
    points = [shape.points for lod, shape in shapes if lod == finest]
    return np.concatenate([np.empty((0, 3)), *points])


def _level(name: str) -> int:
    return int(name[3]) if name.startswith("lod") else 0


def _whole(gap: float, count: int) -> Issue:
    side = "above" if gap > 0 else "below"
    text = f"the {count} buildings stand {abs(gap):.1f} m {side} the ground (median); a third "
    text += "number of --city-offset keeps the heights of the file"
    done = f"{'lowered' if gap > 0 else 'raised'} by {abs(gap):.1f} m"
    return Issue("city.ground_level", Severity.WARNING, "city", text, done)


def _single(
    buildings: Sequence[CityObject], gaps: FloatArray, chosen: BoolArray, what: str
) -> Issue:
    worst = int(np.argmax(np.where(chosen, np.abs(gaps), 0.0)))
    text = f"{chosen.sum()} of {len(buildings)} buildings {what} the ground, "
    text += f"up to {abs(gaps[worst]):.1f} m"
    where = f"Building[{buildings[worst].id}]"
    return Issue("city.off_ground", Severity.WARNING, where, text, "set onto the ground")
