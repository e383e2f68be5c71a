"""Every figure of an environment file has an effect: a figure that nothing reads fails here."""

import dataclasses
import hashlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import cache
from itertools import chain, zip_longest
from pathlib import Path
from typing import get_args

import numpy as np
import pytest
import shapely
from shapely import LineString
from tests.traffic.parked_streets import EVERY_FIGURE, every_place

from envgen_usd.assets.asset_catalogue import Catalogue, read_catalogue
from envgen_usd.assets.variant_choice import choose
from envgen_usd.chunks import HEIGHT_SAMPLES, Chunk
from envgen_usd.city.city_scene import Scene
from envgen_usd.city.footprints import Footprints
from envgen_usd.city.ground_heights import Ground
from envgen_usd.city.plots.building_placement import place_buildings
from envgen_usd.city.plots.building_plans import plan_buildings
from envgen_usd.city.plots.enclosures import place_enclosures
from envgen_usd.city.plots.flower_beds import place_flower_beds
from envgen_usd.city.plots.garden_contents import place_garden_contents
from envgen_usd.city.plots.harbour_cranes import place_cranes
from envgen_usd.city.plots.quays import place_quays
from envgen_usd.city.plots.squares import place_squares
from envgen_usd.city.plots.street_furniture import place_street_furniture
from envgen_usd.city.plots.street_lights import place_street_lights
from envgen_usd.city.plots.street_trees import place_street_trees
from envgen_usd.city.plots.trees import place_trees
from envgen_usd.city.plots.utility_lines import place_utility_lines
from envgen_usd.city.plots.yards import place_yards
from envgen_usd.city.road_plan import RoadPlan
from envgen_usd.city.roads.road_index import RoadIndex
from envgen_usd.city.roads.road_model import make_roads
from envgen_usd.city.roads.street_materials import street_materials
from envgen_usd.environment_files import read_profile
from envgen_usd.geometry.road_outline import Outline
from envgen_usd.landuse.field_lattice import fields_of
from envgen_usd.landuse.land_layout import LandDrawing
from envgen_usd.landuse.landuse_rules import RuleProvider, lay_out
from envgen_usd.landuse.outer_land import outer_land
from envgen_usd.layers.materials_layer import write_materials
from envgen_usd.layers.prop_distributions import distributions
from envgen_usd.layers.sill_strips import with_sill_strips
from envgen_usd.models.building_rules import BarnRules
from envgen_usd.models.city_model import CityObject
from envgen_usd.models.environment_profile import (
    FurnitureRules,
    GardenRules,
    MainStreetLightRules,
    Profile,
    YardRules,
)
from envgen_usd.models.ground import HeightMap
from envgen_usd.models.land_rules import Centre, SquareRules, Use
from envgen_usd.models.landuse import LanduseClass, LanduseMap, Plot
from envgen_usd.models.place import Streets
from envgen_usd.models.road import RoadNetwork
from envgen_usd.models.road_surface import Patch, RoadSurface
from envgen_usd.opendrive.geometry.raised_sidewalks import with_raised_sidewalks
from envgen_usd.opendrive.reader import read_network
from envgen_usd.opendrive.surface import build_surface
from envgen_usd.places.street_roads import road_text
from envgen_usd.seeds import generator
from envgen_usd.terrain.heightmaps import build_heightmaps
from envgen_usd.terrain.water_levels import lower_water
from envgen_usd.traffic.standing.street_life import place_actors

CHUNK = Chunk(0, 0)
NEXT = Chunk(1, 1)
SEED = 2
AWAY = np.linspace(0.0, 60.0, 255 * 255).reshape(255, 255)
"""Distances from a road of cells, metres."""
HOUSES: dict[str, str] = {}
"""Hashes of houses by those of their plans: a figure changes the plans of a few."""
PLAIN = (str, float, int)
"""Types whose values are hashed as text; a union would be made anew for each value."""
Parts = Callable[[Profile], Iterator[str]]
"""What follows from a table, hash by hash; the next is made if those before are unchanged."""
LANE = (
    '<lane id="{id}" type="{type}"><width sOffset="0" a="{width}" b="0" c="0" d="0"/>{mark}</lane>'
)
BROKEN = '<roadMark sOffset="0" type="broken" weight="{weight}" color="standard"/>'
ROAD = """
<road id="{id}" length="180" junction="-1">
  <type s="0" type="{type}"/>
  <planView><geometry s="0" x="10" y="{y}" hdg="0" length="180"><line/></geometry></planView>
  <lanes><laneSection s="0">
    <left>{left}</left>
    <center><lane id="0" type="none">{centre}</lane></center>
    <right>{right}</right>
  </laneSection></lanes>
</road>"""


def write_road(folder: Path, walk: float = 2.0) -> Path:
    """A street with sidewalks and a motorway, whose marks have neither widths nor lines."""

    def lanes(side: int, border: str) -> str:
        driving = LANE.format(id=side, type="driving", width=3.5, mark=BROKEN.format(weight="bold"))
        return driving + LANE.format(id=2 * side, type=border, width=walk, mark="")

    roads = [
        ROAD.format(
            id=number,
            type=kind,
            y=y,
            left=lanes(1, border),
            centre=BROKEN.format(weight="standard"),
            right=lanes(-1, border),
        )
        for number, (kind, y, border) in enumerate(
            [("town", 100, "sidewalk"), ("motorway", 180, "shoulder")]
        )
    ]
    path = folder / "roads.xodr"
    path.write_text(f"<OpenDRIVE><header/>{''.join(roads)}</OpenDRIVE>", encoding="utf-8")
    return path


def write_block(folder: Path) -> Path:
    """Streets around a block with room for lanes and rows inside."""
    corners = [(0, 0), (300, 0), (300, 300), (0, 300), (0, 0)]
    lines = [LineString(corners[number : number + 2]) for number in range(4)]
    sizes, unknown = np.full(4, 8.0), np.full(4, np.nan)
    streets = Streets(np.array(lines, object), sizes, np.ones(4, bool), unknown, unknown)
    path = folder / "block.xodr"
    path.write_text(road_text(streets), encoding="utf-8")
    return path


@cache
def full_profile() -> Profile:
    """An environment in which all that can be there is there, so that each figure counts."""
    profile = read_profile("2", "residential")
    buildings, details = profile.buildings, profile.buildings.details
    shares = (field.name for field in dataclasses.fields(details) if field.type == "float")
    details = replace(
        details,
        gable_windows=0.6,
        footprints=dict.fromkeys(("rectangle", "l", "t", "u"), 1.0),
        embrasure=(0.05, 0.2),
        **dict.fromkeys(shares, 0.5),
    )
    buildings = replace(
        buildings,
        width=(9.5, 13.0),
        setback=(3.0, 5.0),
        side_setback=(0.5, 1.5),
        storeys=(2.0, 4.0),
        roofs={"flat": 1.0, "shed": 0.5, "gabled": 2.0, "hipped": 2.0},
        chimney=0.5,
        materials={"flagstone": 1.0, "brick_red": 1.0},
        roof_materials={"roof_slate": 1.0, "roof_shingles": 1.0},
        flat_roof_materials={"bitumen": 1.0, "gravel": 1.0},
        doors=replace(buildings.doors, sill=(0.05, 0.15), spacing=(4.0, 6.0)),
        details=details,
        # As small as the gardens behind these houses.
        barns=BarnRules(
            share=0.95,
            width=(6.0, 9.0),
            depth=(4.0, 6.5),
            materials={"wood": 1.0, "sheet_metal": 3.0},
            roof_materials={"sheet_metal_roof": 1.0, "roof_tiles_weathered": 1.0},
        ),
    )
    plots = replace(
        profile.plots,
        frontage=(13.0, 17.0),
        gap=(3.0, 6.0),
        group=(2.0, 4.0),
        occupancy=0.8,
        wood=0.3,
    )
    # Rare variants, e.g. police cars, would need thousands of draws.
    props = {
        kind: replace(
            rule,
            variants={
                name: {variant: max(weight, 0.2) for variant, weight in weights.items()}
                for name, weights in rule.variants.items()
            },
        )
        for kind, rule in profile.props.items()
    }
    return replace(
        profile,
        props=props,
        plots=plots,
        road=replace(
            profile.road,
            materials={"asphalt": 1.0, "asphalt_old": 1.0},
            sidewalk_materials={"paving": 1.0, "paving_asphalt": 1.0},
            kerb_materials={"curb_stone": 1.0, "curb_concrete": 1.0},
        ),
        buildings=buildings,
        # The sidewalks are 2 m wide: too narrow for pits, until the figure changes.
        street_trees=replace(profile.street_trees, share=1.0, pit_width=15.0),
        main_street_lights=wide_road_lights(profile),
        furniture=FurnitureRules(
            **{field.name: 30.0 for field in dataclasses.fields(FurnitureRules)}
        ),
        enclosures=replace(
            profile.enclosures,
            gate=2.5,
            kinds=dict.fromkeys(("none", "hedge", "fence", "wall"), 1.0),
            materials={
                "hedge": {"grass": 1.0, "grass_lush": 1.0},
                "wall": {"flagstone": 1.0, "concrete": 1.0},
            },
        ),
        terrain=replace(profile.terrain, relief=3.0),
        yard=YardRules(container=4.0, pallets=10.0, silo=3.0, cranes=60.0),
        gardens=GardenRules(flower_beds=0.5, terraces=0.5, sheds=0.5, clothes_lines=0.5),
        blocks=replace(
            profile.blocks,
            inner=0.7,
            uses=dict.fromkeys(get_args(Use), 1.0),
            falloff=1.0,
            outer_rows=2,
        ),
        squares=SquareRules(
            share=0.4,
            centres=dict.fromkeys(get_args(Centre), 1.0),
            trees=11.0,
            lamps=16.0,
            benches=12.0,
            planters=13.0,
            bollards=14.0,
        ),
        actors=EVERY_FIGURE,
    )


def wide_road_lights(profile: Profile) -> MainStreetLightRules:
    """Lights of roads that are wider than those of the tests, but not ten times as wide.

    Sidewalks are too narrow for lights at their kerb, until the figure changes.
    """
    main = profile.main_street_lights
    assert main is not None
    designs = {"design": {"new_york": 1.0, "twin": 1.0}, "finish": {"grey": 1.0, "black": 1.0}}
    return replace(main, width=14.0, kerb_width=15.0, variants=designs)


def lights_of_wide_roads(scene: Scene, profile: Profile) -> tuple[CityObject, ...]:
    """Street lights where every road is wide."""
    main = profile.main_street_lights
    assert main is not None
    return place_street_lights(scene, profile.street_lights, replace(main, width=0.0))


def make_plots() -> list[Plot]:
    """Plots for enough houses that each weight and share decides about some of them."""
    corners = np.array([[0.0, 0.0], [15.0, 0.0], [15.0, 30.0], [0.0, 30.0]])
    places = [(2.0 + 16.0 * column, y) for y in (20.0, 108.0) for column in range(12)]
    outlines = [corners + np.array(place) for place in places]
    return [
        Plot(f"plot_{number}", outline, LanduseClass.LAWN, outline[:2], "0", side="left")
        for number, outline in enumerate(outlines)
    ]


def wide_plots() -> list[Plot]:
    """Plots with room for a square each."""
    corners = np.array([[0.0, 0.0], [30.0, 0.0], [30.0, 30.0], [0.0, 30.0]])
    places = [(12.0 + 31.0 * column, y) for y in (20.0, 120.0) for column in range(5)]
    outlines = [corners + np.array(place) for place in places]
    return [
        Plot(f"plot_{number}", outline, LanduseClass.SQUARE, outline[:2], "0", side="left")
        for number, outline in enumerate(outlines)
    ]


def figures(value: object, path: tuple[str | int, ...] = ()) -> Iterator[tuple[str | int, ...]]:
    """Paths of all numbers in an environment; single weights, which decide nothing, left out."""
    if isinstance(value, float | int) and not isinstance(value, bool):
        yield path
    elif isinstance(value, tuple):
        for place, item in enumerate(value):
            yield from figures(item, (*path, place))
    elif isinstance(value, Mapping):
        numbers = [item for item in value.values() if isinstance(item, float)]
        for key, item in value.items():
            if len(numbers) != 1:
                yield from figures(item, (*path, key))
    elif dataclasses.is_dataclass(value):
        for field in dataclasses.fields(value):
            yield from figures(getattr(value, field.name), (*path, field.name))


def changed(value: object, path: tuple[str | int, ...], word: object = None) -> object:
    """The environment with another number, or a word, at a path."""
    if not path:
        if word is not None:
            return word
        assert isinstance(value, float | int)
        return value + 1 if isinstance(value, int) else value * 0.1
    first, rest = path[0], path[1:]
    if isinstance(value, tuple):
        low, high = value
        return (low * 0.6, high) if first == 0 else (low, high * 1.4)
    if isinstance(value, Mapping):
        return {**value, first: changed(value[first], rest, word)}
    return replace(value, **{str(first): changed(getattr(value, str(first)), rest, word)})  # type: ignore[type-var]


@cache
def field_names(kind: type) -> tuple[str, ...]:
    """Names of a dataclass's fields; empty for other types."""
    if not dataclasses.is_dataclass(kind):
        return ()
    return tuple(field.name for field in dataclasses.fields(kind))


def fingerprint(value: object) -> str:
    """Hash of nested dataclasses, mappings, sequences and arrays by their content."""
    parts: list[bytes] = []

    def add(item: object) -> None:
        if isinstance(item, PLAIN):
            parts.append(repr(item).encode())
        elif isinstance(item, np.ndarray):
            parts.append(item.tobytes())
        elif names := field_names(type(item)):
            for name in names:
                add(getattr(item, name))
        elif isinstance(item, Mapping):
            for key in sorted(item, key=str):
                parts.append(str(key).encode())
                add(item[key])
        elif isinstance(item, list | tuple):
            for part in item:
                add(part)
        else:
            parts.append(repr(item).encode())

    add(value)
    return hashlib.sha256(b"".join(parts)).hexdigest()


@cache
def catalogue() -> Catalogue:
    return read_catalogue()


def chosen(own: Profile, *kinds: str, count: int = 60) -> Iterator[str]:
    """What an environment chooses for kinds of props, 20 at a time."""
    known = distributions(own, catalogue())
    for first in range(0, count, 20):
        for kind in kinds:
            if kind in known:
                yield fingerprint(
                    [
                        choose(catalogue(), known[kind], generator(SEED, kind, number))
                        for number in range(first, first + 20)
                    ]
                )


def at_once(follows: Callable[[Profile], object]) -> Parts:
    """What follows from a table as a single part."""
    return lambda own: iter([fingerprint(follows(own))])


def with_choices(follows: Callable[[Profile], object], kind: str) -> Parts:
    """What follows from a table, and after it what is chosen for a kind."""
    return lambda own: chain(at_once(follows)(own), chosen(own, kind))


def terrain_parts(surface: RoadSurface, plots: list[Plot], landuse: LanduseMap) -> Parts:
    """Heights of the ground, also with a lake and with a harbour on it."""
    shores = (LanduseClass.GRASS, LanduseClass.QUAY)
    wet = [wet_land(landuse, shore) for shore in shores]

    def parts(own: Profile) -> Iterator[str]:
        heightmaps = build_heightmaps(surface, [CHUNK], own.terrain, SEED, plots=plots)
        yield fingerprint(heightmaps[CHUNK].heights)
        for each in wet:
            yield fingerprint(lower_water(heightmaps, {CHUNK: each}, own.terrain)[CHUNK])

    return parts


def wet_land(like: LanduseMap, shore: LanduseClass) -> LanduseMap:
    """Landuse of a chunk that is a shore around water."""
    classes = np.full_like(like.classes, shore)
    classes[90:160, 70:180] = LanduseClass.WATER
    return replace(like, classes=classes)


def with_park(landuse: LanduseMap) -> LanduseMap:
    """Landuse with a park in a corner."""
    classes = landuse.classes.copy()
    classes[:120, :120] = LanduseClass.PARK
    return replace(landuse, classes=classes)


@pytest.fixture(scope="module")
def outcomes(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Parts]:
    """For each table of the file: a function from an environment to what follows from the table."""
    layer = tmp_path_factory.mktemp("layers") / "materials.usda"
    network: RoadNetwork = read_network(write_road(tmp_path_factory.mktemp("road")))
    profile = full_profile()
    surface = build_surface(network)
    landuse = RuleProvider().generate(surface, [CHUNK], profile, SEED)[CHUNK]
    plots = make_plots()
    town = build_surface(read_network(write_block(tmp_path_factory.mktemp("block"))))
    # Rubble between the roads, enough for some of each kind.
    yards = replace(landuse, classes=np.full_like(landuse.classes, LanduseClass.RUBBLE))
    quays = replace(landuse, classes=np.full_like(landuse.classes, LanduseClass.QUAY))
    basin = wet_land(landuse, LanduseClass.QUAY)
    ground = Ground(HeightMap(CHUNK, np.zeros((HEIGHT_SAMPLES, HEIGHT_SAMPLES))))
    roads = RoadIndex(surface)
    road = RoadPlan(roads.triangles_near(CHUNK.bounds, 30.0))
    scene = Scene(CHUNK, roads, road, Footprints([]), ground, SEED)
    wide = read_network(write_road(tmp_path_factory.mktemp("wide"), 3.2))
    wide_scene = Scene(CHUNK, RoadIndex(build_surface(wide)), road, Footprints([]), ground, SEED)
    enclosed = place_buildings(scene, plan_buildings(scene, plots, profile.buildings)).enclosed
    busy = every_place(tmp_path_factory.mktemp("busy"))
    streets = [Patch(f"lane_{number}", "lane", "driving", str(number)) for number in range(60)]

    house = place_buildings(scene, plan_buildings(scene, plots, full_profile().buildings))
    walls = [
        surface.polygons
        for part in house.features[0].walk()
        for surface in part.surfaces
        if surface.kind == "WallSurface"
    ]

    def strips(own: Profile) -> list[object]:
        rng = generator(SEED, "sills")
        return [with_sill_strips(wall, own.wear.sills, rng)[1].tolist() for wall in walls]

    def houses(own: Profile) -> Iterator[str]:
        rows = replace(own.buildings, style="row", side_setback=(0.0, 0.0))
        for plan in chain(
            plan_buildings(scene, plots, own.buildings), plan_buildings(scene, plots, rows)
        ):
            key = fingerprint(plan)
            if key not in HOUSES:
                HOUSES[key] = fingerprint(place_buildings(scene, [plan]))
            yield HOUSES[key]

    def wear(own: Profile) -> Iterator[str]:
        write_materials(["asphalt", "plaster"], own.wear, catalogue(), layer)
        yield layer.read_text(encoding="utf-8")
        yield fingerprint(strips(own))

    def road_parts(own: Profile) -> Iterator[str]:
        yield fingerprint([street_materials(street, own.road, SEED) for street in streets])
        raised = with_raised_sidewalks(network, own.road.kerb_height)
        yield fingerprint(build_surface(raised, marks=own.road.marks).vertices)
        yield fingerprint(make_roads(CHUNK, roads, own))

    def land(own: Profile) -> Iterator[str]:
        yield fingerprint(RuleProvider().generate(surface, [CHUNK], own, SEED)[CHUNK])
        # The second has gaps, some of which are built on.
        yield fingerprint(RuleProvider().generate(town, [NEXT], own, SEED + 1)[NEXT])

    def blocks(own: Profile) -> Iterator[str]:
        drawing = LandDrawing(lay_out(town, own, SEED), Outline.of(town), own, SEED)
        yield from map(fingerprint, map(drawing.of, (CHUNK, Chunk(0, 1), Chunk(-1, 0))))
        yield fingerprint(shapely.get_coordinates(lay_out(surface, own, SEED).ends))
        # Along these streets plots take the land that is near; roads outside of towns have none.
        yield fingerprint(outer_land(fields_of(CHUNK, SEED), AWAY, own))

    def furniture(own: Profile) -> Iterator[str]:
        yield fingerprint(place_utility_lines(wide_scene, own.furniture.utility_pole))
        yield fingerprint(place_street_furniture(wide_scene, own.furniture))

    return {
        "wear": wear,
        "road": road_parts,
        "plots": land,
        "terrain": terrain_parts(surface, plots, landuse),
        "buildings": lambda p: chain(houses(p), chosen(p, "window", "door")),
        "trees": with_choices(
            lambda p: place_trees(scene, with_park(landuse), (), p.trees), "tree"
        ),
        "street_trees": with_choices(
            lambda p: place_street_trees(scene, (), p.street_trees), "street_tree"
        ),
        "street_lights": with_choices(
            lambda p: place_street_lights(scene, p.street_lights), "street_light"
        ),
        # The roads are narrower than the figure says, and wider than none.
        "main_street_lights": lambda p: chain(
            at_once(
                lambda own: place_street_lights(scene, own.street_lights, own.main_street_lights)
            )(p),
            with_choices(lambda own: lights_of_wide_roads(scene, own), "main_street_light")(p),
        ),
        "enclosures": at_once(lambda p: place_enclosures(scene, enclosed, plots, p.enclosures)),
        "gardens": lambda p: chain(
            at_once(lambda own: place_flower_beds(scene, enclosed, own.gardens))(p),
            at_once(lambda own: place_garden_contents(scene, enclosed, plots, own))(p),
        ),
        "blocks": blocks,
        "squares": lambda p: chain(
            at_once(lambda own: place_squares(scene, wide_plots(), own, None))(p),
            (fingerprint(lay_out(town, p, seed).landuse) for seed in range(4)),
        ),
        "yard": lambda p: chain(
            at_once(lambda own: place_yards(scene, yards, plots, own.yard))(p),
            at_once(lambda own: place_quays(scene, quays, own.yard))(p),
            at_once(lambda own: place_cranes(scene, basin, own).features)(p),
            chosen(p, "crane"),
        ),
        "furniture": furniture,
        "actors": lambda p: (fingerprint(place_actors(each, p.actors)[0]) for each in busy),
        # One table for each kind: to draw from all of them for each figure would take minutes.
        **{
            f"props.{kind}": lambda p, kind=kind: chosen(p, kind, count=200)
            for kind in {str(path[1]) for path in FIGURES if path[0] == "props"}
        },
    }


@pytest.fixture(scope="module")
def unchanged(outcomes: dict[str, Parts]) -> Callable[[str], list[str]]:
    return cache(lambda table: list(outcomes[table](full_profile())))


@pytest.fixture(scope="module")
def has_effect(
    outcomes: dict[str, Parts], unchanged: Callable[[str], list[str]]
) -> Callable[[str, Profile], bool]:
    """Whether anything that follows from a table differs in another environment."""

    def differs(table: str, other: Profile) -> bool:
        pairs = zip_longest(outcomes[table](other), unchanged(table))
        return any(new != usual for new, usual in pairs)

    return differs


FIGURES = list(figures(full_profile()))


def table_of(path: tuple[str | int, ...]) -> str:
    """Table of the file that a figure belongs to, e.g. ``props.car``."""
    return f"props.{path[1]}" if path[0] == "props" else str(path[0])


def test_figures_of_every_table_are_looked_at(
    outcomes: dict[str, Parts],
) -> None:
    assert {table_of(path) for path in FIGURES} == set(outcomes)
    assert len(FIGURES) > 90


@pytest.mark.parametrize("path", FIGURES, ids=lambda path: ".".join(map(str, path)))
def test_a_figure_has_an_effect(
    has_effect: Callable[[str, Profile], bool],
    path: tuple[str | int, ...],
) -> None:
    other = changed(full_profile(), path)
    assert isinstance(other, Profile)
    assert has_effect(table_of(path), other)


@pytest.mark.parametrize(
    ("path", "word"),
    [
        (("road", "marking_colour"), "white"),
        (("road", "materials"), {"asphalt_worn": 1.0}),
        (("road", "sidewalk_materials"), {"concrete": 1.0}),
        (("road", "kerb_materials"), {"concrete": 1.0}),
        (("plots", "landuse"), LanduseClass.RUBBLE),
        (("blocks", "borders"), "quay"),
        (("buildings", "style"), "hall"),
        (("buildings", "function"), "industrial"),
        (("street_lights", "sides"), "both"),
        (("main_street_lights", "sides"), "both"),
        (("street_trees", "sides"), "alternating"),
        (("enclosures", "materials", "hedge"), {"leaves": 1.0}),
        (("enclosures", "materials", "wall"), {"brick_red": 1.0}),
    ],
    ids=str,
)
def test_a_word_has_an_effect(
    has_effect: Callable[[str, Profile], bool],
    path: tuple[str, ...],
    word: object,
) -> None:
    other = changed(full_profile(), path, word)
    assert isinstance(other, Profile)
    assert has_effect(path[0], other)


def test_an_environment_that_is_read_again_changes_nothing(
    outcomes: dict[str, Parts], unchanged: Callable[[str], list[str]]
) -> None:
    """Without this, a difference would not say that a figure has an effect."""
    again = full_profile.__wrapped__()
    assert again is not full_profile()
    for table, outcome in outcomes.items():
        usual = unchanged(table)
        HOUSES.clear()
        assert list(outcome(again)) == usual
