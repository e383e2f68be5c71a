"""Hostile files are refused, and quickly (trap 7)."""

import time
from collections.abc import Iterator

import numpy as np
import pytest

from envgen_usd.errors import EnvgenError
from envgen_usd.opendrive.features.road_features import road_features
from envgen_usd.opendrive.reader import read_network
from envgen_usd.opendrive.surface import build_surface

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
    refused(tmp_path / "map.xodr", text, "refused|not valid XML")


def test_nesting_without_end(tmp_path):
    refused(tmp_path / "map.xodr", "<OpenDRIVE>" + "<road>" * 100_000, "not valid XML")


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


def test_includes_one_within_the_other_end_at_a_depth(tmp_path, road_xml):
    """Eight files that each include the next are read, a hundred are not."""
    for count, says in ((8, None), (100, "itself")):
        folder = tmp_path / str(count)
        folder.mkdir()
        for number in range(count):
            following = f'<include file="{number + 1}.xml"/>' if number + 1 < count else ""
            (folder / f"{number}.xml").write_text(f"<OpenDRIVE>{following}</OpenDRIVE>")
        path = folder / "map.xodr"
        text = f'<OpenDRIVE>{road_xml()}<include file="0.xml"/></OpenDRIVE>'
        if says:
            refused(path, text, says)
        else:
            path.write_text(text)
            assert len(read_network(path).roads) == 1


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
    refused(tmp_path / "map.xodr", f"<OpenDRIVE>{xml}</OpenDRIVE>", "not a finite number")


@pytest.mark.parametrize(
    ("parts", "says"),
    [
        (
            {"plan_view": '<geometry s="0" x="0" y="0" hdg="0" length="1e9"><line/></geometry>'},
            r"road is 1e\+09 m long",
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
    ],
)
def test_figures_that_would_make_a_billion_samples(tmp_path, road_xml, parts, says):
    text = f"<OpenDRIVE>{road_xml(**parts)}</OpenDRIVE>"
    refused(tmp_path / "map.xodr", text, says)


def sized(**more):
    lane = '<width sOffset="0" a="3" b="{b}" c="0" d="0"/>{mark}'.format(
        **{"b": 0, "mark": ""} | more
    )
    return (
        '<laneSection s="0"><center><lane id="0" type="none"/></center>'
        f'<right><lane id="-1" type="driving">{lane}</lane></right></laneSection>'
    )


OFFSET = '<laneOffset s="0" a="0" b="1e7" c="0" d="0"/>'
SWAY = '<roadMark sOffset="0" type="solid"><sway ds="0" a="0" b="1e6" c="0" d="0"/></roadMark>'
ASIDE = (
    '<roadMark sOffset="0" type="solid"><type name="solid" width="0.12">'
    '<line length="4" space="8" tOffset="4e9" sOffset="0"/></type></roadMark>'
)
EXPLICIT = (
    '<roadMark sOffset="0" type="solid"><explicit>'
    '<line length="4" tOffset="-4e9" sOffset="0"/></explicit></roadMark>'
)
RAISED = '<height sOffset="0" inner="1e9" outer="0"/>'
SQUARE = "".join(f'<cornerLocal u="{u}" v="{v}" z="0"/>' for u, v in ((0, 0), (1e8, 0), (0, 1e8)))


def objects(attributes, inside=""):
    return f'<objects><object id="1" s="9" t="5" {attributes}>{inside}</object></objects>'


@pytest.mark.parametrize(
    ("parts", "kind"),
    [
        ({"elevation": '<elevation s="0" a="0" b="0" c="1e9" d="0"/>'}, "number.beyond_bounds"),
        ({"elevation": '<elevation s="0" a="1e9" b="0" c="0" d="0"/>'}, "number.beyond_bounds"),
        ({"lateral": '<superelevation s="0" a="0" b="9" c="0" d="0"/>'}, "number.beyond_bounds"),
        ({"lateral": '<superelevation s="0" a="1.6" b="0" c="0" d="0"/>'}, "number.beyond_bounds"),
        ({"lateral": '<shape s="0" t="0" a="0" b="0" c="1e6" d="0"/>'}, "number.beyond_bounds"),
        ({"lanes": OFFSET + sized()}, "number.beyond_bounds"),
        ({"lanes": sized(b=1e9)}, "number.beyond_bounds"),
        ({"lanes": sized(mark=SWAY)}, "number.beyond_bounds"),
        ({"lanes": sized(mark=ASIDE)}, "number.beyond_bounds"),
        ({"lanes": sized(mark=EXPLICIT)}, "number.beyond_bounds"),
        ({"lanes": sized(mark=RAISED)}, "number.beyond_bounds"),
        ({"rest": objects('type="tree" zOffset="1e9"')}, "number.beyond_bounds"),
        ({"rest": objects('type="tree" height="1e9"')}, "number.beyond_bounds"),
        (
            {"rest": objects('type="tree"', '<repeat s="0" length="100" distance="1e-9"/>')},
            "repeat.endless",
        ),
        (
            {"rest": objects('type="tree"', '<repeat s="0" length="100" distance="0.001"/>')},
            "repeat.endless",
        ),
        (
            {"rest": objects('type="barrier"', '<repeat s="0" length="1e11" distance="0"/>')},
            "repeat.endless",
        ),
        (
            {"rest": objects('type="tree"', '<repeat s="0" length="9e5" distance="1"/>')},
            "repeat.endless",
        ),
        ({"rest": objects('type="crosswalk" length="1e8" width="1e8"')}, "object.endless"),
        ({"rest": objects('type="crosswalk"', f"<outline>{SQUARE}</outline>")}, "object.endless"),
        ({"rest": objects('type="railing" length="9e3"')}, "object.endless"),
        (
            {
                "rest": objects(
                    'type="railing"',
                    '<repeat s="0" length="90" distance="0.1" lengthStart="900" lengthEnd="900"/>',
                )
            },
            "repeat.endless",
        ),
        (
            {
                "rest": objects(
                    'type="crosswalk"',
                    '<repeat s="0" length="90" distance="0" widthStart="9e3" widthEnd="9e3"/>',
                )
            },
            "object.endless",
        ),
    ],
)
def test_what_no_road_has_is_left_out_and_the_rest_is_built(network_of, road_xml, parts, kind):
    """Everything that is sampled or repeated has a bound; the file is still a road of 100 m."""
    network = network_of(road_xml(**parts))
    (issue,) = network.issues
    assert (issue.kind, issue.severity) == (kind, "error")
    assert issue.action
    surface = build_surface(network)
    assert np.abs(surface.vertices).max() == 100
    assert len(surface.triangles) < 100
    assert len(road_features(network)) <= 1


@pytest.mark.parametrize(("width", "beyond"), [(30, True), (20, False)])
def test_many_lanes_together_are_bounded(network_of, road_xml, kinds, width, beyond):
    """Forty lanes of 30 m would be a road of 1.2 km."""
    size = f'<width sOffset="0" a="{width}" b="0" c="0" d="0"/>'
    right = "".join(f'<lane id="{-n}" type="driving">{size}</lane>' for n in range(1, 41))
    centre = '<center><lane id="0" type="none"/></center>'
    lanes = f'<laneSection s="0">{centre}<right>{right}</right></laneSection>'
    found = set(kinds(network_of(road_xml(lanes=lanes))))
    assert ("number.beyond_bounds" in found) == beyond


@pytest.mark.parametrize(("spike", "other"), [(0, 0.5), (100, 99.5)])
def test_a_lateral_profile_of_kilometres_at_an_end_of_a_road(
    network_of, road_xml, kinds, spike, other
):
    rows = sorted([(spike, 9e3), (other, 0), (50, 0)])
    shapes = [f'<shape s="{s}" t="0" a="{a}" b="0" c="0" d="0"/>' for s, a in rows]
    network = network_of(road_xml(lateral="".join(shapes)))
    assert kinds(network) == ["number.beyond_bounds"] * 3
    assert np.abs(build_surface(network).vertices).max() == 100


@pytest.mark.parametrize(
    "curve",
    [
        '<spiral curvStart="-10" curvEnd="10"/>',
        '<spiral curvStart="-1e5" curvEnd="1e5"/>',
        '<arc curvature="1"/>',
        '<poly3 a="0" b="0" c="10" d="-1"/>',
    ],
)
def test_curves_that_wind_over_themselves(tmp_path, road_xml, curve):
    plan = f'<geometry s="0" x="0" y="0" hdg="0" length="100">{curve}</geometry>'
    text = f"<OpenDRIVE>{road_xml(plan_view=plan)}</OpenDRIVE>"
    refused(tmp_path / "map.xodr", text, "no usable road")


NO_BENDS = 'cU="0" dU="0" cV="0" dV="0"'


@pytest.mark.parametrize(
    ("curve", "reach"),
    [
        ('<poly3 a="{}" b="0" c="0" d="0"/>', 90),
        (f'<paramPoly3 pRange="normalized" aU="{{}}" bU="9" {NO_BENDS} aV="0" bV="0"/>', 90),
        (f'<paramPoly3 pRange="arcLength" aU="0" bU="1" {NO_BENDS} aV="0" bV="{{}}"/>', 9),
    ],
)
@pytest.mark.parametrize("is_refused", [True, False])
def test_straight_cubics_across_the_earth_end_the_road(
    network_of, road_xml, curve, reach, is_refused
):
    """They need no samples; a place of 4e9 m made lanes that took gigabytes."""
    straight = '<geometry s="0" x="0" y="0" hdg="0" length="50"><line/></geometry>'
    value = 4e9 if is_refused else reach
    wild = f'<geometry s="50" x="50" y="0" hdg="0" length="9">{curve.format(value)}</geometry>'
    network = network_of(road_xml(plan_view=straight + wild, length="59"))
    found = {issue.kind for issue in network.issues}
    assert ("plan_view.endless" in found) == is_refused
    assert np.abs(build_surface(network).vertices).max() < 200


@pytest.mark.parametrize(("length", "is_refused"), [(9e5, True), (90.0, False)])
def test_a_length_that_a_cubic_never_has(network_of, road_xml, length, is_refused):
    """A curve of 9 m was divided as if it went on for 900 km."""
    straight = '<geometry s="0" x="0" y="0" hdg="0" length="50"><line/></geometry>'
    curve = f'<paramPoly3 pRange="normalized" aU="0" bU="9" {NO_BENDS} aV="0" bV="0"/>'
    wild = f'<geometry s="50" x="50" y="0" hdg="0" length="{length}">{curve}</geometry>'
    network = network_of(road_xml(plan_view=straight + wild, length=str(50 + length)))
    found = {issue.kind for issue in network.issues}
    assert ("plan_view.endless" in found) == is_refused
    assert network.roads["1"].length == (50.0 if is_refused else 50.0 + length)


@pytest.mark.parametrize("straight_after", [np.inf, 60.0])
@pytest.mark.parametrize(("c", "is_refused"), [(29.0, False), (35.0, True)])
def test_a_bend_below_the_sharpest_radius_is_refused(
    tmp_path, road_xml, c, is_refused, straight_after
):
    """The least radius of v = c u² is 1 / 2c; 1.6 cm is the limit, and 35 1/m is 1.4 cm.

    With d = -c / 3u the bend is the same at the start, and straight at u.
    """
    curve = f'<poly3 a="0" b="0" c="{c}" d="{-c / (3 * straight_after)}"/>'
    plan = f'<geometry s="0" x="0" y="0" hdg="0" length="60">{curve}</geometry>'
    path = tmp_path / "map.xodr"
    text = f"<OpenDRIVE>{road_xml(plan_view=plan, length='60')}</OpenDRIVE>"
    if is_refused:
        refused(path, text, "no usable road")
    else:
        path.write_text(text)
        assert not [issue for issue in read_network(path).issues if "endless" in issue.kind]


@pytest.mark.parametrize("attributes", ['gridSpacing="1e9"', 'gridSpacing="1" sStart="1e11"'])
def test_an_endless_elevation_grid(network_of, road_xml, kinds, attributes):
    grid = f'<elevationGrid {attributes}><elevation center="1" left="1" right="1"/></elevationGrid>'
    line = '<geometry s="0" x="0" y="0" hdg="0" length="1e11"><line/></geometry>'
    junction = f'<junction id="9"><planView>{line}</planView>{grid}</junction>'
    network = network_of(road_xml(attributes='junction="9"') + junction)
    assert network.junctions["9"].elevation_grid is None
    assert network.junctions["9"].plan_view is None
    assert {"junction.elevation_grid", "plan_view.endless"} <= set(kinds(network))
    assert len(build_surface(network).triangles) < 100


def test_roads_without_any_lane_are_refused_in_one_line(network_of, road_xml):
    lanes = '<laneSection s="0"><center><lane id="0" type="none"/></center></laneSection>'
    with pytest.raises(EnvgenError, match="no road has a lane with a width"):
        build_surface(network_of(road_xml(lanes=lanes)))


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


def test_an_offset_that_begins_late_does_not_run_away_before(network_of, road_xml, kinds):
    offset = '<laneOffset s="80" a="0.5" b="0" c="0.1" d="-0.01"/>'
    network = network_of(road_xml(lanes=offset.replace("0.1", "0.5") + sized()))
    assert kinds(network) == ["lane_offset.step"]
    values = network.roads["1"].lane_offset(np.array([0.0, 40.0, 80.0, 90.0]))
    np.testing.assert_allclose(values, [0.0, 0.0, 0.5, 40.5])
