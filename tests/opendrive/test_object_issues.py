"""No object of a road file vanishes silently: it is in the city or in an issue."""

import re
from collections import Counter

import pytest
from lxml import etree

from envgen_usd.errors import EnvgenError, Severity
from envgen_usd.opendrive.features.road_features import road_features
from envgen_usd.opendrive.object_issues import object_issues
from envgen_usd.opendrive.reader import read_network
from envgen_usd.opendrive.strips.road_overlays import overlay_strips

PLACES = (
    *("objects/object", "objects/objectReference", "objects/tunnel", "objects/bridge"),
    *("signals/signal", "signals/signalReference"),
)


def issues_of(network):
    return object_issues(network, *in_the_city(network))


def in_the_city(network):
    """Features and patches, without the mesh of the surface."""
    roads = network.roads.values()
    patches = {strip.patch for road in roads for _, strip in overlay_strips(road)}
    return road_features(network), patches


@pytest.fixture
def issues_for(network_of, road_xml):
    """Issues of the objects or signals of a road of 100 m to the east with a lane on each side."""
    return lambda rest, **parts: issues_of(network_of(road_xml(rest=rest, **parts)))


def objects(inner):
    return f"<objects>{inner}</objects>"


def lines_shown(network, *parts):
    """Lines of the elements that features and patches show, once for each element."""
    origins = {each.origin for part in parts for each in part}
    return Counter(
        getattr(network.roads[each.road], f"{each.tag}s")[each.number].line for each in origins
    )


def is_named(element, issues):
    """Whether an issue names an element: by its path, or by that of its road left out."""
    road = element.getparent().getparent()
    steps = f"road[id={road.get('id')}]", f"[id={element.get('id')}]"
    left_out = re.escape(steps[0]) + "$"
    return any(
        (issue.line == element.sourceline and issue.where.endswith(steps[1]))
        or (issue.action == "road left out" and re.match(left_out, issue.where))
        for issue in issues
    )


def vanished(path):
    """Elements of a file that neither the city nor an issue tells of."""
    try:
        network = read_network(path)
    except EnvgenError:
        return []
    parts = in_the_city(network)
    issues = (*network.issues, *object_issues(network, *parts))
    shown = lines_shown(network, *parts)
    known = {
        (tag, each.id)
        for road in network.roads.values()
        for tag, sources in (("object", road.objects), ("signal", road.signals))
        for each in sources
        if not each.reference
    }
    lost = []
    for element in (each for tag in PLACES for each in etree.parse(path).iterfind(f"road/{tag}")):
        if shown[element.sourceline] > 0:
            shown[element.sourceline] -= 1
        elif element.tag == "signalReference" and ("signal", element.get("id")) in known:
            continue  # It gives its lanes to the signal that it repeats.
        elif element.tag not in {"tunnel", "bridge"} and not is_named(element, issues):
            lost.append((path.name, element.tag, element.get("id"), element.get("type")))
    return lost


def test_no_object_of_the_corpus_vanishes(corpus):
    """All small files, and some of the larger ones."""
    files = sorted(corpus.rglob("*.xodr"), key=lambda path: (path.stat().st_size, path.name))
    chosen = [path for k, path in enumerate(files) if path.stat().st_size < 100_000 or k % 5 == 0]
    assert len(chosen) > 80
    assert [element for path in chosen for element in vanished(path)] == []


@pytest.mark.parametrize(
    ("inner", "kind", "severity"),
    [
        ('<object type="monument" id="x" s="5" t="9"/>', "object.unknown_type", "info"),
        ('<object type="none" id="x" s="5" t="9"/>', "object.unknown_type", "info"),
        ('<object type="barrier" id="x" s="5" t="9"/>', "object.no_length", "warning"),
        ('<object type="roadSurface" id="x" s="5" t="1"/>', "object.no_place", "warning"),
        ('<object type="crosswalk" id="x" s="5" t="0" length="4"/>', "object.no_place", "warning"),
        ('<object type="parkingSpace" id="x" s="5" t="9"/>', "object.no_place", "warning"),
        (
            '<object type="-1" name="Stencil_STOP" id="x" s="5" t="1" length="2" width="2"/>',
            *("object.no_place", "warning"),
        ),
        ('<object type="wind" id="x" s="5" t="9"/>', "object.part", "info"),
        ('<object type="-1" name="Luminaire_Arm" id="x" s="5" t="9"/>', "object.part", "info"),
        ('<object type="building" id="x" s="5" t="9"/>', "object.no_place", "warning"),
        ('<tunnel id="x" s="200" length="20"/>', "object.no_place", "warning"),
        ('<bridge id="x" s="20" length="0"/>', "object.no_place", "warning"),
        (
            '<object type="tree" id="x" s="0" t="9"><repeat s="200" length="9" distance="3"'
            ' tStart="5" tEnd="5"/></object>',
            *("object.no_place", "warning"),
        ),
    ],
)
def test_an_object_without_a_place_or_a_shape_is_an_issue(issues_for, inner, kind, severity):
    (issue,) = issues_for(objects(inner))
    assert (issue.kind, issue.severity) == (kind, Severity(severity))
    tag = inner[1:].split()[0]
    assert issue.where == f"road[id=1]/objects/{tag}[id=x]"
    assert issue.action
    assert issue.line > 0


def test_the_post_of_a_sign_is_an_issue(issues_for):
    sign = '<signals><signal id="s" s="5" t="5" type="206" country="DE" orientation="+"/></signals>'
    (issue,) = issues_for(sign + objects('<object type="pole" id="x" s="5" t="5.1"/>'))
    assert issue.kind == "object.post_of_sign"


@pytest.mark.parametrize(
    ("rest", "kind"),
    [
        ('<signal id="s" s="5" t="1" type="297" country="DE"/>', "signal.no_shape"),
        ('<signal id="s" s="5" t="1" type="-1" name="Stencil_X"/>', "signal.no_shape"),
        ('<signal id="s" s="50" t="0" type="1000003"/>', "signal.same_crosswalk"),
    ],
)
def test_a_painted_signal_without_paint_is_an_issue(issues_for, rest, kind):
    crosswalk = '<object type="crosswalk" id="x" s="51" t="0" length="4" width="6"/>'
    (issue,) = issues_for(objects(crosswalk) + f"<signals>{rest}</signals>")
    assert (issue.kind, issue.where) == (kind, "road[id=1]/signals/signal[id=s]")


def test_references_are_issues_of_objects_only(issues_for):
    """A signal's reference becomes a relation to the lanes that the signal applies to."""
    both = '<object type="tree" id="x" s="5" t="9"/><objectReference id="x" s="50" t="5"/>'
    signals = (
        '<signals><signal id="s" s="5" t="9" type="206" country="DE"/>'
        '<signalReference id="s" s="50" t="5" orientation="+"/></signals>'
    )
    (issue,) = issues_for(objects(both) + signals)
    assert issue.where == "road[id=1]/objects/objectReference[id=x]"


def test_the_number_of_issues_is_bounded(issues_for):
    many = "".join(f'<object type="wind" id="{k}" s="5" t="9"/>' for k in range(1007))
    issues = issues_for(objects(many))
    assert len(issues) == 1001
    assert issues[-1].message == "7 more of this kind"
