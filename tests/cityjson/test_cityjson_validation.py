"""Faults of CityJSON files, each seeded in a valid cube."""

import json

import numpy as np
import pytest

from envgen_usd.cityjson.cityjson_validation import cityjson_issues
from envgen_usd.errors import EnvgenError

FINEST = 100_000  # Units in a metre.
CORNERS = np.array([[x, y, z] for z in (0, 10) for y in (0, 10) for x in (0, 10)])
FACES = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [1, 3, 7, 5], [3, 2, 6, 7], [2, 0, 4, 6]]


class Model:
    """Collects vertices and objects of a file."""

    def __init__(self):
        self.vertices, self.objects = [], {}

    def cube(self, shift=(0, 0, 0), size=1.0, faces=FACES):
        """Polygons of a cube of 10 m."""
        first = len(self.vertices)
        moved = np.round((CORNERS * size + shift) * FINEST).astype(int)
        self.vertices += moved.tolist()
        return [[[first + corner for corner in face]] for face in faces]

    def cavity(self, shift, size):
        """Polygons of a cube that face its inside."""
        return [[ring[::-1] for ring in face] for face in self.cube(shift, size)]

    def add(self, name, kind, *geometries, lod="2.2", **more):
        """An object with geometries, each of a type and boundaries."""
        items = [
            {"type": shape, "lod": lod, "boundaries": boundaries}
            for shape, boundaries in geometries
        ]
        self.objects[name] = {"type": kind, "geometry": items, **more}

    def file(self, **more):
        return {
            "type": "CityJSON",
            "version": "2.0",
            "transform": {"scale": [1 / FINEST] * 3, "translate": [691000.0, 5336000.0, 520.0]},
            "CityObjects": self.objects,
            "vertices": self.vertices,
            **more,
        }


@pytest.fixture
def model():
    return Model()


@pytest.fixture
def faults(tmp_path, model):
    def check(**more):
        (tmp_path / "city.json").write_text(json.dumps(model.file(**more)))
        issues = cityjson_issues(tmp_path / "city.json")
        return [(issue.kind.removeprefix("iso19107."), issue.where) for issue in issues]

    return check


def test_a_cavity_is_no_second_piece(model, faults):
    model.add("b", "Building", ("Solid", [model.cube(), model.cavity((3, 3, 3), 0.4)]))

    assert faults() == []


@pytest.mark.parametrize(
    ("code", "shift", "size"),
    [
        ("401", (3, 3, 6.00001), 0.4),
        ("401", (3, 3, 6), 0.4),
        ("403", (23, 3, 3), 0.4),
        ("402", (0, 0, 0), 1),
    ],
)
def test_a_cavity_that_is_not_inside(model, faults, code, shift, size):
    model.add("b", "Building", ("Solid", [model.cube(), model.cavity(shift, size)]))

    assert faults() == [(code, "Building[b]")]


def test_a_cavity_that_faces_outwards(model, faults):
    model.add("b", "Building", ("Solid", [model.cube(), model.cube((3, 3, 3), 0.4)]))

    assert faults() == [("405", "Building[b]")]


@pytest.mark.parametrize(
    ("shape", "shift", "found"),
    [
        ("MultiSolid", (20, 0, 0), []),
        ("CompositeSolid", (10, 0, 0), []),
        ("CompositeSolid", (20, 0, 0), ["503"]),
        ("CompositeSolid", (9, 0, 0), ["501"]),
        ("CompositeSolid", (0, 0, 0), ["502"]),
        ("MultiSolid", (9, 0, 0), ["601"]),
    ],
)
def test_several_solids_in_one_geometry(model, faults, shape, shift, found):
    model.add("b", "Building", (shape, [[model.cube()], [model.cube(shift)]]))

    assert [code for code, _ in faults()] == found


def test_a_composite_surface_may_be_open_but_not_in_pieces(model, faults):
    model.add("open", "Building", ("CompositeSurface", model.cube(faces=FACES[:5])))
    model.add("loose", "Building", ("MultiSurface", model.cube(faces=FACES[:2])))
    model.add("pieces", "Building", ("CompositeSurface", model.cube(faces=FACES[:2])))

    assert faults() == [("305", "Building[pieces]")]


def test_parts_overlap_only_at_the_same_level(model, faults):
    model.add("b", "Building", ("Solid", [model.cube()]), children=["p", "q", "room"])
    inside = model.cube((2, 0, 0))
    model.add("p", "BuildingPart", ("Solid", [inside]), lod="1.2", parents=["b"])
    model.add("q", "BuildingPart", ("Solid", [inside]), lod="2.2", parents=["b"])
    model.add("room", "BuildingRoom", ("Solid", [inside]), parents=["b"])

    assert faults() == [("601", "BuildingPart[q]")]


def test_places_far_from_the_origin_are_valid_unless_they_are_far_from_the_others(model, faults):
    """At 10 million km, where coordinates have 3 decimals and a half."""
    far = (1e10, -1e10, 0)
    model.add("b", "Building", ("Solid", [model.cube(far)]))
    assert faults() == []

    model.add("c", "Building", ("Solid", [model.cube((0, 0, 0))]))
    model.add("d", "Building", ("Solid", [model.cube(far)]))
    assert faults() == [("901", "Building[c]")]


def test_each_level_of_an_object_is_checked(model, faults):
    broken, whole = model.cube(faces=FACES[:5]), model.cube()
    model.add("b", "Building", ("Solid", [broken]), lod="1.2")
    geometry = {"type": "Solid", "lod": "1.3", "boundaries": [whole]}
    model.objects["b"]["geometry"].append(geometry)

    assert faults() == [("302", "Building[b]")]


def test_the_surface_is_named(model, faults):
    model.add("b", "Building", ("Solid", [model.cube()]))
    model.vertices[0][2] += FINEST
    model.objects["b"]["geometry"][0]["semantics"] = {
        "surfaces": [{"type": "GroundSurface", "id": "floor"}, {"type": "WallSurface"}],
        "values": [[0, None, 1, 1, 1, 1]],
    }

    assert faults() == [("203", "GroundSurface[floor]")]


def templates(model, faces, size, mirror=1):
    """A template of a cube that a tree and a building place."""
    place = {
        "type": "GeometryInstance",
        "template": 0,
        "boundaries": [0],
        "transformationMatrix": [mirror * size, 0, 0, 0, 0, size, 0, 0, 0, 0, size, 0, 0, 0, 0, 1],
    }
    model.vertices.append([0, 0, 0])
    for name, kind in (("t", "SolitaryVegetationObject"), ("b", "Building")):
        model.objects[name] = {"type": kind, "geometry": [place]}
    solid = {"type": "Solid", "lod": "2", "boundaries": [[[face] for face in faces]]}
    return {"templates": [solid], "vertices-templates": (CORNERS / size).tolist()}


@pytest.mark.parametrize("mirror", [1, -1])
@pytest.mark.parametrize("size", [1.0, 1e4])
def test_a_template_is_checked_in_its_size_and_outwards_if_mirrored(model, faults, size, mirror):
    found = templates(model, FACES, size, mirror)
    del model.objects["t" if mirror < 0 else "b"]

    assert faults(**{"geometry-templates": found}) == []


def test_a_broken_template(model, faults):
    broken = templates(model, FACES[:5], 1.0)

    assert faults(**{"geometry-templates": broken}) == [("302", "template[0]")]


@pytest.mark.parametrize("broken", [[1], {"templates": [{}]}, {"vertices-templates": "x"}])
def test_templates_that_are_none(model, faults, broken):
    model.add("b", "Building", ("Solid", [model.cube()]))

    ((code, where),) = faults(**{"geometry-templates": broken})

    assert (code, "template" in where) == ("901", True)


def test_nothing_in_a_solid(model, faults):
    model.add("b", "Building", ("Solid", [[]]))
    model.add("c", "Building", ("Solid", [model.cube()]))

    assert ("902", "Building[b]") in faults()


def test_a_vertex_that_does_not_exist(model, faults):
    model.add("b", "Building", ("Solid", [model.cube()]))
    model.add("c", "Building", ("MultiSurface", [[[0, 1, 99]]]))

    assert faults() == [("city.feature", "c")]


def test_a_feature_of_a_sequence(tmp_path, model):
    first = model.file()
    model.add("b", "Building", ("Solid", [model.cube(faces=FACES[:5])]))
    feature = {
        "type": "CityJSONFeature",
        "id": "b",
        "CityObjects": model.objects,
        "vertices": model.vertices,
    }
    path = tmp_path / "city.jsonl"
    path.write_text("\n".join(json.dumps(part) for part in ({**first, "CityObjects": {}}, feature)))

    (issue,) = cityjson_issues(path)

    assert (issue.kind, issue.where) == ("iso19107.302", "Building[b]")


def test_what_is_no_cityjson(tmp_path):
    (tmp_path / "city.json").write_text("{}")

    with pytest.raises(EnvgenError, match="not CityJSON"):
        cityjson_issues(tmp_path / "city.json")
