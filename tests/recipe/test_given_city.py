"""Buildings of a file in place of generated ones."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shapely
from pxr import Usd

from envgen_usd.chunks import Chunk, chunks_of_points
from envgen_usd.citygml.read import read_city
from envgen_usd.citygml.write import write_city
from envgen_usd.cityjson.write import write_cityjson
from envgen_usd.errors import EnvgenError
from envgen_usd.geometry.flat_arrays import join, take, turned
from envgen_usd.geometry.iso19107.fault_search import Bodies, find_faults
from envgen_usd.models.city_model import City, CityObject, ThematicSurface
from envgen_usd.models.polygon_arrays import Polygons
from envgen_usd.models.road_surface import RoadSurface
from envgen_usd.recipe.build_options import BuildOptions
from envgen_usd.recipe.environment_build import BuildResult, build
from envgen_usd.recipe.given_city import read_given_city

CRS, OFFSET = "EPSG:25832", (690000.0, 5334000.0, 500.0)
PLACES = ((150.0, 230.0), (260.0, 170.0), (199.0, 220.0))
ROAD = f"""<?xml version="1.0"?>
<OpenDRIVE><header revMajor="1" revMinor="7" name="small">
<geoReference>{CRS}</geoReference><offset x="{OFFSET[0]}" y="{OFFSET[1]}" z="{OFFSET[2]}" hdg="0"/>
</header>
<road name="a" length="104" id="7" junction="-1"><type s="0" type="town"/>
<planView><geometry s="0" x="150" y="200" hdg="0" length="104"><line/></geometry></planView>
<elevationProfile><elevation s="0" a="1" b="0" c="0" d="0"/></elevationProfile>
<lanes><laneSection s="0">
<left><lane id="1" type="driving"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane></left>
<center><lane id="0" type="none"/></center>
<right><lane id="-1" type="driving"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane></right>
</laneSection></lanes></road></OpenDRIVE>
"""
"""Its land reaches into the four chunks at (200, 200) alone."""
SURFACE = RoadSurface(
    vertices=np.array([[150.0, 200.0, 1.0], [254.0, 200.0, 1.0], [254.0, 203.0, 1.0]]),
    triangles=np.array([[0, 1, 2]]),
    triangle_patch=np.zeros(1, dtype=np.int64),
    triangle_level=np.zeros(1, dtype=np.int64),
    patches=(),
    outline=(),
    lanes=(),
    roads=(),
    crs=CRS,
    offset=OFFSET,
)
CHUNKS = chunks_of_points(SURFACE.vertices, 60.0)


def box(name: str, place: tuple[float, float], z: float = 3.25, side: float = 8.0) -> CityObject:
    """A block with its lower corner at a place, with classes of its faces."""
    x, y = place
    low = np.array([[x, y, z], [x + side, y, z], [x + side, y + side, z], [x, y + side, z]])
    high = low + np.array([0.0, 0.0, 6.0])
    walls = [np.stack([low[i], low[(i + 1) % 4], high[(i + 1) % 4], high[i]]) for i in range(4)]
    rings = {"GroundSurface": [low[::-1]], "RoofSurface": [high], "WallSurface": walls}
    surfaces = tuple(
        ThematicSurface(f"{name}_{kind}", kind, Polygons.of_rings(own), 2)
        for kind, own in rings.items()
    )
    return CityObject(name, "Building", {"function": "1000"}, surfaces, solid_lod=2)


def city_of(places: tuple[tuple[float, float], ...] = PLACES, z: float = 3.25) -> City:
    return City(tuple(box(f"house-{i}", at, z) for i, at in enumerate(places)), CRS, OFFSET)


def boxes_of(buildings: tuple[CityObject, ...]) -> dict[str, list[float]]:
    """Bounds of each building."""
    found = {}
    for building in buildings:
        points = np.concatenate([s.polygons.points for s in building.surfaces])
        found[building.id] = [*points.min(axis=0).tolist(), *points.max(axis=0).tolist()]
    return found


def given_by(path: Path) -> dict[str, list[float]]:
    given = read_given_city(path, SURFACE, CHUNKS)
    found: dict[str, list[float]] = {}
    for chunk in CHUNKS:
        found |= boxes_of(given.around(chunk))
    return found


@pytest.mark.parametrize("name", ["own.gml", "old.gml", "model.json"])
def test_every_format_gives_the_same_buildings(name: str, tmp_path: Path) -> None:
    path = tmp_path / name
    city = city_of()
    if name == "model.json":
        write_cityjson(city, path)
    else:
        write_city(city, path, "3.0" if name == "own.gml" else "2.0")
    assert given_by(path) == boxes_of(city.objects)


@pytest.mark.parametrize("version", ["3.0", "2.0"])
def test_a_file_in_another_crs_stands_where_it_belongs(version: str, tmp_path: Path) -> None:
    """Zones of UTM of two datums that agree to less than 1 mm."""
    x, y, z = OFFSET
    other = City(city_of().objects, "EPSG:32632", (x, y, z))
    shifted = replace(other, offset=(x - 10.0, y, z - 2.0))
    write_city(shifted, tmp_path / "a.gml", version)
    expected = boxes_of(tuple(box(f"house-{i}", (a - 10.0, b), 1.25)
                              for i, (a, b) in enumerate(PLACES)))  # fmt: skip
    found = given_by(tmp_path / "a.gml")
    assert found.keys() == expected.keys()
    for key, bounds in expected.items():
        assert found[key] == pytest.approx(bounds, abs=2e-3)


def test_ids_that_are_missing_or_twice_there_are_replaced(tmp_path: Path) -> None:
    city = city_of()
    write_city(city, tmp_path / "a.gml", "2.0")
    text = (tmp_path / "a.gml").read_text("utf-8")
    text = text.replace('gml:id="house-0"', "").replace('gml:id="house-1"', 'gml:id="house-2"')
    (tmp_path / "b.gml").write_text(text, "utf-8")
    given = read_given_city(tmp_path / "b.gml", SURFACE, CHUNKS)
    buildings = {b.id: b for chunk in CHUNKS for b in given.around(chunk)}
    assert len(buildings) == 3
    again = City(tuple(buildings.values()))
    write_city(again, tmp_path / "c.gml")
    assert boxes_of(read_city(tmp_path / "c.gml").objects) == boxes_of(tuple(buildings.values()))


def test_each_building_belongs_to_the_chunk_of_its_middle(tmp_path: Path) -> None:
    write_city(city_of(), tmp_path / "a.gml")
    given = read_given_city(tmp_path / "a.gml", SURFACE, CHUNKS)
    given.keep([Chunk(0, 1)])
    assert [building.id for building in given.around(Chunk(0, 1))] == ["house-0"]


def test_files_that_give_no_building_are_named(tmp_path: Path) -> None:
    path = tmp_path / "a.gml"
    with pytest.raises(EnvgenError, match=r"a\.gml: cannot be read"):
        read_given_city(path, SURFACE, CHUNKS)
    path.write_text("<html/>")
    with pytest.raises(EnvgenError, match="not CityGML"):
        read_given_city(path, SURFACE, CHUNKS)
    write_city(city_of(((9000.0, 9000.0),)), path)
    with pytest.raises(EnvgenError, match="none of its 1 buildings"):
        read_given_city(path, SURFACE, CHUNKS)


def plain(building: CityObject, *, inside_out: bool = False) -> CityObject:
    """A block as one solid whose faces have no classes."""
    shape = join([surface.polygons for surface in building.surfaces])
    shape = turned(shape) if inside_out else shape
    return replace(building, surfaces=(), solid_lod=-1, geometry={"lod1Solid": shape})


def write_given(city: City, path: Path) -> None:
    if path.suffix == ".json":
        write_cityjson(city, path)
    else:
        write_city(city, path, "2.0")


@pytest.mark.parametrize("name", ["a.gml", "a.json"])
@pytest.mark.parametrize("classes", [False, True])
def test_solids_that_are_inside_out_are_turned(name: str, classes: bool, tmp_path: Path) -> None:
    good, bad = city_of().objects[:2]
    if classes:
        faces = (replace(s, polygons=turned(s.polygons)) for s in bad.surfaces)
        city = City((good, replace(bad, surfaces=tuple(faces))), CRS, OFFSET)
    else:
        city = City((plain(good), plain(bad, inside_out=True)), CRS, OFFSET)
    write_given(city, tmp_path / name)
    given = read_given_city(tmp_path / name, SURFACE, CHUNKS)

    (issue,) = given.issues
    assert (issue.kind, issue.action) == ("iso19107.405", "turned")
    assert "house-1" in issue.where
    buildings = {b.id: b for chunk in CHUNKS for b in given.around(chunk)}
    for building in buildings.values():
        kinds = {s.kind: s.polygons for s in building.surfaces}
        assert {kind: len(shape) for kind, shape in kinds.items()} == {
            **{"WallSurface": 4, "RoofSurface": 1, "GroundSurface": 1}
        }
        assert find_faults(Bodies.of_solid(join(list(kinds.values())))) == []
        assert kinds["RoofSurface"].points[:, 2].min() > kinds["GroundSurface"].points[:, 2].max()


@pytest.mark.parametrize("name", ["a.gml", "a.json"])
def test_a_broken_shell_is_an_issue_of_the_build(name: str, tmp_path: Path) -> None:
    good, bad = (plain(building) for building in city_of().objects[:2])
    shape = bad.geometry["lod1Solid"]
    bad = replace(bad, geometry={"lod1Solid": take(shape, np.arange(5))})
    write_given(City((good, bad), CRS, OFFSET), tmp_path / name)
    given = read_given_city(tmp_path / name, SURFACE, CHUNKS)
    assert len(given) == 2
    (issue,) = given.issues
    assert (issue.kind, issue.where) == ("iso19107.302", "Building[house-1]")


def test_a_feature_that_cannot_be_read_costs_no_other(tmp_path: Path) -> None:
    """A surface that refers to itself, and a vertex that is not there."""
    city = city_of()
    write_city(city, tmp_path / "a.gml", "2.0")
    text = (tmp_path / "a.gml").read_text("utf-8")
    start = text.index('<bldg:Building gml:id="house-1"')
    place = text.index(">", start) + 1
    loop = (
        '<bldg:lod3MultiSurface><gml:MultiSurface gml:id="loop"><gml:surfaceMember'
        ' xlink:href="#loop"/><gml:surfaceMember xlink:href="#loop"/></gml:MultiSurface>'
        "</bldg:lod3MultiSurface>"
    )
    (tmp_path / "b.gml").write_text(text[:place] + loop + text[place:], "utf-8")
    write_cityjson(city, tmp_path / "a.json")
    file = json.loads((tmp_path / "a.json").read_text("utf-8"))
    file["CityObjects"]["house-1"]["geometry"][0]["boundaries"][0][0][0][0] = 9999
    (tmp_path / "b.json").write_text(json.dumps(file), "utf-8")

    for name in ("b.gml", "b.json"):
        given = read_given_city(tmp_path / name, SURFACE, CHUNKS)
        assert {b.id for chunk in CHUNKS for b in given.around(chunk)} == {"house-0", "house-2"}
        (issue,) = given.issues
        assert (issue.kind, issue.action) == ("city.feature", "left out")
        assert "house-1" in issue.where


def test_cityjson_seq_gives_the_same_buildings(tmp_path: Path) -> None:
    """One feature a line, each with vertices of its own."""
    city = city_of()
    write_cityjson(city, tmp_path / "a.json")
    file = json.loads((tmp_path / "a.json").read_text("utf-8"))
    objects, vertices = file["CityObjects"], file["vertices"]
    lines = [{**file, "CityObjects": {}, "vertices": []}]
    for name, item in objects.items():
        used = sorted(
            set(re.findall(r"\d+", json.dumps([g["boundaries"] for g in item["geometry"]])))
        )
        own = {int(old): new for new, old in enumerate(used)}
        for geometry in item["geometry"]:
            text = json.dumps(geometry["boundaries"])
            text = re.sub(r"\d+", lambda found, own=own: str(own[int(found[0])]), text)
            geometry["boundaries"] = json.loads(text)
        feature = {"type": "CityJSONFeature", "id": name, "CityObjects": {name: item}}
        lines.append({**feature, "vertices": [vertices[int(old)] for old in used]})
    text = "\n".join(map(json.dumps, [*lines, {"type": "CityJSONFeature", "id": "x"}]))
    (tmp_path / "a.city.jsonl").write_text(text + "\n", "utf-8")
    assert given_by(tmp_path / "a.city.jsonl") == boxes_of(city.objects)


def test_a_build_has_the_buildings_of_the_file_and_nothing_in_them(tmp_path: Path) -> None:
    road, path = tmp_path / "small.xodr", tmp_path / "city.gml"
    house = '<object id="old" type="building" s="4" t="34" length="4" width="4" height="9"/>'
    tree = '<object id="far" type="tree" s="4" t="900"/>'
    objects = f"</lanes><objects>{house}{tree}</objects></road>"
    road.write_text(ROAD.replace("</lanes></road>", objects), encoding="utf-8")
    first, *others = city_of(z=1.0).objects
    given = City((plain(first, inside_out=True), *others), CRS, OFFSET)
    write_city(given, path, "2.0")
    out = tmp_path / "out"
    result = build(BuildOptions(road, "2", "residential", out, city=path, workers=1))
    assert [issue.where for issue in result.issues if issue.action == "turned"] == [
        "Building[house-0]"
    ]
    left_out = {issue.kind: issue.where for issue in result.issues if issue.action == "left out"}
    assert left_out == {
        "object.replaced": "road[id=7]/objects/object[id=old]",
        "object.beyond_land": "road[id=7]/objects/object[id=far]",
    }
    assert "all faces of lod1Solid point inwards" in (out / "report.html").read_text("utf-8")
    city = [read_city(file) for file in sorted((out / "chunks").glob("*/city.gml"))]
    buildings = tuple(b for part in city for b in part.of_kind("Building"))
    assert boxes_of(buildings) == boxes_of(city_of(z=1.0).objects)
    shapes = [shapely.box(b[0], b[1], b[3], b[4]) for b in boxes_of(buildings).values()]
    feet = [thing.placement.position[:2] for part in city for thing in part.walk()
            if thing.placement is not None]  # fmt: skip
    assert len(feet) > 20
    assert shapely.STRtree(shapes).query(shapely.points(feet), "dwithin", 0.2).size == 0
    stage = Usd.Stage.Open(str(out / "stage.usda"))
    ids = {
        prim.GetCustomDataByKey("gml_id") or prim.GetAttribute("userProperties:gml_id").Get()
        for prim in stage.Traverse()
        if prim.GetParent().GetName() == "Buildings"
    }
    assert {"house-0", "house-1", "house-2"} <= ids


def feet(folder: Path) -> dict[str, float]:
    """Lowest height of each building of a build."""
    found = boxes_of(read_city(folder / "city.gml").of_kind("Building"))
    return {name: bounds[2] for name, bounds in found.items()}


def build_with(tmp_path: Path, buildings: tuple[CityObject, ...], **more: object) -> BuildResult:
    """A build of the flat road at 1 m with given buildings."""
    (tmp_path / "small.xodr").write_text(ROAD, encoding="utf-8")
    write_city(City(buildings, CRS, OFFSET), tmp_path / "city.gml")
    out = tmp_path / "out"
    road, city = tmp_path / "small.xodr", tmp_path / "city.gml"
    options = BuildOptions(road, "2", "residential", out, city=city, workers=1, **more)  # type: ignore[arg-type]
    return build(options)


def test_a_model_of_another_vertical_datum_is_set_onto_the_ground(tmp_path: Path) -> None:
    """The middle one of the distances decides; the house that then still floats follows."""
    heights = (35.5, 35.5, 38.0)
    buildings = tuple(
        box(f"house-{i}", at, z) for i, (at, z) in enumerate(zip(PLACES, heights, strict=True))
    )
    result = build_with(tmp_path, buildings)
    assert feet(tmp_path / "out") == {f"house-{i}": 1.0 for i in range(3)}
    issues = {issue.kind: issue for issue in result.issues}
    assert issues["city.ground_level"].action == "lowered by 34.5 m"
    assert "3 buildings stand 34.5 m above the ground" in issues["city.ground_level"].message
    assert issues["city.off_ground"].where == "Building[house-2]"
    assert "1 of 3 buildings float above the ground, up to 2.5 m" in (
        issues["city.off_ground"].message
    )
    assert "city.ground_level" in (tmp_path / "out" / "report.html").read_text("utf-8")


def test_basements_stay_in_the_ground_and_deep_buildings_come_up(tmp_path: Path) -> None:
    heights = (1.0, -1.5, -7.0)
    buildings = tuple(
        box(f"house-{i}", at, z) for i, (at, z) in enumerate(zip(PLACES, heights, strict=True))
    )
    result = build_with(tmp_path, (*buildings, box("house-3", (180.0, 250.0), 1.0)))
    found = feet(tmp_path / "out")
    # The median of 0, 0, -2.5 and -8 is -1.25.
    assert [issue.action for issue in result.issues if issue.kind == "city.ground_level"] == [
        "raised by 1.2 m"
    ]
    assert found["house-1"] == pytest.approx(-0.25)
    assert found["house-2"] == pytest.approx(1.0)


def test_a_building_over_the_road_may_float(tmp_path: Path) -> None:
    buildings = (*(box(f"house-{i}", at, 1.0) for i, at in enumerate(PLACES)),
                 box("bridge", (200.0, 196.0), 7.0))  # fmt: skip
    build_with(tmp_path, buildings)
    assert feet(tmp_path / "out")["bridge"] == pytest.approx(7.0)


def test_an_offset_moves_the_model_and_with_a_height_nothing_is_set_down(tmp_path: Path) -> None:
    buildings = tuple(box(f"house-{i}", (x - 50.0, y), 35.5) for i, (x, y) in enumerate(PLACES))
    (tmp_path / "flat").mkdir()
    (tmp_path / "high").mkdir()
    flat = build_with(tmp_path / "flat", buildings, city_offset=(50.0, 0.0))
    high = build_with(tmp_path / "high", buildings, city_offset=(50.0, 0.0, -30.0))
    for folder, z in (("flat", 1.0), ("high", 5.5)):
        found = boxes_of(read_city(tmp_path / folder / "out" / "city.gml").of_kind("Building"))
        assert {name: bounds[:3] for name, bounds in found.items()} == {
            f"house-{i}": [x, y, z] for i, (x, y) in enumerate(PLACES)
        }
    assert not [issue for issue in high.issues if issue.kind.startswith("city.")]
    assert flat.manifest.inputs["city_offset"] == [50.0, 0.0]
    assert set(flat.manifest.keys.values()).isdisjoint(high.manifest.keys.values())
    assert build_with(tmp_path / "high", buildings, city_offset=(50.0, 0.0, -30.0)).built == 0


@pytest.mark.parametrize("offset", [(1.0,), (float("nan"), 1.0), (1e9, 0.0, 0.0), (1.0,) * 4])
def test_an_offset_that_makes_no_sense_is_named(offset: tuple[float, ...], tmp_path: Path) -> None:
    with pytest.raises(EnvgenError, match=r"--city-offset .*: give two or three numbers"):
        build_with(tmp_path, city_of().objects, city_offset=offset)
    with pytest.raises(EnvgenError, match="give --city"):
        build(BuildOptions(tmp_path / "small.xodr", "1", "residential", tmp_path / "o",
                           city_offset=(1.0, 2.0)))  # fmt: skip


def test_a_real_city_stands_on_the_ground_of_a_road_at_zero(shared: Path, tmp_path: Path) -> None:
    """3DBAG: the ground around these houses is 4 to 6 m above Amsterdam's datum."""
    text = ROAD.replace(CRS, "EPSG:28992").replace('y="5334000.0" z="500.0"', 'y="414000" z="0"')
    text = text.replace('<offset x="690000.0"', '<offset x="153000"').replace('a="1"', 'a="0"')
    road = tmp_path / "road.xodr"
    road.write_text(text.replace('x="150" y="200"', 'x="400" y="180"'), encoding="utf-8")
    city, out = shared / "citymodels" / "multi_lod.json", tmp_path / "out"
    result = build(BuildOptions(road, "1", "residential", out, city=city, workers=1))
    assert "city.ground_level" in {issue.kind for issue in result.issues}
    found = feet(out)
    assert len(found) > 2
    assert all(-0.6 < foot < 0.6 for foot in found.values())


def raised(building: CityObject, height: float) -> CityObject:
    """The building with its highest points at another height."""
    surfaces = []
    for surface in building.surfaces:
        points = surface.polygons.points.copy()
        points[points[:, 2] > 9.0, 2] = height
        polygons = replace(surface.polygons, points=points)
        surfaces.append(replace(surface, polygons=polygons))
    return replace(building, surfaces=tuple(surfaces))


@pytest.mark.parametrize(
    ("height", "said"),
    [(1e30, "1e+30 m"), (1e300, "1e+300 m"), (1e9, "1e+09 m"), (2.1e4, "21000 m")],
)
@pytest.mark.parametrize("suffix", [".gml", ".json"])
def test_a_building_of_a_height_that_none_has_is_left_out(
    tmp_path: Path, suffix: str, height: float, said: str
) -> None:
    city = city_of()
    faulty = City((city.objects[0], raised(city.objects[1], 9000.0)), CRS, OFFSET)
    path = tmp_path / f"city{suffix}"
    if suffix == ".gml":
        write_city(faulty, path)
        path.write_text(path.read_text().replace("9500.000", repr(height + OFFSET[2])))
    else:
        write_cityjson(faulty, path)
        model = json.loads(path.read_text())
        highest = max(model["vertices"], key=lambda vertex: vertex[2])[2]
        for vertex in model["vertices"]:
            if vertex[2] == highest:
                vertex[2] = height / model["transform"]["scale"][2]
        path.write_text(json.dumps(model))
    given = read_given_city(path, SURFACE, CHUNKS)
    assert len(given) == 1
    (issue,) = given.issues
    assert (issue.kind, issue.where) == ("city.implausible", "Building[house-1]")
    assert said in issue.message


def test_a_file_without_any_plausible_building_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "city.gml"
    write_city(City((raised(city_of().objects[0], 9000.0),), CRS, OFFSET), path)
    path.write_text(path.read_text().replace("9500.000", "NaN"))
    with pytest.raises(EnvgenError, match="no usable building: its coordinates are not finite"):
        read_given_city(path, SURFACE, CHUNKS)
