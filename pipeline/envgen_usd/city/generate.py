"""The city of one chunk: roads, buildings, street furniture, vegetation."""

from collections.abc import Iterable, Sequence

import numpy as np

from envgen_usd.chunks import CHUNK_SIZE, Chunk
from envgen_usd.city.buildings import place_buildings
from envgen_usd.city.chunk_pieces import ChunkPieces
from envgen_usd.city.enclosures import place_enclosures
from envgen_usd.city.ground import Ground
from envgen_usd.city.land import make_land
from envgen_usd.city.obstacles import RoadPlan
from envgen_usd.city.road_links import with_controls
from envgen_usd.city.roads import make_roads
from envgen_usd.city.scene import Scene
from envgen_usd.city.street_furniture import place_street_furniture
from envgen_usd.city.street_lights import place_street_lights
from envgen_usd.city.trees import place_trees
from envgen_usd.models.arrays import FloatArray
from envgen_usd.models.city import City, CityObject
from envgen_usd.models.ground import GroundMesh, HeightMap
from envgen_usd.models.landuse import LanduseMap, Plot
from envgen_usd.models.profile import Profile
from envgen_usd.models.surface import RoadSurface

_MARGIN = 30.0
"""Metres around a chunk in which the road matters to what stands in it."""


def build_city(  # noqa: PLR0913, PLR0917 - one input for each layer
    chunk: Chunk,
    plots: Sequence[Plot],
    surface: RoadSurface,
    heightmap: HeightMap,
    landuse: LanduseMap,
    profile: Profile,
    seed: int,
    neighbours: Iterable[HeightMap] = (),
    land: GroundMesh | None = None,
) -> City:
    """Returns everything that belongs to a chunk.

    That are the parts of roads in it, a building on each plot whose centroid lies in it, and the
    street lights, the features of the file and the trees that stand in it. The result depends on
    no other chunk's result, so chunks can be built in any order and in parallel.

    Args:
        chunk: The tile.
        plots: All plots in the chunk and around it.
        surface: All roads.
        heightmap: Ground of the chunk.
        landuse: Landuse of the chunk.
        profile: The environment.
        seed: The user's seed.
        neighbours: Ground around the chunk, for buildings that reach over its border; where it is
            missing, the height at the border holds on.
        land: Ground of the chunk, if landuse and relief are to be a part of the city.
    """
    road = RoadPlan(surface, chunk.bounds, _MARGIN)
    scene = Scene(chunk, surface, road, Ground(heightmap, neighbours), seed)
    near = [plot for plot in plots if _touches(plot.polygon, chunk)]
    buildings = place_buildings(scene, near, profile.buildings)
    lights = place_street_lights(scene, profile.street_lights)
    furniture = (*_furniture(surface, chunk), *place_street_furniture(scene, profile.furniture))
    enclosures = place_enclosures(scene, buildings.enclosed, near, profile.enclosures)
    taken = _places((*lights, *furniture))
    trees = place_trees(scene, landuse, buildings.footprints, taken, profile.trees)
    roads = make_roads(chunk, surface, profile)
    objects = (*roads, *buildings.features, *lights, *furniture, *enclosures, *trees)
    if land is not None:
        objects = (*objects, *make_land(land, landuse, profile))
    return City(objects, surface.crs, surface.offset)


def _furniture(surface: RoadSurface, chunk: Chunk) -> tuple[CityObject, ...]:
    """Features of the file that stand in the chunk, with the lanes that they regulate there."""
    here = [feature for feature in surface.furniture if _place_in(feature, chunk)]
    if not here:
        return ()
    pieces = ChunkPieces(surface)
    names = {
        lane.id: pieces.lane_name(lane, chunk)
        for lane in surface.lanes
        if any(tile == chunk for tile, _ in pieces.runs(lane))
    }
    return with_controls(here, surface, names)


def _touches(polygon: FloatArray, chunk: Chunk) -> bool:
    x0, y0, x1, y1 = chunk.bounds
    low, high = polygon.min(axis=0), polygon.max(axis=0)
    return bool(low[0] <= x1 and low[1] <= y1 and high[0] >= x0 and high[1] >= y0)


def _place(feature: CityObject) -> FloatArray | None:
    """Where a feature stands, 3; none where it has no geometry."""
    if feature.placement is not None:
        return feature.placement.position
    shapes = [*feature.geometry.values(), *(surface.polygons for surface in feature.surfaces)]
    points = [shape.points for shape in shapes if len(shape)]
    points += [curve for curves in feature.curves.values() for curve in curves]
    return np.concatenate(points).mean(axis=0) if points else None


def _place_in(feature: CityObject, chunk: Chunk) -> bool:
    place = _place(feature)
    if place is None:
        return False
    return Chunk(*np.floor(place[:2] / CHUNK_SIZE).astype(int).tolist()) == chunk


def _places(features: Iterable[CityObject]) -> FloatArray:
    """Places of features in plan, N x 2."""
    found = [_place(feature) for feature in features]
    places: FloatArray = np.array([place[:2] for place in found if place is not None])
    return places.reshape(-1, 2)
