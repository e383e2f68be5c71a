"""The roads of a whole map as a city of their own, as r:trân makes it."""

import numpy as np

from envgen_usd.city.road_links import with_controls
from envgen_usd.city.roads import make_roads
from envgen_usd.city.traffic_spaces import RoadDetail
from envgen_usd.models.city import City
from envgen_usd.models.profile import Profile
from envgen_usd.models.surface import RoadSurface

FULL_DETAIL = RoadDetail(solids=True, lines=True)
"""All that CityGML holds of a road."""


def build_road_city(
    surface: RoadSurface, profile: Profile, detail: RoadDetail = FULL_DETAIL
) -> City:
    """Returns the roads of a map with their furniture, uncut.

    Args:
        surface: All roads.
        profile: Colours and materials.
        detail: What is written besides surfaces and centre lines.
    """
    known = {lane.id for lane in surface.lanes} | {thing.id for thing in surface.furniture}
    known |= {surface.patches[index].id for index in np.unique(surface.triangle_patch).tolist()}
    furniture = with_controls(
        surface.furniture, surface, lambda name: name if name in known else ""
    )
    return City(
        (*make_roads(None, surface, profile, detail), *furniture), surface.crs, surface.offset
    )
