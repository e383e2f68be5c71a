"""What was repaired stays repaired."""

import dataclasses

import numpy as np
import pytest
from lxml import etree

from envgen_usd.errors import EnvgenError
from envgen_usd.opendrive.document.write import write_document
from envgen_usd.opendrive.reader import read, read_network

ODD_LANES = """
<laneOffset s="9" a="1,5" b="0" c="0" d="0"/><laneOffset s="0" a="1" b="0" c="0" d="0"/>
<laneSection s="60"><right><lane id="-1"><width sOffset="0" a="2" b="-0.1" c="0" d="0"/></lane>
</right></laneSection>
<laneSection s="1"><left><lane id="1" type="driving"/><lane id="1" type="driving"/></left>
  <center><lane id="0"><roadMark sOffset="-1e-12" type="broken"><type name="b">
    <line length="1e-6" space="1e-6" sOffset="0" tOffset="0"/></type></roadMark></lane></center>
  <right><lane id="-1" type="driving"><link><successor id="-3"/></link>
    <width sOffset="0" a="nan" b="0" c="0" d="0"/><width sOffset="-1" a="3" b="0" c="0" d="0"/>
    <height sOffset="0" heightInner="0.1" heightOuter="0.1"/><speed sOffset="0" max="5" unit="x"/>
  </lane></right></laneSection>
<laneSection s="100"><center><lane id="0"/></center></laneSection>
"""
ODD_PLAN = """
<geometry s="50" x="50" y="0" hdg="0" length="50"><arc curvature="0"/></geometry>
<geometry s="0" x="0" y="0" hdg="0" length="50.00"><spiral curvStart="0" curvEnd="0"/></geometry>
<geometry s="50" x="50" y="0" hdg="0" length="1e-9"><line/></geometry>
"""
ODD_REST = """
<type s="0" typ="town"/>
<objects><object id="1" type="tree" s="0" t="0" zoffset="1"><outline><cornerLocal u="0"/></outline>
  <repeat s="0" length="-4" distance="1"/></object></objects>
"""
ODD = (
    '<link><successor elementType="road" elementId="8"/></link>',
    '<junction id="5"><connection id="0" incomingRoad="77" connectingRoad="1"/></junction>',
)


def same(a, b):
    """Whether two models are equal, arrays by their values, without lines in the file."""
    if dataclasses.is_dataclass(a):
        names = {field.name for field in dataclasses.fields(a)} - {"line", "issues"}
        return type(a) is type(b) and all(same(getattr(a, n), getattr(b, n)) for n in names)
    if isinstance(a, np.ndarray):
        return np.array_equal(a, b, equal_nan=True)
    if isinstance(a, tuple):
        return len(a) == len(b) and all(map(same, a, b))
    if isinstance(a, dict):
        return list(a) == list(b) and all(same(a[key], b[key]) for key in a)
    return a == b or (a != a and b != b)  # noqa: PLR0124 - NaN


def reread(reading, tmp_path):
    path = tmp_path / "fixed" / reading.document.path.name
    path.parent.mkdir(exist_ok=True)
    write_document(reading.document, path)
    return read_network(path), path


@pytest.fixture
def odd(read_xodr, road_xml):
    xml = road_xml(
        attributes='junction="6" rule="left"',
        length="7",
        plan_view=ODD_PLAN,
        lanes=ODD_LANES,
        rest=ODD_REST,
    )
    xml = xml.replace("<link></link>", ODD[0], 1)
    return read_xodr(xml + road_xml("1") + ODD[1], head="")


def test_nothing_that_was_repaired_is_odd_again(odd, tmp_path):
    repaired = {issue.kind for issue in odd.network.issues if issue.action}
    assert len(repaired) > 20
    network, _ = reread(odd, tmp_path)
    assert [issue for issue in network.issues if issue.action] == []


def test_the_repaired_file_says_the_same(odd, tmp_path):
    network, _ = reread(odd, tmp_path)
    assert same(network.roads, odd.network.roads)
    assert same(network.junctions, odd.network.junctions)


def test_namespaces_comments_and_user_data_stay(tmp_path, road_xml):
    path = tmp_path / "map.xodr"
    road = road_xml(
        length="3", rest='<!-- kept --><userData code="x"><y xmlns="other"/></userData>'
    )
    path.write_text(f'<OpenDRIVE xmlns="http://x.org"><header/>{road}</OpenDRIVE>')
    _, fixed = reread(read(path), tmp_path)
    root = etree.parse(fixed).getroot()
    assert root.tag == "{http://x.org}OpenDRIVE"
    assert root.find(".//{http://x.org}road").get("length") == "100.0"
    assert root.find(".//{other}y") is not None
    assert b"<!-- kept -->" in fixed.read_bytes()


def test_a_file_without_faults_is_not_changed(read_xodr, road_xml, tmp_path):
    reading = read_xodr(road_xml())
    _, fixed = reread(reading, tmp_path)
    before, after = (
        etree.tostring(etree.parse(path), method="c14n") for path in (reading.document.path, fixed)
    )
    assert before == after


def test_every_file_of_the_corpus(corpus, tmp_path):
    for path in sorted(corpus.glob("*/*.xodr")):
        if path.stat().st_size > 400_000:
            continue
        try:
            reading = read(path)
        except EnvgenError:
            continue
        network, _ = reread(reading, tmp_path)
        assert [issue for issue in network.issues if issue.action] == [], path
        assert same(network.roads, reading.network.roads), path
