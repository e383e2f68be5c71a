"""Solids of the traffic spaces that have no centre line to give them one."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from envgen_usd.city.roads.area_solids import area_solids
from envgen_usd.city.roads.traffic_solids import clearance
from envgen_usd.models.city_model import CityObject
from envgen_usd.models.polygon_arrays import Polygons
from envgen_usd.models.road_surface import KERBS

_SOLID = "lod2Solid"


def with_solids(spaces: Sequence[CityObject]) -> list[CityObject]:
    """Returns traffic spaces with the solids above their areas.

    An area that is too narrow for a valid solid, as the closed gap between two lanes, belongs to
    the neighbouring space with which it shares most of its corners. Kerbs have no space above.

    Args:
        spaces: Spaces of a section or an intersection; those with a solid keep it.
    """
    flat = [n for n, space in enumerate(spaces) if _SOLID not in space.geometry and _is_flat(space)]
    areas = [spaces[n].surfaces[0].polygons for n in flat]
    heights = [clearance(str(spaces[n].attributes["opendrive_lane_type"])) for n in flat]
    raised = dict(zip(flat, area_solids(areas, heights), strict=True)) if flat else {}
    complete = list(spaces)
    for n, solid in raised.items():
        if solid is not None:
            complete[n] = replace(spaces[n], geometry={**spaces[n].geometry, _SOLID: solid})
    narrow = [n for n, solid in raised.items() if solid is None and not spaces[n].curves]
    whole = [n for n, space in enumerate(complete) if _SOLID in space.geometry and space.surfaces]
    for n in narrow:
        host = _neighbour(complete[n], [complete[other] for other in whole])
        if host is not None:
            place = whole[host]
            surfaces = (*complete[place].surfaces, *complete[n].surfaces)
            complete[place] = replace(complete[place], surfaces=surfaces)
            complete[n] = replace(complete[n], surfaces=())
    return [space for space in complete if space.surfaces or space.curves]


def _is_flat(space: CityObject) -> bool:
    """Returns whether a space has an area that is no kerb."""
    kinds = {surface.attributes.get("opendrive_kind") for surface in space.surfaces}
    return bool(kinds) and not kinds <= KERBS


def _neighbour(space: CityObject, others: Sequence[CityObject]) -> int | None:
    """Returns the place of the space that shares most corners, `None` if none shares any."""
    corners = _corners(space.surfaces[0].polygons)
    shared = [len(corners & _corners(other.surfaces[0].polygons)) for other in others]
    best = int(np.argmax(shared)) if shared else 0
    return best if shared and shared[best] else None


def _corners(polygons: Polygons) -> set[tuple[float, ...]]:
    return set(map(tuple, polygons.points.tolist()))
