import io
from collections import Counter

import pytest
from lxml import etree
from PIL import Image
from rich.console import Console

from envgen_usd.errors import EnvgenError
from envgen_usd.opendrive.inspect.map_shapes import LANE_COLOURS
from envgen_usd.opendrive.inspect.network_tables import inspect_file
from envgen_usd.opendrive.reader import read_network

REST = """<objects><object id="1" type="tree" name="[red]oak" s="20" t="9" height="5"/></objects>
<signals><signal id="2" type="206" country="DE" s="50" t="-5" zOffset="2"/></signals>"""


@pytest.fixture
def road(write_xodr, road_xml):
    link = '<successor elementType="road" elementId="99" contactPoint="start"/>'
    return write_xodr(road_xml(rest=REST, link=link))


def text_of(tables):
    console = Console(width=120, file=io.StringIO())
    for table in tables:
        console.print(table)
    return console.file.getvalue()


def test_the_summary_says_what_the_file_holds(road):
    text = text_of(inspect_file(road))
    for part in ("driving", "0.200", "0.100 km", "line 1", "tree 1", "DE 206 1", "link.unknown"):
        assert part in text
    assert "there is no road 99; link left out" in text


def test_ends_that_do_not_meet_are_told(write_xodr, road_xml):
    """The file alone does not say so; the lanes' places do."""
    beyond = '<geometry s="0" x="100.5" y="0" hdg="0" length="100"><line/></geometry>'
    there = '<successor elementType="road" elementId="2" contactPoint="start"/>'
    back = '<predecessor elementType="road" elementId="1" contactPoint="end"/>'
    joined = [
        f'<laneSection s="0"><right><lane id="-1" type="driving"><link><{end} id="-1"/></link>'
        '<width sOffset="0" a="3" b="0" c="0" d="0"/></lane></right></laneSection>'
        for end in ("successor", "predecessor")
    ]
    path = write_xodr(
        road_xml("1", link=there, lanes=joined[0])
        + road_xml("2", link=back, lanes=joined[1], plan_view=beyond)
    )
    text = " ".join(text_of(inspect_file(path)).split())
    assert "road[id=1]/lanes/laneSection[1]/lane[id=-1]: its end lies 0.500 m from" in text


def test_a_map_as_svg(road, tmp_path):
    path = tmp_path / "map.svg"
    inspect_file(road, image=path)
    root = etree.parse(path).getroot()
    titles = [element.getparent() for element in root.iter("{*}title")]
    names = {parent.find("{*}title").text: parent for parent in titles}
    assert names["road 1, section 0, lane 1: driving"].get("fill") == LANE_COLOURS["driving"]
    assert any("[red]oak" in name for name in names)
    assert any("link.unknown" in name for name in names)
    # 100 m by 6.5 m of road: the lanes' polygons keep these proportions.
    points = names["road 1, section 0, lane 1: driving"].get("points").split()
    x, y = zip(*(map(float, point.split(",")) for point in points), strict=True)
    assert (max(x) - min(x)) / (max(y) - min(y)) == pytest.approx(100 / 3.5, rel=0.01)


def test_a_map_as_png_shows_the_lanes(road, tmp_path):
    path = tmp_path / "map.png"
    inspect_file(road, image=path)
    with Image.open(path) as image:
        colours, width = image.getcolors(1 << 20), image.size[0]
    grey = tuple(int(LANE_COLOURS["driving"][i : i + 2], 16) for i in (1, 3, 5))
    count = {colour: number for number, colour in colours}[grey]
    assert count > width


def test_the_repaired_file_is_written(road, tmp_path):
    fixed = tmp_path / "fixed.xodr"
    inspect_file(road, fixed=fixed)
    assert read_network(fixed).issues == ()


@pytest.mark.parametrize("name", ["image", "fixed", "listed"])
def test_the_file_that_is_read_is_not_written_over(name, road, tmp_path):
    """A list of no issues emptied it."""
    before, link = road.read_bytes(), tmp_path / "link.svg"
    link.symlink_to(road)
    for target in (road, link):
        with pytest.raises(EnvgenError, match="is what the command reads"):
            inspect_file(road, **{name: target})
    assert road.read_bytes() == before


@pytest.mark.parametrize("name", ["map.gif", "gone/map.svg"])
def test_maps_that_cannot_be_written(road, tmp_path, name):
    with pytest.raises(EnvgenError, match=r"map\.(gif|svg)"):
        inspect_file(road, image=tmp_path / name)


def test_it_ends_with_numbers_and_places(write_xodr, road_xml, tmp_path):
    """However many issues there are, the last lines say how many, and where all of them are."""
    links = "".join(f'<signal id="{number}" s="500" t="0" type="1"/>' for number in range(150))
    path = write_xodr(road_xml(rest=f"<signals>{links}</signals>"))
    listed = tmp_path / "issues.txt"
    tables = inspect_file(path, listed=listed)
    counts = Counter(issue.severity.value for issue in read_network(path).issues)
    assert sum(counts.values()) > 100
    numbers = ", ".join(f"{counts[name]} {name}" for name in ("error", "warning", "info"))
    assert text_of(tables[-1:]).splitlines() == [
        f"issues: {numbers}",
        "map:      none; --image FILE.svg writes one",
        f"list:     {listed}",
        "repaired: none; --fixed FILE.xodr writes one",
    ]
    assert len(listed.read_text().splitlines()) == sum(counts.values())
