"""What is read, and what is refused with one line."""

import gzip

import numpy as np
import pytest

from envgen_usd.errors import EnvgenError
from envgen_usd.opendrive.reader import read_network


def test_a_road_by_the_book(network_of, road_xml):
    network = network_of(
        road_xml(
            elevation='<elevation s="0" a="1" b="0.1" c="0" d="0"/>',
            rest='<objects><object id="7" type="tree" s="9" t="8" height="6"/></objects>',
        )
    )
    (road,) = network.roads.values()
    assert network.issues == ()
    assert road.length == 100
    assert road.elevation(np.array([50.0]))[0] == 6
    assert [lane.id for lane in road.sections[0].left + road.sections[0].right] == [1, -1]
    assert (road.objects[0].type, road.objects[0].height) == ("tree", 6)


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"", "empty"),
        (b"hello", "not valid XML"),
        (b"<OpenDRIVE><road>", "not valid XML"),
        (b"<html><body/></html>", "root element is html"),
        (b"<OpenDRIVE><header/></OpenDRIVE>", "no road"),
        (b'<OpenDRIVE><road id="1" length="1"/></OpenDRIVE>', "no usable road"),
        (b"PK\x03\x04 and more", "zip archive"),
        (gzip.compress(b"<OpenDRIVE/>", mtime=0), "no road"),
    ],
)
def test_refused_with_one_line_that_names_the_file(tmp_path, content, says):
    path = tmp_path / "bad.xodr"
    path.write_bytes(content)
    with pytest.raises(EnvgenError, match=says) as caught:
        read_network(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_missing_files_and_folders(tmp_path):
    with pytest.raises(EnvgenError, match="no such file"):
        read_network(tmp_path / "none.xodr")
    with pytest.raises(EnvgenError, match="not a regular file"):
        read_network(tmp_path)


def test_the_error_says_where_the_only_road_is_wrong(write_xodr, road_xml):
    path = write_xodr(road_xml(plan_view='<geometry s="0" x="nan" y="0" hdg="0" length="9"/>'))
    with pytest.raises(EnvgenError, match=r"road\[id=1\]/planView/geometry .line \d+.: x='nan'"):
        read_network(path)


def test_a_road_that_cannot_be_placed_does_not_cost_the_others(network_of, road_xml, kinds):
    bad = road_xml(
        "2", plan_view='<geometry s="0" x="inf" y="0" hdg="0" length="9"><line/></geometry>'
    )
    network = network_of(road_xml() + bad)
    assert list(network.roads) == ["1"]
    assert kinds(network) == ["number.not_finite"]
    assert network.issues[0].severity == "error"


def test_content_counts_and_not_the_declared_revision(network_of, road_xml):
    """Trap 1: laneOffset and rule in a file that says 1.1."""
    lanes = (
        '<laneOffset s="0" a="1" b="0" c="0" d="0"/>'
        + road_xml().split("<lanes>")[1].split("</lanes>")[0]
    )
    xml = road_xml(attributes='junction="-1" rule="LHT"', lanes=lanes)
    network = network_of(xml, head='<header revMajor="1" revMinor="1"/>')
    assert network.roads["1"].rule == "LHT"
    assert network.roads["1"].lane_offset(np.array([5.0]))[0] == 1


@pytest.mark.parametrize(
    "namespace",
    ["http://code.asam.net/simulation/standard/opendrive_schema", "http://www.opendrive.org"],
)
@pytest.mark.parametrize("bom", [b"", b"\xef\xbb\xbf"])
def test_namespaces_and_byte_order_marks(tmp_path, road_xml, namespace, bom):
    """Trap 2."""
    path = tmp_path / "map.xodr"
    path.write_bytes(
        bom + f'<OpenDRIVE xmlns="{namespace}">{road_xml("Main St.")}</OpenDRIVE>'.encode()
    )
    network = read_network(path)
    assert list(network.roads) == ["Main St."]
    assert [issue.kind for issue in network.issues] == ["header.missing"]


def test_wrong_encoding_is_read_as_latin_1(tmp_path, road_xml):
    path = tmp_path / "map.xodr"
    text = '<?xml version="1.0" encoding="UTF-8"?><OpenDRIVE><header/>' + road_xml("Straße")
    path.write_bytes((text + "</OpenDRIVE>").encode("latin-1"))
    network = read_network(path)
    assert list(network.roads) == ["Straße"]
    assert "file.encoding" in [issue.kind for issue in network.issues]


def test_a_wrong_name_of_the_root_is_no_reason_to_refuse_roads(tmp_path, road_xml):
    path = tmp_path / "map.xodr"
    path.write_text(f"<ODrive><header/>{road_xml()}</ODrive>")
    network = read_network(path)
    assert "root.name" in [issue.kind for issue in network.issues]
    assert list(network.roads) == ["1"]


def test_header_user_data_and_controllers_are_kept(network_of, road_xml):
    head = """<header revMajor="1" revMinor="5"><geoReference><![CDATA[+proj=utm +zone=32]]>
      </geoReference><offset x="5300000" y="2" z="3" hdg="0.5"/></header>"""
    rest = '<userData code="a"><deep x="1"><deeper/></deep></userData>'
    controller = '<controller id="4"><control signalId="9"/></controller>'
    network = network_of(road_xml(rest=rest) + controller, head=head)
    assert network.geo_reference == "+proj=utm +zone=32"
    assert network.offset == (5300000, 2, 3, 0.5)
    assert network.roads["1"].extra[0].children[0].children[0].tag == "deeper"
    assert network.controllers[0].children[0].attributes == {"signalId": "9"}


def test_every_road_keeps_a_name_of_its_own(network_of, road_xml, kinds):
    nameless = road_xml("").replace('id=""', "")
    network = network_of(road_xml("7") + road_xml("7") + nameless)
    assert list(network.roads) == ["7", "7_2", "road_2"]
    assert kinds(network) == ["id.not_unique", "id.not_unique"]


def test_issues_tell_the_place(network_of, road_xml):
    xml = road_xml(
        lanes='<laneSection s="0"><center><lane id="0"/></center><right>'
        '\n<lane id="-1"><width sOffset="0" a="x" b="0" c="0" d="0"/></lane></right></laneSection>'
    )
    network = network_of(xml)
    places = {issue.kind: (issue.where, issue.line) for issue in network.issues}
    where, line = places["lane.no_type"]
    assert where == "road[id=1]/lanes/laneSection/right/lane[id=-1]"
    assert line == 1 + xml[: xml.index('id="-1"')].count("\n")
    assert places["number.not_finite"][0] == f"{where}/width"


def test_of_a_file_that_breaks_off_the_whole_roads_are_used(tmp_path, road_xml, kinds):
    text = f"<OpenDRIVE>{road_xml('1')}{road_xml('2')}{road_xml('3')}</OpenDRIVE>"
    path = tmp_path / "map.xodr"
    for end in ("<lanes>", "</laneSection>", "</planView>", "</road>"):
        path.write_text(text[: text.rindex(end) - 5])
        network = read_network(path)
        assert list(network.roads) == ["1", "2"]
        assert kinds(network) == ["file.broken", "header.missing"]
        assert network.issues[0].severity == "error"


def test_a_broken_file_that_declares_entities_is_refused(tmp_path, road_xml):
    path = tmp_path / "map.xodr"
    doctype = '<!DOCTYPE x [<!ENTITY a SYSTEM "file:///etc/passwd">]>'
    path.write_text(f"{doctype}<OpenDRIVE>{road_xml('1')}{road_xml('2')}<road")
    with pytest.raises(EnvgenError, match="not valid XML"):
        read_network(path)
