"""What is odd in lanes, junctions and objects is told, and repaired where that is possible."""

import numpy as np
import pytest

from envgen_usd.opendrive.surface import build_surface

CENTRE = '<center><lane id="0" type="none"/></center>'


def lane(id_, extent):
    side = "left" if id_ > 0 else "right"
    return f'<{side}><lane id="{id_}" type="driving">{extent}</lane></{side}>'


def border(a):
    return f'<border sOffset="0" a="{a}" b="0" c="0" d="0"/>'


@pytest.mark.parametrize("id_", [1, -1])
def test_a_border_on_the_wrong_side(network_of, road_xml, kinds, id_):
    lanes = f'<laneSection s="0">{CENTRE}{lane(id_, border(-3.0 * id_))}</laneSection>'
    network = network_of(road_xml(lanes=lanes))
    assert kinds(network) == ["lane.border_sign"]
    y = build_surface(network).vertices[:, 1]
    assert sorted((y.min(), y.max())) == sorted((0, 3 * id_))


def test_a_border_on_its_own_side_stays(network_of, road_xml, kinds):
    lanes = f'<laneSection s="0">{CENTRE}{lane(-1, border(-3))}</laneSection>'
    assert kinds(network_of(road_xml(lanes=lanes))) == []


def test_a_first_width_that_starts_late(network_of, road_xml, kinds):
    width = '<width sOffset="50" a="3" b="0" c="0" d="0"/>'
    lanes = f'<laneSection s="0">{CENTRE}{lane(-1, width)}</laneSection>'
    network = network_of(road_xml(lanes=lanes))
    assert kinds(network) == ["lane.late_width"]
    assert network.roads["1"].sections[0].right[0].width(np.zeros(1)) == 3


def test_an_elevation_grid_that_lies_on_nothing(network_of, road_xml, kinds):
    grid = '<elevationGrid gridSpacing="1"><elevation center="1"/></elevationGrid>'
    network = network_of(
        road_xml(attributes='junction="9"') + f'<junction id="9">{grid}</junction>'
    )
    assert "junction.elevation_grid" in kinds(network)


def test_sizes_below_0(network_of, road_xml, kinds):
    rest = '<objects><object id="1" type="tree" s="9" t="8" height="-6" radius="-1"/></objects>'
    network = network_of(road_xml(rest=rest))
    assert kinds(network) == ["object.negative_size"] * 2
    assert network.roads["1"].objects[0].height == 0


def test_sizes_of_a_repeat_below_0_are_those_of_the_object(network_of, road_xml, kinds):
    repeat = (
        '<repeat s="20" length="40" distance="0" tStart="-1.5" tEnd="-1.5" widthStart="-1" '
        'widthEnd="-2" heightStart="0" heightEnd="0" zOffsetStart="-0.1" zOffsetEnd="-0.1"/>'
    )
    rest = f'<objects><object id="1" type="roadMark" s="50" t="0" width="{{}}">{repeat}</object>'
    for width, area in ((0.0, 0.0), (1.5, 60.0)):
        network = network_of(road_xml(rest=f"{rest.format(width)}</objects>"))
        assert kinds(network) == ["object.negative_size"] * 2
        surface = build_surface(network)
        marks = np.array([patch.kind == "mark" for patch in surface.patches])
        corners = surface.vertices[surface.triangles[marks[surface.triangle_patch]]]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        assert normal[:, 2].sum() / 2 == pytest.approx(area, rel=1e-3)
