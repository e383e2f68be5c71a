import numpy as np

from envgen_usd.geometry.iso19107.fault_report import city_issues
from envgen_usd.models.city_model import City, CityObject, ThematicSurface
from envgen_usd.models.polygon_arrays import Polygons

CORNERS = np.array([[x, y, z] for z in (0, 6) for y in (0, 8) for x in (0, 10)], dtype=float)
FACES = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [1, 3, 7, 5], [3, 2, 6, 7], [2, 0, 4, 6]]


def box(shift=(0, 0, 0), faces=range(6)):
    return [Polygons.of_rings([CORNERS[FACES[face]] + shift]) for face in faces]


def building(name, parts, kind="Building", children=(), **more):
    surfaces = tuple(
        ThematicSurface(f"{name}_{n}", "WallSurface", part, 2) for n, part in enumerate(parts)
    )
    return CityObject(name, kind, surfaces=surfaces, solid_lod=2, children=children, **more)


def kinds(*objects):
    return [(issue.kind, issue.where) for issue in city_issues(City(objects))]


def test_a_valid_city_has_no_issues():
    solid = Polygons.of_rings([CORNERS[face] for face in FACES])

    assert kinds(building("a", box()), building("b", box(), geometry={"lod1Solid": solid})) == []


def test_an_opening_belongs_to_the_shell():
    wall, *rest = box()
    opening = ThematicSurface("o", "DoorSurface", wall, 2)
    surfaces = (
        ThematicSurface("w", "WallSurface", rest[0], 2, openings=(opening,)),
        *(ThematicSurface(f"s{n}", "WallSurface", part, 2) for n, part in enumerate(rest[1:])),
    )

    assert kinds(CityObject("a", "Building", surfaces=surfaces, solid_lod=2)) == []


def test_an_open_shell_is_named_by_its_feature():
    assert kinds(building("good", box()), building("open", box(faces=range(5)))) == [
        ("iso19107.302", "Building[open]")
    ]


def test_a_bent_polygon_is_named_by_its_surface():
    bent = Polygons.of_rings([CORNERS[FACES[0]] + [[0, 0, 1], [0, 0, 0], [0, 0, 0], [0, 0, 0]]])
    surface = ThematicSurface("area", "TrafficArea", bent, 2)

    assert kinds(CityObject("road", "Road", surfaces=(surface,))) == [
        ("iso19107.203", "TrafficArea[area]")
    ]


def test_parts_that_overlap():
    part = building("part", box((5, 0, 0)), "BuildingPart")
    beside = building("beside", box((10, 0, 0)), "BuildingPart")

    assert kinds(building("a", box(), children=(part,))) == [("iso19107.601", "BuildingPart[part]")]
    assert kinds(building("a", box(), children=(beside,))) == []


def test_a_faulty_part_is_not_compared():
    turned = [Polygons.of_rings([CORNERS[face[::-1]] + (5, 0, 0)]) for face in FACES]
    inside = building("part", turned, "BuildingPart")

    assert kinds(building("a", box(), children=(inside,))) == [
        ("iso19107.405", "BuildingPart[part]")
    ]
