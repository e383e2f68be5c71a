"""Fences as rows of panels, and gates between their ends: placements of assets."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import shapely

from envgen_usd.chunks import snap
from envgen_usd.city.ground_heights import Ground
from envgen_usd.city.headings import heading_of
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.attribute_values import Attribute
from envgen_usd.models.city_model import AVENUE, ENCLOSURE, CityObject, Placement

_PANEL = 2.5
"""Usual length of a panel, metres; a larger value stretches the boards of the asset less."""
_LEAST_PANEL = 0.4
"""Least length of a panel, metres; a larger value leaves more corners open."""
_BEND = 0.1
"""Largest distance of a bent line from its chords, metres; larger values give fewer panels."""
_DIGITS = 3
# SIG3D code list CityFurniture_function: fence.
_FENCE = "1440"


def fence_panels(
    plot: str, lines: Sequence[FloatArray], height: float, ground: Ground
) -> tuple[CityObject, ...]:
    """Returns the panels of a plot's fence, equally long along each straight run.

    Panels follow the slope of the ground. They share a key of choice, so that all have a design.

    Args:
        plot: Id of the plot.
        lines: Lines of the fence, N_i x 2, metres.
        height: Height above the ground, metres.
        ground: Heights of the ground.
    """
    starts, ends = [], []
    for line in lines:
        corners = shapely.get_coordinates(shapely.LineString(line).simplify(_BEND))
        for start, end in pairwise(corners):
            length = float(np.hypot(*(end - start)))
            if length >= _LEAST_PANEL:
                share = np.linspace(0.0, 1.0, max(round(length / _PANEL), 1) + 1)[:, None]
                places = start + share * (end - start)
                starts.append(places[:-1])
                ends.append(places[1:])
    if not starts:
        return ()
    pairs = np.stack([np.concatenate(starts), np.concatenate(ends)], axis=1)
    facts: dict[str, Attribute] = {"function": _FENCE, "height": height, AVENUE: f"fence_{plot}"}
    land = ground.heights(pairs.reshape(-1, 2)).reshape(-1, 2)
    return tuple(
        CityObject(
            f"fence_{plot}_{number}",
            "CityFurniture",
            facts,
            placement=_between(pair, land[number], height, "fence"),
        )
        for number, pair in enumerate(pairs)
    )


def gate_feature(  # noqa: PLR0913, PLR0917 - what a gate follows from
    name: str, plot: str, enclosure: str, posts: FloatArray, height: float, ground: Ground
) -> CityObject:
    """Returns the gate between two posts.

    Args:
        name: Id of the feature.
        plot: Id of the plot; a gate shares the key of choice of the plot's fence.
        enclosure: Kind of the enclosure: a gate in a fence has the fence's design.
        posts: 2 x 2, metres; the street lies to the right of the way from the first to the second.
        height: Height above the ground, metres.
        ground: Heights of the ground.
    """
    facts: dict[str, Attribute] = {
        "function": _FENCE,
        "height": height,
        AVENUE: f"fence_{plot}",
        ENCLOSURE: enclosure,
    }
    placement = _between(posts, ground.heights(posts), height, "gate")
    return CityObject(name, "CityFurniture", facts, placement=placement)


def _between(ends: FloatArray, land: FloatArray, height: float, template: str) -> Placement:
    """Placement of what reaches between two points on the land and looks to the right."""
    along = ends[1] - ends[0]
    level, rise = float(np.hypot(*along)), float(land[1] - land[0])
    position = snap(np.append(ends.mean(axis=0), land.mean()))
    length = round(float(np.hypot(level, rise)), _DIGITS)
    # Its y runs along the fence, so that x looks to the right of it.
    heading = heading_of(np.array([along[1], -along[0]]))
    roll = round(float(np.arctan2(rise, level)), 6)
    return Placement(position, heading, np.array([0.0, length, height]), template, roll=roll)
