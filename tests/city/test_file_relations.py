"""Relations that the OpenDRIVE file tells, from the file to the city."""

import pytest
import shapely

from envgen_usd.chunks import Chunk
from envgen_usd.city.roads.file_features import in_chunk, near_chunk
from envgen_usd.city.roads.road_city import build_road_city
from envgen_usd.city.roads.road_index import RoadIndex
from envgen_usd.city.roads.road_model import make_roads
from envgen_usd.environment_files import read_profile
from envgen_usd.geometry.flat_arrays import join
from envgen_usd.recipe.map_land import read_road

WIDTH = '<width sOffset="0" a="3.5" b="0" c="0" d="0"/>'


def lane(number, kind="driving", mark=""):
    return f'<lane id="{number}" type="{kind}">{WIDTH}{mark}</lane>'


def road(name, lanes, rest="", x=0, y=0):
    """A straight road to the east; lanes from the outermost right one to the outermost left."""
    ids = [int(text.split('"')[1]) for text in lanes]
    left = "".join(text for number, text in zip(ids, lanes, strict=True) if number > 0)
    centre = "".join(text for number, text in zip(ids, lanes, strict=True) if number == 0)
    right = "".join(text for number, text in zip(ids, lanes, strict=True) if number < 0)
    return f"""<road name="" id="{name}" length="100" junction="-1">
        <planView><geometry s="0" x="{x}" y="{y}" hdg="0" length="100"><line/></geometry>
        </planView><lanes><laneSection s="0"><left>{left}</left>
        <center>{centre or '<lane id="0" type="none"/>'}</center><right>{right}</right>
        </laneSection></lanes>{rest}</road>"""


@pytest.fixture
def surface_of(tmp_path):
    def read(*parts):
        path = tmp_path / "map.xodr"
        head = '<OpenDRIVE><header revMajor="1" revMinor="8"/>'
        path.write_text(f"{head}{''.join(parts)}</OpenDRIVE>")
        return read_road(path, 0.02)[1]

    return read


@pytest.fixture
def city_of(surface_of):
    return lambda *parts: build_road_city(surface_of(*parts), read_profile("1", "residential"))


def known_ids(city):
    """Ids of all features and their surfaces."""
    features = list(city.walk())
    return {f.id for f in features} | {s.id for f in features for s in f.surfaces}


def signal(name, s, t, rest="", code="274"):
    return (
        f'<signal id="{name}" s="{s}" t="{t}" zOffset="2" dynamic="no" orientation="+"'
        f' country="DE" type="{code}">{rest}</signal>'
    )


SIGNALS = f"""<signals>{signal("a", 50, -8, '<validity fromLane="-2" toLane="-2"/>')}
    {signal("b", 60, -8, '<dependency id="line"/><dependency id="none"/><dependency id="a"/>')}
    {signal("line", 62, 0, code="294")}</signals>"""
REPEATED = '<signals><signalReference id="a" s="50" t="-5" orientation="+"/></signals>'


def test_signs_control_the_lanes_of_their_validity_and_of_their_references(city_of):
    both = [lane(1), lane(2), lane(-1), lane(-2)]
    city = city_of(road("1", both, SIGNALS), road("2", [lane(1), lane(-1)], REPEATED, y=60))
    one, two = city.of_kind("CityFurniture")
    assert one.relations["controls"] == ("road_1_s0_lane_-2", "road_2_s0_lane_-1")
    assert two.relations["controls"] == ("road_1_s0_lane_-1", "road_1_s0_lane_-2")


def test_signs_depend_on_what_their_signals_became(city_of):
    """A sign that is there, and a stop line, which is a marking; not on what is nowhere."""
    city = city_of(road("1", [lane(1), lane(-1), lane(-2)], SIGNALS))
    one, two = city.of_kind("CityFurniture")
    line, other = two.relations["dependsOn"]
    assert {line, other} <= known_ids(city)
    assert (line, other) == ("signal_1_2_paint", one.id)


def test_signs_refer_to_lanes_and_signs_of_other_chunks(surface_of):
    surface = surface_of(
        road("1", [lane(1), lane(-1), lane(-2)], SIGNALS, x=120, y=50),
        road("2", [lane(1), lane(-1)], REPEATED, x=220, y=50),
    )
    chunk = Chunk(0, 0)
    roads = RoadIndex(surface)
    (near,) = in_chunk(near_chunk(roads, chunk), roads, chunk)[:1]
    assert near.relations["controls"] == (
        *("road_1_s0_lane_-2_chunk_0_0", "../1_0/city.gml#road_2_s0_lane_-1"),
    )


def mark(kind, change=""):
    text = f' laneChange="{change}"' if change else ""
    return f'<roadMark sOffset="0" type="{kind}" width="0.12"{text}/>'


@pytest.mark.parametrize(
    ("text", "outwards", "inwards"),
    [
        ("", True, True),
        (mark("broken"), True, True),
        (mark("solid"), False, False),
        (mark("broken", "none"), False, False),
        (mark("solid", "both"), True, True),
        (mark("broken", "decrease"), True, False),
        (mark("broken", "increase"), False, True),
        (mark("solid broken"), False, True),
        (mark("broken solid"), True, False),
        (mark("solid") + mark("broken").replace('"0"', '"50"'), True, True),
        (mark("custom") + mark("none").replace('"0"', '"99.9"'), True, True),
    ],
)
def test_lanes_are_changed_where_the_mark_allows_it(city_of, text, outwards, inwards):
    """Lane -1 is inside of -2, so that from one to the other ids decrease."""
    city = city_of(road("1", [lane(1), lane(-1, mark=text), lane(-2)]))
    spaces = {space.id: space.relations for space in city.of_kind("TrafficSpace")}
    inner, outer = spaces["road_1_s0_lane_-1"], spaces["road_1_s0_lane_-2"]
    assert inner.get("laneChangeRight") == (("road_1_s0_lane_-2",) if outwards else None)
    assert outer.get("laneChangeLeft") == (("road_1_s0_lane_-1",) if inwards else None)


@pytest.mark.parametrize("kind", ["sidewalk", "biking", "parking", "shoulder", "tram"])
def test_vehicles_change_to_lanes_for_vehicles_only(city_of, kind):
    city = city_of(road("1", [lane(1), lane(-1), lane(-2, kind)]))
    for space in city.of_kind("TrafficSpace"):
        assert not {"laneChangeLeft", "laneChangeRight"} & set(space.relations)


def plan_area(polygons):
    return sum(shapely.Polygon(polygons.rings(k)[0][:, :2]).area for k in range(len(polygons)))


@pytest.mark.parametrize("marked", [False, True])
def test_people_cross_on_a_crosswalk_with_and_without_markings(city_of, marked):
    corners = "".join(
        f'<cornerRoad id="{k}" s="{s}" t="{t}" dz="0" height="0"/>'
        for k, (s, t) in enumerate([(48, -3.5), (52, -3.5), (52, 3.5), (48, 3.5)])
    )
    line = (
        '<markings><marking width="0.1" color="white" lineLength="0.2" spaceLength="0.05">'
        '<cornerReference id="0"/><cornerReference id="3"/></marking></markings>'
    )
    rest = f"""<objects><object type="crosswalk" id="z" s="50" t="0" hdg="0"><outlines>
        <outline id="0" closed="true">{corners}</outline></outlines>{line if marked else ""}
        </object></objects>"""
    middle = f'<lane id="0" type="none">{mark("solid")}</lane>'
    walked = [lane(2, "sidewalk"), lane(-2, "sidewalk")]
    city = city_of(road("1", [lane(1), middle, lane(-1), *walked], rest))
    spaces = {space.id: space for space in city.of_kind("TrafficSpace")}
    crossing = [space for space in spaces.values() if space.attributes["function"] == "20"]
    marks = {each.id: each for section in city.of_kind("Section") for each in section.surfaces}
    drawn = [name for name in marks if name.startswith("object_")]
    centre = join([each.polygons for name, each in marks.items() if name not in drawn])

    assert len(crossing) == 1
    walks = {f"road_1_s0_lane_{number}" for number in (2, -2)}
    assert set(crossing[0].relations["successor"]) == walks
    assert all(crossing[0].id in spaces[walk].relations["predecessor"] for walk in walks)
    assert bool(drawn) == marked
    # The line in the middle of the road goes on between lines, and under stripes it does not.
    assert plan_area(centre) == pytest.approx(12.0 if marked else 12.0 - 4 * 0.12, abs=0.3)
    asphalts = set(read_profile("1", "residential").road.materials)
    assert crossing[0].surfaces[0].material in (asphalts if marked else {"marking_white"})


@pytest.mark.parametrize(
    ("rest", "function", "usage", "material", "area"),
    [
        ('type="parkingSpace" t="-8.75" length="5" width="2"', "7", "2", "1", 10),
        ('type="roadSurface" t="-1.75" length="3" width="2"', "1", "2", "1", 6),
        ('type="patch" t="-1.75" length="3" width="2"', "1", "2", "1", 6),
        ('type="roadSurface" t="-1.75" radius="0.5"', "1", "2", "1", 0.785),
        ('type="crosswalk" t="-1.75" length="4" width="3"', "20", "1", "", 6),
    ],
)
def test_flat_objects_are_traffic_spaces_with_their_codes(  # noqa: PLR0917
    city_of, rest, function, usage, material, area
):
    """r:trân's codes; SIG3D lists TrafficArea_function, _usage and _surfaceMaterial."""
    lanes = [lane(1), lane(-1), lane(-2), lane(-3, "parking")]
    flat = f'<objects><object id="x" s="50" {rest}/></objects>'
    city = city_of(road("1", lanes, flat))
    (space,) = [
        each for each in city.of_kind("TrafficSpace") if each.attributes.get("opendrive_id") == "x"
    ]
    (surface,) = space.surfaces
    facts = surface.attributes
    assert (surface.kind, space.attributes["function"], facts["function"]) == (
        *("TrafficArea", function, function),
    )
    assert (facts["usage"], facts.get("surfaceMaterial", "")) == (usage, material)
    assert plan_area(surface.polygons) == pytest.approx(area, rel=0.05)


def facts_of(city):
    """Attributes and relations of the only intersection."""
    (crossing,) = city.of_kind("Intersection")
    return crossing.attributes, crossing.relations, crossing.curves


VIRTUAL = """<junction id="200" name="gate" type="virtual" mainRoad="1" sStart="45" sEnd="55"
    orientation="+"><connection id="0" type="virtual">
    <predecessor elementType="road" elementId="1" elementS="48" elementDir="+"/>
    <successor elementType="road" elementId="2" elementS="0" elementDir="+"/>{links}</connection>
    </junction>"""


@pytest.mark.parametrize(
    ("links", "before"), [("", -2), ('<laneLink from="-1" to="-1"/>', -1)], ids=["outer", "linked"]
)
def test_a_virtual_junction_is_an_intersection_on_its_main_road(city_of, links, before):
    city = city_of(
        road("1", [lane(1), lane(-1), lane(-2)]),
        road("2", [lane(1), lane(-1)], y=-40),
        VIRTUAL.format(links=links),
    )
    attributes, relations, curves = facts_of(city)
    assert attributes == {
        **{"opendrive_junction": "200", "opendrive_junction_type": "virtual"},
        **{"opendrive_name": "gate", "opendrive_main_road": "1", "opendrive_orientation": "+"},
        **{"opendrive_s_start": 45.0, "opendrive_s_end": 55.0},
    }
    assert relations == {"mainRoad": ("Road_1",), "connectedRoad": ("Road_2",)}
    assert [line[[0, -1]].tolist() for line in curves["lod2MultiCurve"]] == [
        [[45, 0, 0], [55, 0, 0]]
    ]
    roads = {top.id: top for top in city.of_kind("Road")}
    for name in ("Road_1", "Road_2"):
        assert roads[name].relations["intersection"] == ("Intersection_200",)
    spaces = {space.id: space.relations for space in city.of_kind("TrafficSpace")}
    leaving = f"road_1_s0_lane_{before}"
    assert spaces[leaving]["virtualSuccessor"] == ("road_2_s0_lane_-1",)
    assert spaces["road_2_s0_lane_-1"]["virtualPredecessor"] == (leaving,)
    assert not any({"predecessor", "successor"} & set(roles) for roles in spaces.values())


def test_a_crossing_of_two_roads_is_an_intersection(city_of):
    level = """<junction id="4 0" type="crossing" name=""><roadSection id="0" roadId="1" sStart="45"
        sEnd="55"/><roadSection id="1" roadId="2" sStart="20" sEnd="30"/></junction>"""
    lanes = [lane(1), lane(-1)]
    city = city_of(road("1", lanes), road("2", lanes, y=40), level)
    attributes, relations, curves = facts_of(city)
    assert attributes == {"opendrive_junction": "4 0", "opendrive_junction_type": "crossing"}
    assert relations == {"connectedRoad": ("Road_1", "Road_2")}
    assert [line[[0, -1], :2].tolist() for line in curves["lod2MultiCurve"]] == [
        *([[45, 0], [55, 0]], [[20, 40], [30, 40]])
    ]


def test_a_direct_junction_is_an_intersection_where_its_roads_meet(city_of, surface_of):
    direct = """<junction id="3" type="direct" name="d"><connection id="0" incomingRoad="1"
        linkedRoad="2" contactPoint="start"><laneLink from="-1" to="-1"/></connection></junction>"""
    parts = [
        road(name, [lane(-1)], x=x).replace("<planView>", f"<link>{link}</link><planView>")
        for name, x, link in (
            ("1", 150, '<successor elementType="junction" elementId="3"/>'),
            ("2", 250, '<predecessor elementType="junction" elementId="3"/>'),
        )
    ]
    city = city_of(*parts, direct)
    attributes, relations, curves = facts_of(city)
    assert attributes["opendrive_junction_type"] == "direct"
    assert (relations, dict(curves)) == ({"connectedRoad": ("Road_1", "Road_2")}, {})
    spaces = {space.id: space.relations for space in city.of_kind("TrafficSpace")}
    assert spaces["road_1_s0_lane_-1"]["successor"] == ("road_2_s0_lane_-1",)

    roads = RoadIndex(surface_of(*parts, direct))
    there = {
        chunk: [
            child.id
            for top in make_roads(chunk, roads, read_profile("1", "residential"))
            for child in top.children
            if child.kind == "Intersection"
        ]
        for chunk in (Chunk(0, 0), Chunk(1, 0), Chunk(2, 0))
    }
    assert there == {Chunk(0, 0): [], Chunk(1, 0): ["Intersection_3"], Chunk(2, 0): []}


def test_a_road_that_begins_along_another_goes_on_from_its_lane(city_of):
    """A link with elementS leads to a place, and not to the start of the other road."""
    branch = road("2", [lane(-1).replace("</lane>", '<link><predecessor id="-1"/></link></lane>')])
    link = (
        '<link><predecessor elementType="road" elementId="1" elementS="50" elementDir="+"/></link>'
    )
    branch = branch.replace('junction="-1"', 'junction="7"').replace(
        "<planView>", f"{link}<planView>"
    )
    junction = '<junction id="7" type="virtual" mainRoad="1" sStart="45" sEnd="55" name="v"/>'
    city = city_of(road("1", [lane(-1)]), branch.replace('y="0"', 'y="-30"'), junction)
    spaces = {space.id: space.relations for space in city.of_kind("TrafficSpace")}
    assert spaces["road_2_s0_lane_-1"] == {"virtualPredecessor": ("road_1_s0_lane_-1",)}
    assert spaces["road_1_s0_lane_-1"] == {"virtualSuccessor": ("road_2_s0_lane_-1",)}
