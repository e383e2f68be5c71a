"""Bridges, what passes below them, and tunnels."""

import numpy as np
import pytest

from envgen_usd.opendrive.surface import build_surface

UP = '<elevation s="0" a="{}" b="0" c="0" d="0"/>'
ACROSS = '<geometry s="0" x="50" y="-50" hdg="1.5707963267948966" length="100"><line/></geometry>'


def crossing(road_xml, height, rest=""):
    upper = road_xml("2", plan_view=ACROSS, elevation=UP.format(height), rest=rest)
    return road_xml("1") + upper


def edges_without_twin(triangles):
    edges = {(a, b) for t in triangles.tolist() for a, b in zip(t, t[1:] + t[:1], strict=True)}
    assert len(edges) == 3 * len(triangles)
    return {edge for edge in edges if edge[::-1] not in edges}


def test_a_road_high_above_another_is_a_deck(network_of, road_xml, assert_watertight):
    surface = build_surface(network_of(crossing(road_xml, 6.0)))
    assert_watertight(surface)
    top = {
        surface.patches[k].road
        for k in surface.triangle_patch[surface.triangle_level == 1]
        if surface.patches[k].kind != "deck"
    }
    assert top == {"2"}
    lower = np.array([patch.road == "1" for patch in surface.patches])[surface.triangle_patch]
    assert (surface.triangle_level[lower] == 0).all()
    corners = surface.vertices[surface.triangles[lower]]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert normal[:, 2].sum() / 2 == pytest.approx(650)
    assert (corners[..., 2] == 0).all()


def test_the_body_of_a_bridge_is_closed(network_of, road_xml):
    surface = build_surface(network_of(crossing(road_xml, 6.0)))
    bridge = surface.triangles[surface.triangle_level == 1]
    assert not edges_without_twin(bridge)
    corners = surface.vertices[bridge]
    volume = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6
    length = np.ptp(corners[..., 1])
    assert volume == pytest.approx(length * (6.5 * 0.9 + 2 * 0.25 * 1.9), rel=0.01)


@pytest.mark.parametrize("height", [0.0, 1.0, 2.0, 2.45])
def test_roads_at_about_one_height_cross_on_the_ground(network_of, road_xml, height):
    surface = build_surface(network_of(crossing(road_xml, height)))
    assert (surface.triangle_level == 0).all()


@pytest.mark.parametrize("height", [2.55, 3.0])
def test_a_road_with_headroom_for_walkers_below_is_a_deck(network_of, road_xml, height):
    surface = build_surface(network_of(crossing(road_xml, height)))
    assert (surface.triangle_level == 1).any()


def test_a_bridge_of_the_file_leaves_the_ground_open(network_of, road_xml, assert_watertight):
    bridge = '<objects><bridge id="1" s="30" length="40" name="" type="concrete"/></objects>'
    surface = build_surface(network_of(road_xml("1", rest=bridge)))
    assert_watertight(surface)
    deck = surface.vertices[surface.triangles[surface.triangle_level == 1]]
    assert deck[..., 0].min() == pytest.approx(30)
    assert deck[..., 0].max() == pytest.approx(70)
    assert len(surface.outline) == 2
    normal = np.cross(deck[:, 1] - deck[:, 0], deck[:, 2] - deck[:, 0])
    top = (deck[..., 2] > 0.5).all(axis=1)
    assert normal[top, 2].sum() / 2 == pytest.approx(2 * 40 * 0.25)  # of both parapets


def test_a_deck_shares_its_ends_with_the_ground(network_of, road_xml):
    mark = '<roadMark sOffset="0" type="broken" width="0.2"/>'
    lanes = f"""<laneSection s="0"><center><lane id="0" type="none">{mark}</lane></center>
    <right><lane id="-1" type="driving"><width sOffset="0" a="3" b="0" c="0" d="0"/></lane></right>
    </laneSection>"""
    bridge = '<objects><bridge id="1" s="19" length="40" name="" type="concrete"/></objects>'
    surface = build_surface(network_of(road_xml("1", lanes=lanes, rest=bridge)))
    road = np.array([patch.kind != "deck" for patch in surface.patches])[surface.triangle_patch]
    open_edges = edges_without_twin(surface.triangles[road])
    x = surface.vertices[np.array(sorted(open_edges))][..., 0]
    at_joint = (np.abs(x - 19) < 1e-6).all(axis=1) | (np.abs(x - 59) < 1e-6).all(axis=1)
    assert not at_joint.any()


def test_a_tunnel_has_walls_and_a_ceiling_and_its_road_stays(
    network_of, road_xml, assert_watertight
):
    tunnel = '<objects><tunnel id="1" s="20" length="50" name="" type="standard"/></objects>'
    surface = build_surface(network_of(road_xml("1", rest=tunnel)))
    assert_watertight(surface)
    tube = surface.triangles[surface.triangle_level == 1]
    corners = surface.vertices[tube]
    assert corners[..., 0].min() == pytest.approx(20)
    assert corners[..., 0].max() == pytest.approx(70)
    assert not edges_without_twin(tube)
    volume = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6
    assert volume == pytest.approx(50 * (2 * 0.5 * 5.5 + 7.5 * 0.5), rel=0.01)


def test_land_beside_a_road_is_on_no_bridge_and_in_no_tunnel(
    network_of, road_xml, assert_watertight
):
    def lane(id_, kind, width):
        size = f'<width sOffset="0" a="{width}" b="0" c="0" d="0"/>'
        return f'<lane id="{id_}" type="{kind}">{size}</lane>'

    lanes = (
        f'<laneSection s="0"><left>{lane(2, "none", 40)}{lane(1, "driving", 3.5)}</left>'
        f'<center><lane id="0" type="none"/></center><right>{lane(-1, "driving", 3.5)}'
        f"{lane(-2, 'none', 40)}</right></laneSection>"
    )
    for kind in ("bridge", "tunnel"):
        thing = f'<{kind} id="1" s="20" length="50" name="" type="standard"/>'
        surface = build_surface(
            network_of(road_xml("1", lanes=lanes, rest=f"<objects>{thing}</objects>"))
        )
        assert_watertight(surface)
        above = surface.vertices[surface.triangles[surface.triangle_level == 1]]
        assert np.abs(above[..., 1]).max() < 5
