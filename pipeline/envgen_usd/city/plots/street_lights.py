"""Street lights beside the roads."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from envgen_usd.chunks import chunk_at, snap
from envgen_usd.city.city_scene import Scene
from envgen_usd.city.feature_ids import ncname
from envgen_usd.city.plots.kerb_places import WideSidewalk, at_kerb, wide_sidewalks
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
_KERB = 0.6
"""Distance of a mast from the kerb, metres: RASt 06 keeps 0.5 m beside carriageways free, and a
mast is up to 0.2 m thick. A larger value narrows the way of pedestrians."""
FUNCTION = "1150"
"""SIG3D code list CityFurniture_function: street lamp."""
KIND, MAIN_KIND = "street_light", "main_street_light"
"""Templates of the placements: beside usual and beside wide roads."""


def place_street_lights(
    scene: Scene, rules: StreetLightRules, main: MainStreetLightRules | None = None
) -> tuple[CityObject, ...]:
    """Returns the street lights of a chunk as ``CityFurniture``.

    The lights of a road depend only on the seed and the road, which spaces them evenly across
    chunks. They stand in the sidewalk, at the kerb, where the rules say that it is wide enough, and
    behind it otherwise. Lights on another road or on an existing object are left out.

    Args:
        scene: Scene of the chunk; roads within junctions get no lights.
        rules: Spacing, sides and sizes of the environment.
        main: Those of wide roads; `None` makes no difference between roads.
    """
    kinds = {KIND: rules} if main is None else {KIND: rules, MAIN_KIND: main}
    reach = max(max(each.offset) for each in kinds.values())
    kerbs = {kind: wide_sidewalks(scene, each.kerb_width, reach) for kind, each in kinds.items()}
    lights: list[_Light] = []
    for line in scene.roads.lines_near(scene.chunk.bounds, reach):
        if line.junction or scene.has(KIND, line.road):
            continue
        is_main = main is not None and np.median(line.t_left - line.t_right) >= main.width
        kind = MAIN_KIND if is_main else KIND
        lights += _lights(line, kinds[kind], kind, kerbs[kind].get(line.road, ()), scene)
    if not lights:
        return ()
    points = snap(np.array([light.position for light in lights]))
    heights = snap(scene.ground.heights(points))
    behind = ~np.array([light.at_kerb for light in lights])
    blocked = behind & scene.road.near(points, _CLEARANCE)
    blocked |= scene.taken.near(points, _CLEARANCE)
    return tuple(
        _feature(lights[i], np.append(points[i], heights[i]))
        for i in np.flatnonzero(~blocked).tolist()
    )


@dataclass(frozen=True)
class _Light:
    """A planned light: its place (2), and height in metres."""

    name: str
    position: FloatArray
    heading: float
    height: float
    kind: str
    at_kerb: bool


def _lights(
    line: RoadLine,
    rules: StreetLightRules,
    kind: str,
    sidewalks: Sequence[WideSidewalk],
    scene: Scene,
) -> Iterator[_Light]:
    """The lights of a road that may stand in the chunk; the arm reaches over the road."""
    draws = generator(scene.seed, "city", "street_lights", line.road)
    name = ncname(line.road)
    places = list(row_places(line, rules, draws, scene.chunk))
    height = round(float(drawn(draws, rules.height)), 2)
    for place in places:
        kerb = at_kerb(place, sidewalks, rules.kerb_width, max(rules.offset), _KERB)
        position = place.position if kerb is None else kerb
        if chunk_at(position) == scene.chunk:
            number = f"street_light_{name}_{place.number}"
            yield _Light(number, position, place.heading, height, kind, kerb is not None)


def _feature(light: _Light, position: FloatArray) -> CityObject:
    return CityObject(
        id=light.name,
        kind="CityFurniture",
        attributes={"class": "1000", "function": FUNCTION, "height": light.height},
        placement=Placement(
            position, round(light.heading, 6), np.array([0.0, 0.0, light.height]), light.kind
        ),
    )
