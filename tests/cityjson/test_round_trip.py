import dataclasses
import json
from collections.abc import Mapping

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from envgen_usd.chunks import snap
from envgen_usd.cityjson.read import read_cityjson
from envgen_usd.cityjson.write import write_cityjson
from envgen_usd.models.city_model import City, CityObject, Placement, ThematicSurface
from envgen_usd.models.polygon_arrays import Polygons


def plain(model):
    """A model as nested lists, so that it can be compared."""
    if isinstance(model, np.ndarray):
        return model.shape, model.tolist()
    if dataclasses.is_dataclass(model):
        return {f.name: plain(getattr(model, f.name)) for f in dataclasses.fields(model)}
    if isinstance(model, Mapping):
        return {key: plain(value) for key, value in model.items()}
    if isinstance(model, tuple):
        return [plain(item) for item in model]
    return type(model), model


def again(city, folder):
    write_cityjson(city, folder / "city.json")
    return read_cityjson(folder / "city.json")


def ring(origin, *corners):
    """Corners in x and z, in the wall's plane y = 0."""
    return snap(np.array([(x, 0, z) for x, z in corners]) + np.array(origin))


def square(x, y, z):
    """A wall of 4 m by 4 m with a hole."""
    outer = ring((x, y, z), (0, 0), (4, 0), (4, 4), (0, 4))
    hole = ring((x, y, z), (1, 1), (1, 2), (2, 2), (2, 1))
    return Polygons(np.concatenate([outer, hole]), np.array([0, 4, 8]), np.array([0, 2]))


def window(name, x, y, z):
    pane = Polygons.of_rings([ring((x, y, z), (1, 1), (2, 1), (2, 2), (1, 2))])
    return ThematicSurface(name, "WindowSurface", pane, 3, "glass", {"sill": 1.0})


BUILDING = CityObject(
    "b1",
    "Building",
    attributes={"roofType": "1000", "storeysAboveGround": 3, "height": 9.25, "note": "Größe"},
    surfaces=(
        ThematicSurface(
            "b1_w",
            "WallSurface",
            square(1.001, 2.002, 3.003),
            3,
            "brick_red",
            openings=(window("b1_o", 1.001, 2.002, 3.003),),
        ),
        ThematicSurface("b1_r", "RoofSurface", square(0, 0, 9), 3, "roof_slate", {"pitch": 30}),
    ),
    solid_lod=3,
    geometry={"lod1Solid": square(0, 0, 0), "lod0MultiSurface": square(0, 0, 1)},
    children=(
        CityObject("b1_p", "BuildingPart", geometry={"lod2MultiSurface": square(5, 5, 5)}),
        CityObject("b1_s", "Storey", attributes={"function": "1"}),
    ),
)
ROAD = CityObject(
    "r1",
    "Road",
    attributes={"opendrive_road": "7"},
    children=(
        CityObject(
            "s1",
            "Section",
            surfaces=(
                ThematicSurface(
                    "m1", "Marking", square(9, 9, 0), 2, attributes={"colour": "white"}
                ),
            ),
            children=(
                CityObject(
                    "t1",
                    "TrafficSpace",
                    attributes={"speed": 13.89, "granularity": "lane"},
                    surfaces=(ThematicSurface("a1", "TrafficArea", square(0, 9, 0), 2, "asphalt"),),
                    curves={"lod2MultiCurve": (np.array([[0.0, 0, 0], [5, 0, 0.5], [9, 1, 1]]),)},
                    relations={"successor": ("t2", "t3")},
                ),
                CityObject(
                    "x1",
                    "AuxiliaryTrafficSpace",
                    surfaces=(ThematicSurface("k1", "AuxiliaryTrafficArea", square(4, 9, 0), 2),),
                    curves={"lod2MultiCurve": (np.array([[0.0, 3, 0], [5, 3, 0]]),)},
                ),
            ),
        ),
    ),
)
TREE = CityObject(
    "v1",
    "SolitaryVegetationObject",
    attributes={"height": 7.5},
    placement=Placement(
        np.array([10.5, 20.25, 1.125]), 1.25, np.array([3.0, 3.5, 7.5]), "tree", 0.1, -0.2
    ),
)
LIGHT = CityObject(
    "f1",
    "CityFurniture",
    placement=Placement(np.array([1.0, 2.0, 3.0]), -2.5, np.zeros(3), "street_light"),
    relations={"controls": ("t1",)},
)
OTHERS = (
    CityObject("i1", "Intersection", children=(CityObject("t9", "TrafficSpace"),)),
    CityObject("g1", "GenericLogicalSpace", geometry={"lod1Solid": square(0, 3, 0)}),
    CityObject("l1", "LandUse", geometry={"lod2MultiSurface": square(0, 5, 0)}),
    CityObject("d1", "TINRelief", geometry={"tin": square(0, 6, 0)}),
    CityObject(
        "q1", "Square", surfaces=(ThematicSurface("qa", "TrafficArea", square(0, 7, 0), 2),)
    ),
    CityObject("p1", "PlantCover", geometry={"lod1MultiSurface": square(0, 8, 0)}),
)


@pytest.mark.parametrize(
    "feature", [BUILDING, ROAD, TREE, LIGHT, *OTHERS], ids=lambda feature: feature.kind
)
def test_a_feature_comes_back_as_it_was(feature, tmp_path):
    city = City((feature,), "EPSG:25832", (691000.123, 5336000.456, 519.5))

    assert plain(again(city, tmp_path)) == plain(city)


coordinates = st.integers(-10_000_000, 10_000_000).map(lambda number: number / 1000)
points = st.tuples(coordinates, coordinates, coordinates)
values = st.one_of(
    st.text(), st.integers(-(2**53), 2**53), st.floats(allow_nan=False, allow_infinity=False)
)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.lists(st.lists(points, min_size=3, max_size=6), min_size=1, max_size=4),
    st.dictionaries(st.text(min_size=1).map(lambda name: f"a_{name}"), values),
    points,
)
def test_any_geometry_and_attribute_comes_back(tmp_path, rings, attributes, offset):
    polygons = Polygons.of_rings([snap(np.array(ring, dtype=float)) for ring in rings])
    surface = ThematicSurface("s", "WallSurface", polygons, 2, attributes=attributes)
    city = City((CityObject("b", "Building", attributes, (surface,), solid_lod=2),), "", offset)

    assert plain(again(city, tmp_path)) == plain(city)


def test_numbers_that_are_none_are_left_out(tmp_path):
    city = City((CityObject("b", "Building", {"height": float("nan"), "name": "x"}),))

    assert again(city, tmp_path).objects[0].attributes == {"name": "x"}


def test_a_relief_feature_gives_way_to_its_components(tmp_path):
    relief = CityObject("r", "ReliefFeature", children=(OTHERS[3],))

    assert plain(again(City((relief,)), tmp_path)) == plain(City((OTHERS[3],)))


def test_vertices_are_shared_and_lie_in_the_crs(tmp_path):
    city = City((BUILDING,), "EPSG:25832", (691000.0, 5336000.0, 500.0))
    write_cityjson(city, tmp_path / "city.json")

    file = json.loads((tmp_path / "city.json").read_text())

    places = np.array(file["vertices"])
    assert len(np.unique(places, axis=0)) == len(places)
    real = places * file["transform"]["scale"] + file["transform"]["translate"]
    extent = file["metadata"]["geographicalExtent"]
    np.testing.assert_allclose([*real.min(axis=0), *real.max(axis=0)], extent, atol=1e-6)
    assert file["metadata"]["referenceSystem"] == "https://www.opengis.net/def/crs/EPSG/0/25832"
