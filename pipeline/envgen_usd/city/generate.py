"""The city of one chunk: roads, buildings, street furniture, vegetation."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

from envgen_usd.chunks import Chunk
from envgen_usd.city.building import FINEST_MODELLING, Modelling
from envgen_usd.city.buildings import Buildings, find_gates, place_buildings
from envgen_usd.city.enclosures import place_enclosures
from envgen_usd.city.file_features import in_chunk, near_chunk, without_replaced
from envgen_usd.city.footprints import Footprints, footprint_of
from envgen_usd.city.given import chunk_of
from envgen_usd.city.ground import Ground
from envgen_usd.city.land import make_land
from envgen_usd.city.obstacles import RoadPlan
from envgen_usd.city.roads import make_roads
from envgen_usd.city.scene import Scene
from envgen_usd.city.street_furniture import place_street_furniture
from envgen_usd.city.street_lights import place_street_lights
from envgen_usd.city.trees import place_trees
from envgen_usd.city.ways import pave
from envgen_usd.models.arrays import FloatArray
from envgen_usd.models.city import City, CityObject
from envgen_usd.models.ground import GroundMesh, HeightMap
from envgen_usd.models.landuse import LanduseMap, Plot
from envgen_usd.models.profile import Profile
from envgen_usd.models.surface import RoadSurface

_MARGIN = 30.0
"""Metres around a chunk in which the road matters to what stands in it."""


@dataclass(frozen=True)
class CityDetail:
    """What the city of a chunk is to hold.

    Attributes:
        modelling: How buildings are modelled.
        roads: True if roads and the features of the road file are a part of it.
    """

    modelling: Modelling = FINEST_MODELLING
    roads: bool = True


_DEFAULT = CityDetail()


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
    given: Iterable[CityObject] | None = None,
    detail: CityDetail = _DEFAULT,
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
        given: Buildings in the chunk and around it that stand in place of generated ones.
        detail: What the city is to hold.
    """
    road = RoadPlan(surface, chunk.bounds, _MARGIN)
    standing = None if given is None else tuple(given)
    of_file = without_replaced(standing or (), near_chunk(surface.furniture, chunk))
    taken = Footprints([]).joined((*(standing or ()), *of_file))
    ground = Ground(heightmap, neighbours)
    scene = Scene(chunk, surface, road, taken, ground, seed, detail.modelling)
    objects = tuple(_things(scene, plots, landuse, profile, standing))
    if detail.roads:
        roads = make_roads(chunk, surface, profile)
        objects = (*roads, *in_chunk(of_file, surface, chunk), *objects)
    if land is not None:
        objects = (*objects, *make_land(land, landuse, profile))
    return City(objects, surface.crs, surface.offset)


def pave_ways(  # noqa: PLR0913, PLR0917 - one input for each layer
    chunk: Chunk,
    plots: Sequence[Plot],
    surface: RoadSurface,
    heightmap: HeightMap,
    landuse: LanduseMap,
    profile: Profile,
    seed: int,
) -> LanduseMap:
    """Returns the landuse of a chunk with paved ways to the doors of its buildings.

    Args:
        chunk: The tile.
        plots: As for `build_city`, which then has to get this landuse.
        surface: All roads.
        heightmap: Ground of the chunk.
        landuse: Landuse of the chunk.
        profile: The environment.
        seed: The user's seed.
    """
    road = RoadPlan(surface, chunk.bounds, _MARGIN)
    taken = Footprints([]).joined(near_chunk(surface.furniture, chunk))
    scene = Scene(chunk, surface, road, taken, Ground(heightmap), seed)
    near = [plot for plot in plots if _touches(plot.polygon, chunk)]
    return pave(landuse, find_gates(scene, near, profile.buildings), scene)


def _things(
    scene: Scene,
    plots: Sequence[Plot],
    landuse: LanduseMap,
    profile: Profile,
    given: Sequence[CityObject] | None,
) -> Iterator[CityObject]:
    """Buildings, and what is placed one after the other where room is left."""
    near = [plot for plot in plots if _touches(plot.polygon, scene.chunk)]
    buildings = (
        place_buildings(scene, near, profile.buildings)
        if given is None
        else _given(given, scene.chunk)
    )
    yield from buildings.features
    scene = replace(scene, taken=Footprints([*scene.taken.shapes, *buildings.footprints]))
    lights = place_street_lights(scene, profile.street_lights)
    yield from lights
    scene = replace(scene, taken=scene.taken.joined(lights))
    benches = place_street_furniture(scene, profile.furniture)
    yield from benches
    scene = replace(scene, taken=scene.taken.joined(benches))
    enclosures = place_enclosures(scene, buildings.enclosed, near, profile.enclosures)
    yield from enclosures
    scene = replace(scene, taken=scene.taken.joined(enclosures))
    yield from place_trees(scene, landuse, buildings.footprints, profile.trees)


def _given(buildings: Iterable[CityObject], chunk: Chunk) -> Buildings:
    """Given buildings; those in the chunk become features of it."""
    shapes = [(building, footprint_of(building)) for building in buildings]
    features = tuple(building for building, shape in shapes if chunk_of(shape) == chunk)
    return Buildings(features, tuple(shape for _, shape in shapes), ())


def _touches(polygon: FloatArray, chunk: Chunk) -> bool:
    x0, y0, x1, y1 = chunk.bounds
    low, high = polygon.min(axis=0), polygon.max(axis=0)
    return bool(low[0] <= x1 and low[1] <= y1 and high[0] >= x0 and high[1] >= y0)
