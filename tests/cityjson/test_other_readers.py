"""What readers that others wrote see in a file of ours."""

import importlib.util
import subprocess
import sys

import numpy as np
import pytest

from envgen_usd.cityjson.write import write_cityjson
from envgen_usd.models.city_model import City, CityObject, Placement, ThematicSurface
from envgen_usd.models.polygon_arrays import Polygons

CORNERS = np.array([[x, y, z] for z in (0, 6) for y in (0, 8) for x in (0, 10)], dtype=float)
FACES = {
    "GroundSurface": [0, 2, 3, 1],
    "RoofSurface": [4, 5, 7, 6],
    "WallSurface": [0, 1, 5, 4],
}


@pytest.fixture
def written(tmp_path):
    surfaces = tuple(
        ThematicSurface(kind, kind, Polygons.of_rings([CORNERS[ring]]), 2, "plaster")
        for kind, ring in FACES.items()
    )
    area = ThematicSurface("area", "TrafficArea", Polygons.of_rings([CORNERS[[0, 1, 3]]]), 2)
    lane = CityObject(
        "lane", "TrafficSpace", surfaces=(area,), curves={"lod2MultiCurve": (CORNERS[:2],)}
    )
    tree = Placement(np.array([20.0, 0, 0]), 0.0, np.array([3.0, 3, 8]), "tree")
    features = (
        CityObject("b", "Building", {"storeysAboveGround": 2}, surfaces, solid_lod=2),
        CityObject("r", "Road", children=(CityObject("s", "Section", children=(lane,)),)),
        CityObject("t", "SolitaryVegetationObject", placement=tree),
    )
    path = tmp_path / "city.json"
    write_cityjson(City(features, "EPSG:25832", (691000.0, 5336000.0, 0.0)), path)
    return path


CJIO = """
import sys
from cjio import cityjson

with open(sys.argv[1]) as file:
    model = cityjson.CityJSON(file=file)
before = len(model.j["vertices"])
model.remove_duplicate_vertices()
model.remove_orphan_vertices()
types = sorted(item["type"] for item in model.j["CityObjects"].values())
print(model.get_epsg(), before - len(model.j["vertices"]), *types)
"""


def test_cjio(written):
    """In a process of its own, because importing cjio changes how `json` writes numbers."""
    if importlib.util.find_spec("cjio") is None:
        pytest.skip("cjio is not installed")

    command = [sys.executable, "-c", CJIO, str(written)]
    answer = subprocess.run(command, capture_output=True, text=True, check=True).stdout

    assert answer.split() == ["25832", "0", "Building", "Road", "SolitaryVegetationObject"]


def test_cityjson_lib(written):
    library = pytest.importorskip("cityjson_lib", reason="cityjson-lib is not installed")

    summary = library.CityModel.parse_document_bytes(written.read_bytes()).summary()

    assert summary.cityobject_count == 3
    assert summary.geometry_count == 4
    assert summary.geometry_template_count == 1
    assert summary.semantic_count == 5
    assert summary.extension_count == 0
