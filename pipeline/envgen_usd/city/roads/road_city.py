"""The roads of a whole map as a separate city, as in r:trân."""

import numpy as np

from envgen_usd.city.roads.feature_relations import with_controls
from envgen_usd.city.roads.file_objects import file_object
from envgen_usd.city.roads.road_index import UNCUT, RoadIndex
from envgen_usd.city.roads.road_model import make_roads
from envgen_usd.city.roads.traffic_spaces import RoadDetail
from envgen_usd.models.city_model import City
from envgen_usd.models.environment_profile import Profile
from envgen_usd.models.road_surface import RoadSurface

FULL_DETAIL = RoadDetail(solids=True, lines=True)
"""All content of roads that CityGML can hold."""


def build_road_city(
    surface: RoadSurface, profile: Profile, detail: RoadDetail = FULL_DETAIL, seed: int = 0
) -> City:
    """Returns the roads of a map with the features beside them, uncut.

    Args:
        surface: All roads.
        profile: Colours and materials.
        detail: Content besides surfaces and centre lines.
        seed: The user's seed.
    """
    roads = RoadIndex(surface, cut=False)
    known = {lane.id for lane in surface.lanes} | {feature.id for feature in surface.features}
    known |= {surface.patches[index].id for index in np.unique(surface.triangle_patch).tolist()}
    features = with_controls(
        [file_object(feature) for feature in surface.features],
        surface.lanes,
        roads.abreast,
        lambda name: name if name in known else "",
    )
    return City(
        (*make_roads(UNCUT, roads, profile, detail, seed), *features), surface.crs, surface.offset
    )
