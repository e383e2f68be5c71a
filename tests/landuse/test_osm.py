import numpy as np
import pytest
import shapely

from envgen_usd.chunks import CELL_SIZE
from envgen_usd.errors import EnvgenError
from envgen_usd.landuse.osm_land_tags import ROADS, has_landuse
from envgen_usd.landuse.osm_landuse import QUAY_WIDTH, VERGE, rasterise_osm, read_osm
from envgen_usd.models.landuse import LanduseClass

METRE = 1 / 111_320.0
"""Degrees of latitude, and of longitude at the equator."""
HEAD = '<?xml version="1.0"?><osm version="0.6">'


def write_osm(path, ways):
    """Writes ways, each a list of (x, y) in metres near 0 N 0 E and a dict of tags."""
    nodes, lines = [], []
    for number, (points, tags) in enumerate(ways):
        refs = []
        for x, y in points:
            nodes.append(
                f'<node id="{len(nodes) + 1}" version="1" lat="{y * METRE}" lon="{x * METRE}"/>'
            )
            refs.append(len(nodes))
        if points[0] == points[-1]:
            nodes.pop()
            refs[-1] = refs[0]
        inside = "".join(f'<nd ref="{ref}"/>' for ref in refs)
        inside += "".join(f'<tag k="{key}" v="{value}"/>' for key, value in tags.items())
        lines.append(f'<way id="{number + 1}" version="1">{inside}</way>')
    path.write_text(HEAD + "".join(nodes + lines) + "</osm>", encoding="utf-8")


def test_a_road_and_areas_have_their_size(tmp_path):
    field = [(-150, 20), (150, 20), (150, 80), (-150, 80), (-150, 20)]
    wood = [(0, 40), (50, 40), (50, 60), (0, 60), (0, 40)]
    write_osm(
        tmp_path / "map.osm",
        [
            ([(-150, 0.2), (150, 0.2)], {"highway": "residential"}),
            (field, {"landuse": "residential"}),
            (wood, {"natural": "wood"}),
        ],
    )
    classes = np.concatenate(
        [m.classes.ravel() for m in rasterise_osm(read_osm(tmp_path / "map.osm"))]
    )
    area = {kind: np.sum(classes == kind) * CELL_SIZE**2 for kind in LanduseClass}
    assert area[LanduseClass.ROAD] == pytest.approx(300 * ROADS["residential"], rel=0.08)
    assert area[LanduseClass.VERGE] == pytest.approx(2 * 300 * VERGE, rel=0.15)
    assert area[LanduseClass.WOOD] == pytest.approx(1000, rel=0.05)
    assert area[LanduseClass.LAWN] == pytest.approx(300 * 60 - 1000, rel=0.05)


@pytest.mark.parametrize(
    ("tags", "width"),
    [
        ({"width": "9 m"}, 9.0),
        ({"lanes": "4"}, 12.8),
        *(({"width": said}, ROADS["primary"]) for said in ("wide", "inf", "nan", "-9", "0", "1e9")),
        ({"width": "inf", "lanes": "4"}, 12.8),
        ({"lanes": "9" * 250}, ROADS["primary"]),
    ],
)
def test_a_road_is_as_wide_as_tagged(tmp_path, tags, width):
    write_osm(tmp_path / "map.osm", [([(-90, 3), (90, 3)], {"highway": "primary", **tags})])
    chunks = rasterise_osm(read_osm(tmp_path / "map.osm"))
    count = sum(np.sum(made.classes == LanduseClass.ROAD) for made in chunks)
    assert count * CELL_SIZE**2 == pytest.approx(180 * width + np.pi * width**2 / 4, rel=0.06)


def test_what_is_no_extract_is_refused(tmp_path):
    (tmp_path / "a.osm").write_text("nothing")
    with pytest.raises(EnvgenError, match="cannot be read"):
        read_osm(tmp_path / "a.osm")
    write_osm(tmp_path / "b.osm", [([(0, 0), (9, 9)], {"highway": "footway"})])
    with pytest.raises(EnvgenError, match="no road"):
        read_osm(tmp_path / "b.osm")
    with pytest.raises(EnvgenError, match="no such file"):
        read_osm(tmp_path / "c.osm")


def test_what_a_clipped_extract_lacks_is_left_out_and_counted(tmp_path):
    """A road whose middle node is missing, and a wood of which one way is missing."""
    road = ([(x, 0.2) for x in (-150, -50, 0, 50, 150)], {"highway": "residential"})
    wood = [(0, 40), (50, 40), (50, 60), (0, 60)]
    write_osm(tmp_path / "map.osm", [road, (wood, {}), (road[0], {"highway": "service"})])
    text = (tmp_path / "map.osm").read_text("utf-8")
    text = text.replace('<nd ref="3"/>', '<nd ref="999"/>')
    members = '<member type="way" ref="2" role="outer"/><member type="way" ref="77" role="outer"/>'
    tags = '<tag k="type" v="multipolygon"/><tag k="natural" v="wood"/>'
    text = text.replace("</osm>", f'<relation id="5" version="1">{members}{tags}</relation></osm>')
    (tmp_path / "map.osm").write_text(text, "utf-8")
    read = read_osm(tmp_path / "map.osm")
    assert {issue.kind: issue.message.split()[0] for issue in read.issues} == {
        "osm.incomplete_area": "1",
        "osm.incomplete_road": "1",
    }
    area = shapely.union_all(
        [s for s, k in zip(read.shapes, read.classes, strict=True) if k == LanduseClass.ROAD]
    ).area
    assert area == pytest.approx(200 * ROADS["residential"], rel=0.3)
    assert LanduseClass.WOOD not in read.classes


def test_a_real_clipped_extract_is_used(shared):
    path = shared / "osm" / "clipped_multipolygon.osm"
    if not path.is_file():
        pytest.skip("no clipped extract of OpenStreetMap")
    read = read_osm(path)
    assert [issue.kind for issue in read.issues] == ["osm.incomplete_area"]
    assert sum(1 for _ in rasterise_osm(read)) == 4


@pytest.mark.parametrize(
    ("tags", "is_square"),
    [
        ({"place": "square"}, True),
        ({"amenity": "marketplace"}, True),
        ({"highway": "pedestrian", "area": "yes"}, True),
        ({"highway": "pedestrian"}, False),
    ],
)
def test_squares_are_areas_and_no_loops_of_streets(tmp_path, tags, is_square):
    land = [(-50, 20), (50, 20), (50, 60), (-50, 60), (-50, 20)]
    road = ([(-150, 0.2), (150, 0.2)], {"highway": "residential"})
    write_osm(tmp_path / "map.osm", [road, (land, tags)])
    maps = rasterise_osm(read_osm(tmp_path / "map.osm"))
    cells = sum(np.sum(m.classes == LanduseClass.SQUARE) for m in maps)
    assert cells * CELL_SIZE**2 == pytest.approx(100 * 40 * is_square, rel=0.05)
    # A loop for people on foot is a path.
    assert has_landuse(tags, is_area=True)


@pytest.mark.parametrize(
    ("tags", "kind"),
    [
        ({"landuse": "harbour"}, "QUAY"),
        ({"landuse": "industrial", "industrial": "port"}, "QUAY"),
        ({"man_made": "pier", "area": "yes"}, "QUAY"),
        ({"waterway": "dock"}, "WATER"),
    ],
)
def test_harbours_are_quays_and_docks_are_water(tmp_path, tags, kind):
    land = [(-50, 20), (50, 20), (50, 60), (-50, 60), (-50, 20)]
    road = ([(-150, 0.2), (150, 0.2)], {"highway": "residential"})
    write_osm(tmp_path / "map.osm", [road, (land, tags)])
    maps = rasterise_osm(read_osm(tmp_path / "map.osm"))
    cells = sum(np.sum(m.classes == LanduseClass[kind]) for m in maps)
    # The border of an area that is a pier is a pier itself.
    assert cells * CELL_SIZE**2 == pytest.approx(100 * 40, rel=0.12)
    assert has_landuse(tags, is_area=True)


def test_a_pier_lies_on_the_water(tmp_path):
    road = ([(-150, 0.2), (150, 0.2)], {"highway": "residential"})
    dock = ([(-50, 20), (50, 20), (50, 60), (-50, 60), (-50, 20)], {"waterway": "dock"})
    pier = ([(0, 20), (0, 50)], {"man_made": "pier", "width": "10"})
    write_osm(tmp_path / "map.osm", [road, pier, dock])
    maps = rasterise_osm(read_osm(tmp_path / "map.osm"))
    cells = sum(np.sum(m.classes == LanduseClass.QUAY) for m in maps)
    # The pier ends square; a quay with corners runs around the dock of 100 by 40 metres.
    quay = 2 * (100 + 40) * QUAY_WIDTH + 4 * QUAY_WIDTH**2
    # The quay is three cells wide, 2.35 m.
    assert cells * CELL_SIZE**2 == pytest.approx(30 * 10 + quay, rel=0.08)


def test_no_quay_divides_two_waters(tmp_path):
    road = ([(-150, 0.2), (150, 0.2)], {"highway": "residential"})
    dock = ([(-50, 20), (0, 20), (0, 60), (-50, 60), (-50, 20)], {"waterway": "dock"})
    lake = ([(0, 20), (50, 20), (50, 60), (0, 60), (0, 20)], {"natural": "water"})
    write_osm(tmp_path / "map.osm", [road, lake, dock])
    maps = list(rasterise_osm(read_osm(tmp_path / "map.osm")))
    areas = [
        sum(np.sum(m.classes == kind) for m in maps) * CELL_SIZE**2
        for kind in (LanduseClass.WATER, LanduseClass.QUAY)
    ]
    assert areas[0] == pytest.approx(100 * 40, rel=0.03)
    # The quay has three sides, and reaches on beside the lake by its width at neither end.
    assert areas[1] == pytest.approx((2 * 50 + 40) * QUAY_WIDTH + 4 * QUAY_WIDTH**2, rel=0.08)


@pytest.mark.parametrize(
    ("tag", "kind"), [("farmland", "FIELD"), ("vineyard", "CROP"), ("orchard", "ORCHARD")]
)
def test_farmed_land_is_of_its_class(tmp_path, tag, kind):
    land = [(-50, 20), (50, 20), (50, 60), (-50, 60), (-50, 20)]
    road = ([(-150, 0.2), (150, 0.2)], {"highway": "residential"})
    write_osm(tmp_path / "map.osm", [road, (land, {"landuse": tag})])
    maps = rasterise_osm(read_osm(tmp_path / "map.osm"))
    cells = sum(np.sum(m.classes == LanduseClass[kind]) for m in maps)
    assert cells * CELL_SIZE**2 == pytest.approx(100 * 40, rel=0.05)


def test_paths_tell_where_they_lead_and_whether_they_are_paved(tmp_path):
    """A driveway ends at a house, a footway joins two streets, a sidewalk is built with its own."""
    street = [(-90, 3), (0, 3), (90, 3)]
    ways = [
        (street, {"highway": "residential"}),
        ([(0, 3), (0, 20)], {"highway": "service", "service": "driveway"}),
        ([(-90, 3), (-90, 40), (90, 40), (90, 3)], {"highway": "footway", "width": "3"}),
        ([(-90, 8), (90, 8)], {"highway": "footway", "footway": "sidewalk"}),
        ([(-90, 60), (90, 60)], {"highway": "path"}),
        ([(-90, 70), (90, 70)], {"highway": "path", "surface": "asphalt", "width": "9000"}),
        ([(-90, 80), (90, 80)], {"highway": "footway", "tunnel": "yes"}),
    ]
    write_shared(tmp_path / "map.osm", ways)
    paths = read_osm(tmp_path / "map.osm").paths
    assert [path.is_through for path in paths] == [False, True, False, False, False]
    assert [path.is_paved for path in paths] == [False, True, False, False, True]
    assert [path.width for path in paths] == [3.5, 3.0, 1.8, 1.4, 1.4]
    footway = paths[1]
    assert footway.ground().area == pytest.approx(3.0 * footway.line.length, rel=0.05)
    assert has_landuse({"highway": "footway"}, is_area=False)
    assert not has_landuse({"highway": "footway", "bridge": "yes"}, is_area=False)


def write_shared(path, ways):
    """As `write_osm`, but nodes at one place are one."""
    numbers = {}
    for points, _ in ways:
        for point in points:
            numbers.setdefault(point, len(numbers) + 1)
    nodes = [
        f'<node id="{n}" version="1" lat="{y * METRE}" lon="{x * METRE}"/>'
        for (x, y), n in numbers.items()
    ]
    lines = []
    for number, (points, tags) in enumerate(ways):
        inside = "".join(f'<nd ref="{numbers[point]}"/>' for point in points)
        inside += "".join(f'<tag k="{key}" v="{value}"/>' for key, value in tags.items())
        lines.append(f'<way id="{number + 1}" version="1">{inside}</way>')
    path.write_text(HEAD + "".join(nodes + lines) + "</osm>", encoding="utf-8")
