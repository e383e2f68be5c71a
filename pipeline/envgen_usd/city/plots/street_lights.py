"""Street lights beside the roads."""

from collections.abc import Iterator

import numpy as np

from envgen_usd.chunks import Chunk, chunk_at, snap
from envgen_usd.city.city_scene import Scene
from envgen_usd.city.feature_ids import ncname
from envgen_usd.geometry.square_index import are_near
from envgen_usd.models.array_types import BoolArray, FloatArray, IntArray
from envgen_usd.models.city_model import CityObject, Placement
from envgen_usd.models.environment_profile import StreetLightRules
from envgen_usd.models.road_surface import RoadLine
from envgen_usd.seeds import generator

_CLEARANCE = 0.25
"""Least distance of a mast from every road surface and object, metres.

A larger value places fewer lights.
"""
_FUNCTION = "1150"
"""SIG3D code list CityFurniture_function: street lamp."""


def place_street_lights(scene: Scene, rules: StreetLightRules) -> tuple[CityObject, ...]:
    """Returns the street lights of a chunk as ``CityFurniture``.

    The lights of a road depend only on the seed and the road, which spaces them evenly across
    chunks. Lights on another road or on an existing object are left out.

    Args:
        scene: Scene of the chunk; roads within junctions get no lights.
        rules: Spacing, sides and sizes of the environment.
    """
    lights = []
    for line in scene.roads.lines_near(scene.chunk.bounds, max(rules.offset)):
        if line.junction:
            continue
        for name, place, heading, height in _lights(line, rules, scene):
            if chunk_at(place) == scene.chunk:
                lights.append((name, place, heading, height))
    if not lights:
        return ()
    points = snap(np.array([place for _, place, _, _ in lights]))
    heights = snap(scene.ground.heights(points))
    blocked = scene.road.near(points, _CLEARANCE) | scene.taken.near(points, _CLEARANCE)
    return tuple(
        _feature(name, np.append(points[i], heights[i]), heading, height)
        for i, (name, _, heading, height) in enumerate(lights)
        if not blocked[i]
    )


def _lights(
    line: RoadLine, rules: StreetLightRules, scene: Scene
) -> Iterator[tuple[str, FloatArray, float, float]]:
    """Name, place (2), heading and height of each light of a road that may stand in the chunk."""
    draws = generator(scene.seed, "city", "street_lights", line.road)
    name = ncname(line.road)
    spacing, first, coin = draws.uniform(*rules.spacing), draws.random(), draws.random() < 0.5
    # Alternating lights have the spacing on each side.
    step = spacing / 2 if rules.sides == "alternating" else spacing
    count = int(line.s[-1] / step) + 1
    jitter = rules.jitter * spacing * draws.uniform(-1.0, 1.0, (count, 2))
    offsets = draws.uniform(*rules.offset, (count, 2))
    height = round(float(draws.uniform(*rules.height)), 2)
    index, side = _sides(rules.sides, count, int(coin))
    s = (index + first) * step + jitter[index, side]
    chosen = (s >= 0.0) & (s <= line.s[-1]) & _near(line, s, rules, scene.chunk)
    for number, where, at in zip(index[chosen], side[chosen], s[chosen], strict=True):
        place, heading = _beside(line, at, where, float(offsets[number, where]))
        yield f"street_light_{name}_{number}{'lr'[where]}", place, heading, height


def _sides(rule: str, count: int, coin: int) -> tuple[IntArray, IntArray]:
    """Number of each light along the road, and its side: 0 left, 1 right."""
    index = np.arange(count)
    if rule == "both":
        return np.repeat(index, 2), np.tile([0, 1], count)
    return index, (index + coin) % 2 if rule == "alternating" else np.full(count, coin)


def _near(line: RoadLine, s: FloatArray, rules: StreetLightRules, chunk: Chunk) -> BoolArray:
    """Whether what stands beside a road at each s may stand in a chunk."""
    plan = np.column_stack([np.interp(s, line.s, line.points[:, axis]) for axis in (0, 1)])
    reach = float(np.abs([line.t_left, line.t_right]).max(initial=0.0)) + max(rules.offset)
    return are_near(plan, chunk.bounds, reach)


def _beside(line: RoadLine, s: float, side: int, offset: float) -> tuple[FloatArray, float]:
    x, y = (np.interp(s, line.s, line.points[:, axis]) for axis in (0, 1))
    along = float(np.interp(s, line.s, np.unwrap(line.heading)))
    t = np.interp(s, line.s, line.t_left) + offset
    if side == 1:
        t = np.interp(s, line.s, line.t_right) - offset
    place = np.array([x - t * np.sin(along), y + t * np.cos(along)])
    # The arm reaches over the road.
    towards = along - np.pi / 2 if side == 0 else along + np.pi / 2
    return place, float(np.arctan2(np.sin(towards), np.cos(towards)))


def _feature(name: str, position: FloatArray, heading: float, height: float) -> CityObject:
    return CityObject(
        id=name,
        kind="CityFurniture",
        attributes={"class": "1000", "function": _FUNCTION, "height": height},
        placement=Placement(
            position, round(heading, 6), np.array([0.0, 0.0, height]), "street_light"
        ),
    )
