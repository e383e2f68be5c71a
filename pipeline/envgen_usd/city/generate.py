"""The city of a chunk: roads, buildings, street furniture, vegetation."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import shapely

from envgen_usd.chunks import Chunk
from envgen_usd.city.buildings.level_of_detail import FINEST_MODELLING, Modelling
from envgen_usd.city.city_scene import Scene
from envgen_usd.city.footprints import Footprints
from envgen_usd.city.ground_heights import Ground
from envgen_usd.city.land_features import make_land
from envgen_usd.city.plots.building_placement import Buildings, find_gates, place_buildings
from envgen_usd.city.plots.building_plans import PlannedBuilding, plan_buildings
from envgen_usd.city.plots.enclosed_plots import Enclosed
from envgen_usd.city.plots.enclosures import enclosed_uses, place_enclosures
from envgen_usd.city.plots.flower_beds import place_flower_beds
from envgen_usd.city.plots.garden_contents import place_garden_contents
from envgen_usd.city.plots.given_buildings import Standing, chunk_of
from envgen_usd.city.plots.harbour_cranes import crane_ground, is_crane, place_cranes
from envgen_usd.city.plots.orchards import place_orchards
from envgen_usd.city.plots.paved_ways import forecourts, pave
from envgen_usd.city.plots.quay_copings import place_copings
from envgen_usd.city.plots.quays import place_quays
from envgen_usd.city.plots.squares import place_squares
from envgen_usd.city.plots.street_furniture import place_street_furniture
from envgen_usd.city.plots.street_lights import place_street_lights
from envgen_usd.city.plots.street_trees import place_street_trees
from envgen_usd.city.plots.trees import place_trees
from envgen_usd.city.plots.utility_lines import place_utility_lines
from envgen_usd.city.plots.yards import place_yards
from envgen_usd.city.road_plan import RoadPlan
from envgen_usd.city.roads.file_features import (
    in_chunk,
    near_chunk,
    replaced_issues,
    without_replaced,
)
from envgen_usd.city.roads.road_index import RoadIndex
from envgen_usd.city.roads.road_model import make_roads
from envgen_usd.errors import Issue
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.city_model import City, CityObject
from envgen_usd.models.environment_profile import Profile
from envgen_usd.models.ground import GroundMesh, HeightMap
from envgen_usd.models.landuse import LanduseMap, Plot

_MARGIN = 30.0
"""Margin around a chunk in which the road affects its objects, metres.

A larger value includes more road.
"""


@dataclass(frozen=True)
class CityPlan:
    """Positions in and around a chunk that its landuse and its city have in common.

    Attributes:
        scene: Scene of the chunk.
        near: Plots that touch the chunk.
        of_file: Features of the road file in and around the chunk.
        given: Buildings that replace generated ones, or `None`.
        buildings: Planned buildings in and around the chunk; none where buildings are given.
        replaced: Issues of the buildings of the road file that given buildings replace.
    """

    scene: Scene
    near: tuple[Plot, ...]
    of_file: tuple[CityObject, ...]
    given: Standing | None
    buildings: tuple[PlannedBuilding, ...]
    replaced: tuple[Issue, ...] = ()


def plan_city(  # noqa: PLR0913, PLR0917 - one input for each layer
    chunk: Chunk,
    plots: Sequence[Plot],
    roads: RoadIndex,
    heightmap: HeightMap,
    profile: Profile,
    seed: int,
    neighbours: Iterable[HeightMap] = (),
    given: Standing | None = None,
    modelling: Modelling = FINEST_MODELLING,
) -> CityPlan:
    """Plans the buildings of a chunk.

    The result depends on no other chunk's result, so chunks can be planned in any order and in
    parallel.

    Args:
        chunk: Tile.
        plots: All plots in the chunk and around it.
        roads: All roads.
        heightmap: Ground of the chunk.
        profile: The environment.
        seed: The user's seed.
        neighbours: Ground around the chunk, for buildings across its border; without it, heights at
            the border extend outwards.
        given: Buildings that replace generated buildings.
        modelling: Options of the building models.
    """
    road = RoadPlan(roads.triangles_near(chunk.bounds, _MARGIN))
    standing = Footprints([] if given is None else given.footprints)
    features = near_chunk(roads, chunk)
    of_file = tuple(without_replaced(standing, features))
    replaced = replaced_issues(features, of_file, roads, chunk)
    taken = standing.joined(of_file)
    ground, furnished = Ground(heightmap, neighbours), {} if given is None else given.furnished
    scene = Scene(chunk, roads, road, taken, ground, seed, modelling, furnished)
    near = tuple(plot for plot in plots if _touches(plot.polygon, chunk))
    planned = plan_buildings(scene, near, profile.buildings) if given is None else ()
    return CityPlan(scene, near, of_file, given, planned, replaced)


def pave_ways(plan: CityPlan, landuse: LanduseMap) -> LanduseMap:
    """Returns the landuse of a chunk with paved ways to the doors of its planned buildings.

    Narrow strips between road and plot are paved, too.

    Args:
        plan: Plan of the chunk.
        landuse: Landuse of the chunk.
    """
    given = () if plan.given is None else plan.given.enclosed
    plots = [*(each.plot for each in plan.buildings), *(each.plot for each in given)]
    gates = (*find_gates(plan.buildings), *(gate for each in given for gate in each.gates))
    return pave(landuse, (*gates, *forecourts(plots, plan.scene)), plan.scene)


def build_city(  # noqa: PLR0913 - what is left out is said by name
    plan: CityPlan,
    landuse: LanduseMap,
    profile: Profile,
    land: GroundMesh | None = None,
    *,
    walls: GroundMesh | None = None,
    roads: bool = True,
    generated: bool = True,
) -> City:
    """Returns all features of a chunk.

    These are its pieces of roads, and a building on each plot with its centroid in the chunk.
    Street lights, features of the file and trees follow.

    Args:
        plan: Plan of the chunk.
        landuse: Landuse of the chunk, with the ways of `pave_ways`.
        profile: The environment.
        land: Ground of the chunk, to include landuse and relief; or `None`.
        walls: Ground of the chunk whose quay walls get copings; or `None`.
        roads: True to include roads and the features of the road file.
        generated: False for buildings alone, without what is generated beside them.

    Returns:
        The city; its issues name parts of buildings without room, and replaced buildings.
    """
    scene = plan.scene
    chunk, surface = scene.chunk, scene.roads.surface
    buildings = (
        place_buildings(scene, plan.buildings)
        if plan.given is None
        else Buildings(plan.given.buildings, plan.given.footprints, _own(plan.given, chunk))
    )
    given = () if plan.given is None else plan.given.others
    objects = (*buildings.features, *given)
    if generated:
        scene = replace(scene, taken=scene.taken.joined(given))
        standing = None if plan.given is None else given
        ways = () if plan.given is None else plan.given.ways
        beside = _features_beside_roads(
            scene, plan.near, landuse, profile, buildings, standing, ways
        )
        objects = (*given, *beside)
    if roads:
        of_roads = make_roads(chunk, scene.roads, profile, seed=scene.seed)
        objects = (*of_roads, *in_chunk(plan.of_file, scene.roads, chunk), *objects)
    if walls is not None:
        objects = (*objects, *place_copings(walls))
    replaced = plan.replaced if roads else ()
    if land is not None:
        objects = (*objects, *make_land(land, landuse, profile))
    return City(objects, surface.crs, surface.offset, (*buildings.issues, *replaced))


def _features_beside_roads(  # noqa: PLR0913, PLR0917 - one input for each layer
    scene: Scene,
    near: Sequence[Plot],
    landuse: LanduseMap,
    profile: Profile,
    buildings: Buildings,
    standing: Sequence[CityObject] | None,
    ways: Sequence[shapely.Geometry],
) -> Iterator[CityObject]:
    """Buildings, and further objects in sequence on the remaining free ground."""
    yield from buildings.features
    scene = replace(scene, taken=Footprints([*scene.taken.shapes, *buildings.footprints]))
    poles = place_utility_lines(scene, profile.furniture.utility_pole)
    yield from poles
    scene = replace(scene, taken=scene.taken.joined(poles))
    lights = place_street_lights(scene, profile.street_lights, profile.main_street_lights)
    yield from lights
    scene = replace(scene, taken=scene.taken.joined(lights))
    benches = place_street_furniture(scene, profile.furniture)
    yield from benches
    scene = replace(scene, taken=scene.taken.joined(benches))
    squares = place_squares(scene, near, profile, standing)
    yield from squares
    scene = replace(scene, taken=Footprints([*scene.taken.joined(squares).shapes, *ways]))
    of_plots = _features_of_plots(scene, near, buildings, profile)
    yield from of_plots
    scene = replace(scene, taken=scene.taken.joined(of_plots))
    yards = place_yards(scene, landuse, near, profile.yard)
    yield from yards
    scene = replace(scene, taken=scene.taken.joined(yards))
    tracks = tuple(crane_ground(each) for each in standing or () if is_crane(each))
    if not tracks:
        cranes = place_cranes(scene, landuse, profile)
        yield from cranes.features
        tracks = cranes.tracks
    scene = replace(scene, taken=Footprints([*scene.taken.shapes, *tracks]))
    quays = place_quays(scene, landuse, profile.yard)
    yield from quays
    scene = replace(scene, taken=scene.taken.joined(quays))
    rows = place_street_trees(scene, buildings.footprints, profile.street_trees)
    yield from rows
    scene = replace(scene, taken=scene.taken.joined(rows))
    orchards = place_orchards(scene, landuse, profile)
    yield from orchards
    scene = replace(scene, taken=scene.taken.joined(orchards))
    yield from place_trees(scene, landuse, buildings.footprints, profile.trees)


def _features_of_plots(
    scene: Scene, near: Sequence[Plot], buildings: Buildings, profile: Profile
) -> tuple[CityObject, ...]:
    """Enclosures, and the contents of gardens on what they leave."""
    fenced = (each for each in buildings.enclosed if each.is_fenced)
    enclosed = (*fenced, *enclosed_uses(scene, near))
    enclosures = place_enclosures(scene, enclosed, near, profile.enclosures)
    scene = replace(scene, taken=scene.taken.joined(enclosures))
    planted = [each for each in buildings.enclosed if each.is_planted]
    beds = place_flower_beds(scene, planted, profile.gardens)
    scene = replace(scene, taken=scene.taken.joined(beds))
    gardens = place_garden_contents(scene, planted, near, profile)
    return (*enclosures, *beds, *gardens)


def _own(given: Standing, chunk: Chunk) -> tuple[Enclosed, ...]:
    """The given plots that belong to a chunk."""
    shapes = [shapely.Polygon(each.plot.polygon) for each in given.enclosed]
    own = (chunk_of(shape) == chunk for shape in shapes)
    return tuple(each for each, is_own in zip(given.enclosed, own, strict=True) if is_own)


def _touches(polygon: FloatArray, chunk: Chunk) -> bool:
    x0, y0, x1, y1 = chunk.bounds
    low, high = polygon.min(axis=0), polygon.max(axis=0)
    return bool(low[0] <= x1 and low[1] <= y1 and high[0] >= x0 and high[1] >= y0)
