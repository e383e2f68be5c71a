"""Street lights beside the roads."""

from collections.abc import Iterator

import numpy as np

from envgen_usd.chunks import CHUNK_SIZE, Chunk, snap
from envgen_usd.city.names import ncname
from envgen_usd.city.scene import Scene
from envgen_usd.models.arrays import FloatArray
from envgen_usd.models.city import CityObject, Placement
from envgen_usd.models.profile import StreetLightRules
from envgen_usd.models.surface import RoadLine
from envgen_usd.seeds import generator

_CLEARANCE = 0.25
"""Least distance of a mast from every road surface and all that stands, metres."""
_FUNCTION = "1150"
"""SIG3D code list CityFurniture_function: street lamp."""


def place_street_lights(scene: Scene, rules: StreetLightRules) -> tuple[CityObject, ...]:
    """Returns the street lights that stand in a chunk as ``CityFurniture``.

    All lights of a road are drawn from the seed and the road alone, so that a road which passes
    through several chunks is lit evenly. Lights that would stand on another road, or where
    something stands already, are left out.

    Args:
        scene: The chunk; roads within junctions get no lights.
        rules: The environment's spacing, sides and sizes.
    """
    lights = []
    for line in scene.surface.roads:
        if line.junction or not _near(line, scene.chunk):
            continue
        for name, place, heading, height in _lights(line, rules, scene.seed):
            if Chunk(int(place[0] // CHUNK_SIZE), int(place[1] // CHUNK_SIZE)) == scene.chunk:
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


def _near(line: RoadLine, chunk: Chunk) -> bool:
    reach = max(float(np.abs([line.t_left, line.t_right]).max(initial=0.0)), 0.0) + 10.0
    low, high = line.points[:, :2].min(axis=0), line.points[:, :2].max(axis=0)
    x0, y0, x1, y1 = chunk.bounds
    return bool(
        high[0] >= x0 - reach
        and high[1] >= y0 - reach
        and low[0] <= x1 + reach
        and low[1] <= y1 + reach
    )


def _lights(
    line: RoadLine, rules: StreetLightRules, seed: int
) -> Iterator[tuple[str, FloatArray, float, float]]:
    """Name, place (2), heading and height of each light of a road."""
    draws = generator(seed, "city", "street_lights", line.road)
    name = ncname(line.road)
    spacing, first, coin = draws.uniform(*rules.spacing), draws.random(), draws.random() < 0.5
    # Lights that alternate stand on each side at the spacing of that side.
    step = spacing / 2 if rules.sides == "alternating" else spacing
    count = int(line.s[-1] / step) + 1
    jitter = rules.jitter * spacing * draws.uniform(-1.0, 1.0, (count, 2))
    offsets = draws.uniform(*rules.offset, (count, 2))
    height = round(float(draws.uniform(*rules.height)), 2)
    for index in range(count):
        for side in _sides(rules.sides, index, coin):
            s = (index + first) * step + jitter[index, side]
            if 0.0 <= s <= line.s[-1]:
                place, heading = _beside(line, s, side, float(offsets[index, side]))
                yield f"street_light_{name}_{index}{'lr'[side]}", place, heading, height


def _sides(rule: str, index: int, coin: bool) -> tuple[int, ...]:
    """Sides of the index-th light: 0 left, 1 right."""
    if rule == "both":
        return (0, 1)
    return ((index + coin) % 2,) if rule == "alternating" else (int(coin),)


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
