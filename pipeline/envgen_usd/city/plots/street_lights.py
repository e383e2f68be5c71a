"""Street lights beside the roads."""

from collections.abc import Iterator

import numpy as np

from envgen_usd.chunks import chunk_at, snap
from envgen_usd.city.city_scene import Scene
from envgen_usd.city.feature_ids import ncname
from envgen_usd.city.plots.roadside_rows import row_places
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.city_model import CityObject, Placement
from envgen_usd.models.distribution import drawn
from envgen_usd.models.environment_profile import MainStreetLightRules, StreetLightRules
from envgen_usd.models.road_surface import RoadLine
from envgen_usd.seeds import generator

_CLEARANCE = 0.25
"""Least distance of a mast from every road surface and object, metres.

A larger value places fewer lights.
"""
FUNCTION = "1150"
"""SIG3D code list CityFurniture_function: street lamp."""
KIND, MAIN_KIND = "street_light", "main_street_light"
"""Templates of the placements: beside usual and beside wide roads."""


def place_street_lights(
    scene: Scene, rules: StreetLightRules, main: MainStreetLightRules | None = None
) -> tuple[CityObject, ...]:
    """Returns the street lights of a chunk as ``CityFurniture``.

    The lights of a road depend only on the seed and the road, which spaces them evenly across
    chunks. Lights on another road or on an existing object are left out.

    Args:
        scene: Scene of the chunk; roads within junctions get no lights.
        rules: Spacing, sides and sizes of the environment.
        main: Those of wide roads; `None` makes no difference between roads.
    """
    lights = []
    reach = max(*rules.offset, *(main.offset if main else ()))
    for line in scene.roads.lines_near(scene.chunk.bounds, reach):
        if line.junction or scene.has(KIND, line.road):
            continue
        own, kind = rules, KIND
        if main is not None and np.median(line.t_left - line.t_right) >= main.width:
            own, kind = main, MAIN_KIND
        for name, place, heading, height in _lights(line, own, scene):
            if chunk_at(place) == scene.chunk:
                lights.append((name, place, heading, height, kind))
    if not lights:
        return ()
    points = snap(np.array([place for _, place, *_ in lights]))
    heights = snap(scene.ground.heights(points))
    blocked = scene.road.near(points, _CLEARANCE) | scene.taken.near(points, _CLEARANCE)
    return tuple(
        _feature(name, np.append(points[i], heights[i]), heading, height, kind)
        for i, (name, _, heading, height, kind) in enumerate(lights)
        if not blocked[i]
    )


def _lights(
    line: RoadLine, rules: StreetLightRules, scene: Scene
) -> Iterator[tuple[str, FloatArray, float, float]]:
    """Name, place (2), heading and height of each light of a road that may stand in the chunk.

    The arm reaches over the road.
    """
    draws = generator(scene.seed, "city", "street_lights", line.road)
    name = ncname(line.road)
    places = list(row_places(line, rules, draws, scene.chunk))
    height = round(float(drawn(draws, rules.height)), 2)
    for place in places:
        yield f"street_light_{name}_{place.number}", place.position, place.heading, height


def _feature(
    name: str, position: FloatArray, heading: float, height: float, kind: str
) -> CityObject:
    return CityObject(
        id=name,
        kind="CityFurniture",
        attributes={"class": "1000", "function": FUNCTION, "height": height},
        placement=Placement(position, round(heading, 6), np.array([0.0, 0.0, height]), kind),
    )
