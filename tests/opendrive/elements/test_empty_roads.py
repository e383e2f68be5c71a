LINE = '<geometry s="0" x="{x}" y="0" hdg="0" length="{length}"><line/></geometry>'


def lanes(before="", after=""):
    ends = (f'<predecessor id="{before}"/>' if before else "") + (
        f'<successor id="{after}"/>' if after else ""
    )
    width = '<width sOffset="0" a="3" b="0" c="0" d="0"/>'
    right = "".join(
        f'<lane id="{id_}" type="driving"><link>{ends}</link>{width}</lane>' for id_ in (-1, -2)
    )
    return f'<laneSection s="0"><center><lane id="0"/></center><right>{right}</right></laneSection>'


def link(side, id_, point):
    return f'<{side} elementType="road" elementId="{id_}" contactPoint="{point}"/>'


def test_a_road_without_length_is_passed_by(network_of, road_xml, kinds):
    """Trap 4: roads of nothing, made by exporters, do not cut the way."""
    middle_links = link("predecessor", "1", "end") + link("successor", "3", "start")
    xml = (
        road_xml("1", link=link("successor", "2", "start"), lanes=lanes(after="-2"))
        + road_xml(
            "2",
            length="0",
            link=middle_links,
            plan_view=LINE.format(x=100, length=2e-7),
            lanes=lanes("-2", "-1"),
        )
        + road_xml(
            "3",
            link=link("predecessor", "2", "end"),
            plan_view=LINE.format(x=100, length=100),
            lanes=lanes(before="-1"),
        )
    )
    network = network_of(xml)
    assert list(network.roads) == ["1", "3"]
    first, last = network.roads.values()
    assert (first.successor.id, first.successor.contact_point) == ("3", "start")
    assert (last.predecessor.id, last.predecessor.contact_point) == ("1", "end")
    assert first.sections[0].right[0].successors == (-1,)
    assert last.sections[0].right[0].predecessors == (-2,)
    assert kinds(network) == ["road.empty"]


def test_a_lone_road_without_length_is_left_out(network_of, road_xml, kinds):
    empty = road_xml("2", length="0", plan_view=LINE.format(x=0, length=0))
    network = network_of(road_xml("1") + empty)
    assert list(network.roads) == ["1"]
    assert "plan_view.empty" in kinds(network)
