"""Hostile files are refused, and quickly (trap 7)."""

import time
from collections.abc import Iterator

import pytest

from envgen_usd.errors import EnvgenError
from envgen_usd.opendrive.reader import read_network

LAUGH = '<!ENTITY a "ha">' + "".join(
    f'<!ENTITY {chr(98 + i)} "{f"&{chr(97 + i)};" * 10}">' for i in range(9)
)


@pytest.fixture(autouse=True)
def _quick() -> Iterator[None]:
    start = time.perf_counter()
    yield
    assert time.perf_counter() - start < 5


def refused(path, text, says):
    path.write_text(text)
    with pytest.raises(EnvgenError, match=says) as caught:
        read_network(path)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("doctype", "body"),
    [
        (f"<!DOCTYPE x [{LAUGH}]>", '<header name="&j;"/>'),
        (f"<!DOCTYPE x [{LAUGH}]>", "<header>&j;</header>"),
        ('<!DOCTYPE x [<!ENTITY a SYSTEM "file:///etc/passwd">]>', "<header>&a;</header>"),
        ('<!DOCTYPE x [<!ENTITY a SYSTEM "file:///etc/passwd">]>', ""),
        ('<!DOCTYPE x [<!ENTITY % a SYSTEM "file:///etc/passwd"> %a;]>', ""),
        ('<!DOCTYPE x SYSTEM "http://127.0.0.1:1/x.dtd">', ""),
        ('<!DOCTYPE x PUBLIC "-//x//" "http://127.0.0.1:1/x.dtd">', ""),
    ],
)
def test_entities(tmp_path, road_xml, doctype, body):
    text = f"{doctype}<OpenDRIVE>{body}{road_xml()}</OpenDRIVE>"
    refused(tmp_path / "map.xodr", text, "refused|no XML")


def test_nesting_without_end(tmp_path):
    refused(tmp_path / "map.xodr", "<OpenDRIVE>" + "<road>" * 100_000, "no XML")


@pytest.mark.parametrize(
    "name", ["../secret.xml", "/etc/passwd", "http://x.example/a.xml", "link.xml"]
)
def test_includes_that_leave_the_folder(tmp_path, road_xml, name):
    folder = tmp_path / "maps"
    folder.mkdir()
    (tmp_path / "secret.xml").write_text(road_xml("secret"))
    (folder / "link.xml").symlink_to(tmp_path / "secret.xml")
    text = f'<OpenDRIVE><header/>{road_xml()}<include file="{name}"/></OpenDRIVE>'
    refused(folder / "map.xodr", text, "outside the file's folder")


def test_includes_that_include_themselves(tmp_path, road_xml):
    again = '<OpenDRIVE><include file="a.xml"/><include file="a.xml"/></OpenDRIVE>'
    (tmp_path / "a.xml").write_text(again)
    text = f'<OpenDRIVE>{road_xml()}<include file="a.xml"/></OpenDRIVE>'
    refused(tmp_path / "map.xodr", text, "itself")


def test_an_include_that_is_a_whole_file(tmp_path, road_xml):
    (tmp_path / "a.xml").write_text('<include file="b.xml"/>')
    (tmp_path / "b.xml").write_text(road_xml("b"))
    text = f'<OpenDRIVE>{road_xml()}<include file="a.xml"/></OpenDRIVE>'
    refused(tmp_path / "map.xodr", text, "a whole file")


def test_includes_inside_the_folder_are_followed(tmp_path, road_xml):
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "second.xml").write_text(road_xml("2"))
    (tmp_path / "more.xml").write_text(
        f'<OpenDRIVE>{road_xml("3")}<include file="parts/second.xml"/></OpenDRIVE>'
    )
    path = tmp_path / "map.xodr"
    include = '<include file="more.xml"/><include file="gone.xml"/>'
    path.write_text(f"<OpenDRIVE><header/>{road_xml()}{include}</OpenDRIVE>")
    network = read_network(path)
    assert set(network.roads) == {"1", "2", "3"}
    assert [issue.kind for issue in network.issues if "include" in issue.kind] == [
        "include.missing"
    ]


@pytest.mark.parametrize("value", ["nan", "inf", "-inf", "1e999", "NaN"])
@pytest.mark.parametrize("name", ["s", "x", "y", "hdg", "length"])
def test_geometry_that_is_not_finite(tmp_path, road_xml, name, value):
    attributes = {"s": "0", "x": "0", "y": "0", "hdg": "0", "length": "10"} | {name: value}
    given = " ".join(f'{key}="{text}"' for key, text in attributes.items())
    xml = road_xml(plan_view=f"<geometry {given}><line/></geometry>")
    refused(tmp_path / "map.xodr", f"<OpenDRIVE>{xml}</OpenDRIVE>", "no finite number")


@pytest.mark.parametrize(
    ("parts", "says"),
    [
        (
            {"plan_view": '<geometry s="0" x="0" y="0" hdg="0" length="1e9"><line/></geometry>'},
            "road of",
        ),
        (
            {
                "plan_view": '<geometry s="0" x="0" y="0" hdg="0" length="1e5">'
                '<arc curvature="1e5"/></geometry>'
            },
            "samples",
        ),
        (
            {
                "plan_view": '<geometry s="0" x="0" y="0" hdg="0" length="1e5">'
                '<spiral curvStart="0" curvEnd="1e6"/></geometry>'
            },
            "samples",
        ),
        ({"elevation": '<elevation s="0" a="0" b="0" c="1e9" d="0"/>'}, "elevation"),
        (
            {
                "rest": '<objects><object id="1" type="tree" s="0" t="0">'
                '<repeat s="0" length="100" distance="1e-9"/></object></objects>'
            },
            "instances",
        ),
        (
            {
                "rest": '<objects><object id="1" type="barrier" s="0" t="0">'
                '<repeat s="0" length="1e11" distance="0"/></object></objects>'
            },
            "a repeat over",
        ),
    ],
)
def test_figures_that_would_make_a_billion_samples(tmp_path, road_xml, parts, says):
    text = f"<OpenDRIVE>{road_xml(**parts)}</OpenDRIVE>"
    refused(tmp_path / "map.xodr", text, says)


def test_dashes_nobody_could_see_become_one_line(network_of, road_xml, kinds):
    mark = """<roadMark sOffset="0" type="broken"><type name="x" width="0.1">
      <line length="1e-9" space="1e-9" tOffset="0" sOffset="0"/></type></roadMark>"""
    lanes = (
        f'<laneSection s="0"><center><lane id="0" type="none">{mark}</lane></center></laneSection>'
    )
    network = network_of(road_xml(lanes=lanes))
    (line,) = network.roads["1"].sections[0].centre.marks[0].lines
    assert line.space == 0
    assert kinds(network) == ["road_mark.dense"]


def test_a_flood_of_faults_is_reported_in_short(network_of, road_xml):
    many = "".join('<lane id="x"/>' for _ in range(5000))
    lanes = f'<laneSection s="0"><center><lane id="0"/></center><right>{many}</right></laneSection>'
    network = network_of(road_xml(lanes=lanes))
    assert len(network.issues) < 1100
    assert "4000 more" in network.issues[-1].message
