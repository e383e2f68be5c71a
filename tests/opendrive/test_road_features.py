"""Objects and signals stand where the standard says."""

import numpy as np
import pytest
import shapely
import trimesh

from envgen_usd.models.road_feature import SignalRelations
from envgen_usd.opendrive.features.road_features import road_features

RIGHT_ARC = '<geometry s="0" x="0" y="0" hdg="0" length="{}"><arc curvature="{}"/></geometry>'


def objects(*each):
    return f"<objects>{''.join(each)}</objects>"


def thing(type_, s, t, inner="", **more):
    given = {"id": "1", "zOffset": 0, "hdg": 0} | more
    attributes = " ".join(f'{name}="{value}"' for name, value in given.items())
    return f'<object type="{type_}" s="{s}" t="{t}" {attributes}>{inner}</object>'


def signal(s, t, **more):
    given = {"id": "1", "type": "274", "subtype": "50", "country": "DE", "zOffset": 2}
    given |= {"orientation": "+", "dynamic": "no"} | more
    attributes = " ".join(f'{name}="{value}"' for name, value in given.items())
    return f'<signals><signal s="{s}" t="{t}" {attributes}/></signals>'


@pytest.fixture
def placed(network_of, road_xml):
    """Features of one road, 100 m straight to the east unless told otherwise."""
    return lambda rest, **parts: road_features(network_of(road_xml(rest=rest, **parts)))


def mesh(feature):
    corners = feature.parts["body"].points.reshape(-1, 3, 3)
    body = trimesh.Trimesh(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3))
    body.merge_vertices()
    return body


def test_a_tree(placed):
    rest = objects(thing("tree", 10, 8, height=7, radius=1.5, zOffset=0.2))
    (tree,) = placed(rest, elevation='<elevation s="0" a="1" b="0" c="0" d="0"/>')
    assert (tree.kind, tree.template) == ("tree", "tree")
    np.testing.assert_allclose(tree.pose.position, [10, 8, 1.2])
    np.testing.assert_allclose(tree.size, [3, 3, 7])


def test_superelevation_moves_an_object_sideways_and_up(placed):
    """Trap 11."""
    lateral = '<superelevation s="0" a="0.2" b="0" c="0" d="0"/>'
    (tree,) = placed(objects(thing("tree", 10, 5)), lateral=lateral)
    expected = [10, 5 * np.cos(0.2), 5 * np.sin(0.2)]
    np.testing.assert_allclose(tree.pose.position, expected, atol=1e-3)
    assert tree.pose.roll == 0


@pytest.mark.parametrize("orientation", ["+", "-", "none"])
def test_orientation_does_not_turn_an_object(placed, orientation):
    """Trap 14."""
    (bench,) = placed(
        objects(thing("obstacle", 5, 4, name="bench", hdg=0.3, orientation=orientation))
    )
    assert bench.template == "bench"
    assert bench.pose.heading == pytest.approx(0.3)


@pytest.mark.parametrize(
    ("orientation", "offset", "heading"),
    [("+", 0.0, np.pi), ("-", 0.0, 0.0), ("none", 0.0, np.pi), ("-", 0.5, 0.5)],
)
def test_a_sign_looks_at_the_traffic_it_holds_for(placed, orientation, offset, heading):
    """Trap 14: the face, the template's +x, looks against the direction of travel."""
    (sign,) = placed(signal(50, -5, orientation=orientation, hOffset=offset))
    turn = sign.pose.heading - heading
    assert np.cos(turn) == pytest.approx(1)


@pytest.mark.parametrize(
    ("along", "against"), [(0.0, 0.0), (0.0, np.pi), (np.pi, 0.0)], ids=["traffic", "line", "face"]
)
def test_hoffset_is_meant_as_most_signs_make_sense(placed, along, against):
    """Exporters count it from the traffic, from the reference line, or as the face's direction."""
    inner = "".join(
        signal(10 * k, -5, orientation=o, hOffset=offset + wobble)[9:-10]
        for k, (o, offset, wobble) in enumerate(
            [("+", along, 0.1), ("-", against, -0.2), ("+", along, 0.3), ("-", against, 1.2)]
        )
    )
    features = placed(f"<signals>{inner}</signals>")
    headings = np.array([each.pose.heading for each in features])
    expected = np.array([np.pi + 0.1, -0.2, np.pi + 0.3, 1.2])
    np.testing.assert_allclose(np.cos(headings - expected), 1, atol=1e-9)


@pytest.mark.parametrize("rule", ["RHT", "LHT"])
def test_left_hand_traffic_turns_no_sign_and_moves_none(placed, rule):
    """Trap 14: t stays to the left."""
    (sign,) = placed(signal(50, -5), attributes=f'junction="-1" rule="{rule}"')
    np.testing.assert_allclose(sign.pose.position, [50, -5, 0], atol=1e-9)
    assert abs(sign.pose.heading) == pytest.approx(np.pi, abs=1e-5)


@pytest.mark.parametrize(
    ("country", "type_", "name", "template", "shape"),
    [
        ("DE", "274", "", "traffic_sign", "round"),
        ("OpenDRIVE", "205", "", "traffic_sign", "inverted_triangle"),
        ("OpenDRIVE", "206", "", "traffic_sign", "octagon"),
        ("DE", "306", "", "traffic_sign", "diamond"),
        ("DE", "101", "", "traffic_sign", "triangle"),
        ("DE", "229", "", "traffic_sign", "rectangle"),
        ("DE", "314", "", "traffic_sign", "square"),
        ("DE", "330.1", "", "traffic_sign", "square"),
        ("DE", "331.1", "", "traffic_sign", "square"),
        ("DE", "332", "", "traffic_sign", "rectangle"),
        ("DE", "333", "", "traffic_sign", "rectangle"),
        ("", "DE:240", "", "traffic_sign", "round"),
        ("se", "a5", "", "traffic_sign", "triangle"),
        ("US", "R1-1", "", "traffic_sign", "octagon"),
        ("US", "W1-2", "", "traffic_sign", "diamond"),
        ("", "-1", "Sign_Yield", "traffic_sign", "inverted_triangle"),
        ("", "-1", "Sign_Stop", "traffic_sign", "octagon"),
        ("", "-1", "Sign_ContinueNoStopping", "traffic_sign", "round"),
        ("", "-1", "Sign_EmergencyPhone", "traffic_sign", "square"),
        ("", "-1", "Sign_BusStop", "traffic_sign", "square"),
        ("SE", "city_limit", "", "traffic_sign", "rectangle"),
        ("SE", "C31-5", "", "traffic_sign", "round"),
        ("US", "warning", "", "traffic_sign", "diamond"),
        ("US", "maxspeed", "", "traffic_sign", "round"),
        ("DE", "10001", "", "traffic_sign", "square"),
        ("OpenDRIVE", "1000001", "", "traffic_light", ""),
        ("", "traffic_light", "", "traffic_light", ""),
    ],
)
def test_signs_by_country_and_type(placed, country, type_, name, template, shape):  # noqa: PLR0917
    (sign,) = placed(signal(5, 5, country=country, type=type_, name=name))
    assert sign.template == template
    assert sign.face.shape == shape


@pytest.mark.parametrize(
    "more",
    [
        {"type": "294"},
        {"type": "1000003"},
        {"type": "-1", "height": 0.03, "zOffset": 0},
        {"type": "-1", "name": "SgRMArrowLeft"},
    ],
)
def test_road_marks_are_no_signs(placed, more):
    assert placed(signal(5, 0, **more)) == ()


def test_a_sign_carries_what_it_says(placed):
    (sign,) = placed(signal(5, 5, value=50, unit="km/h", text="slow", width=0.6, height=0.6))
    assert (sign.source.value, sign.source.text, sign.road) == (50, "slow", "1")
    assert (sign.face.shape, sign.face.width, sign.face.height) == ("round", 0.6, 0.6)
    np.testing.assert_allclose(sign.size, [0, 0.6, 2.6])


@pytest.mark.parametrize(
    ("type_", "width", "height"),
    [
        ("206", 0.9, 0.9),
        ("205", 0.9, 0.9 * np.sqrt(3) / 2),
        ("101", 0.9, 0.9 * np.sqrt(3) / 2),
        ("274", 0.6, 0.6),
        ("314", 0.6, 0.6),
        ("306", 0.6 * np.sqrt(2), 0.6 * np.sqrt(2)),
    ],
)
def test_a_sign_without_figures_has_the_size_of_the_catalogue(placed, type_, width, height):
    """Size 2 of the German catalogue: triangles and octagons 900 mm, discs and squares 600 mm."""
    (sign,) = placed(signal(5, 5, type=type_))
    assert [sign.face.width, sign.face.height] == pytest.approx([width, height], abs=0.015)


@pytest.mark.parametrize(
    ("given", "lower"), [({"height": 3.5}, 0.0), ({"height": 0.6}, 2.1), ({"zOffset": 1.4}, 1.4)]
)
def test_a_tall_signal_includes_its_post_and_a_low_face_is_mounted(placed, given, lower):
    (sign,) = placed(signal(5, 5, **({"zOffset": 0} | given)))
    assert sign.face.lower_edge == pytest.approx(lower)


def test_signals_on_one_post_do_not_overlap(placed):
    each = [(1.7, 0.8), (1.8, 1.0), (2.0, 0.3), (4.0, 0.5)]
    inner = "".join(signal(50, -5, zOffset=z, height=h)[9:-10] for z, h in each)
    features = placed(f"<signals>{inner}</signals>")
    lower = np.array([each.face.lower_edge for each in features])
    upper = np.array([each.size[2] for each in features])
    assert lower[0] == 1.7
    order = np.argsort(lower)
    assert (lower[order][1:] >= upper[order][:-1]).all()


def test_a_post_beside_a_sign_is_the_signs_own(placed):
    rest = objects(thing("pole", 5, 5.1, name="SignPost_10ft"), thing("pole", 30, 5))
    features = placed(rest + signal(5, 5))
    assert [each.template for each in features] == ["traffic_sign", "pole"]


def test_repeats_make_instances_and_override_the_base(placed):
    """Trap 15."""
    repeat = '<repeat s="10" length="40" distance="10" tStart="4" tEnd="8" heightStart="1"'
    repeat += ' heightEnd="3" zOffsetStart="0" zOffsetEnd="0"/>'
    features = placed(objects(thing("tree", 90, -20, repeat, height=9)))
    positions = np.array([each.pose.position for each in features])
    np.testing.assert_allclose(positions[:, 0], [10, 20, 30, 40, 50])
    np.testing.assert_allclose(positions[:, 1], [4, 5, 6, 7, 8])
    assert [each.size[2] for each in features] == [1, 1.5, 2, 2.5, 3]


def test_instances_beyond_the_road_are_not_placed(placed):
    repeat = '<repeat s="80" length="400" distance="10" tStart="4" tEnd="4"/>'
    features = placed(objects(thing("tree", 0, 0, repeat)))
    assert [each.pose.position[0] for each in features] == [80, 90, 100]


def test_instances_follow_a_curve(placed):
    radius = 50.0
    repeat = '<repeat s="0" length="60" distance="5" tStart="-6" tEnd="-6"/>'
    rest = objects(thing("tree", 0, 0, repeat))
    features = placed(rest, plan_view=RIGHT_ARC.format(60, 1 / radius), length="60")
    positions = np.array([each.pose.position for each in features])
    distance = np.hypot(positions[:, 0], positions[:, 1] - radius)
    np.testing.assert_allclose(distance, radius + 6, atol=1e-3)


def test_instances_detached_from_a_curve_stand_on_the_chord(placed):
    radius = 50.0
    repeat = '<repeat s="10" length="40" distance="5" tStart="0" tEnd="0"'
    rest = objects(thing("tree", 0, 0, repeat + ' detachFromReferenceLine="true"/>'))
    features = placed(rest, plan_view=RIGHT_ARC.format(60, 1 / radius), length="60")
    positions = np.array([each.pose.position for each in features])[:, :2]
    angles = np.array([10.0, 50.0]) / radius
    ends = radius * np.column_stack([np.sin(angles), 1 - np.cos(angles)])
    expected = np.linspace(*ends, len(positions))
    assert len(positions) > 5
    np.testing.assert_allclose(positions, expected, atol=2e-3)


@pytest.mark.parametrize("subtype", ["guardRail", "jerseyBarrier", "railing", "wall", "fence"])
def test_barriers_follow_a_curve(placed, subtype):
    """Trap 15: distance 0 is a continuous extrusion."""
    radius, width = 40.0, 0.3
    repeat = f"""<repeat s="5" length="50" distance="0" tStart="5" tEnd="5" widthStart="{width}"
      widthEnd="{width}" heightStart="0.8" heightEnd="0.8" zOffsetStart="0.1" zOffsetEnd="0.1"/>"""
    rest = objects(thing("barrier", 0, 0, repeat, subtype=subtype))
    plan = RIGHT_ARC.format(60, 1 / radius)
    (barrier,) = placed(rest, plan_view=plan, length="60")
    body = mesh(barrier)
    low, high = body.bounds
    assert (low[2], high[2]) == pytest.approx((0.1, 0.9), abs=2e-3)
    beam = np.concatenate(
        [part.vertices for part in body.split() if np.ptp(part.vertices[:, 0]) > 5]
    )
    distance = np.hypot(beam[:, 0], beam[:, 1] - radius)
    assert distance.min() == pytest.approx(radius - 5 - width / 2, abs=2e-3)
    assert distance.max() == pytest.approx(radius - 5 + width / 2, abs=2e-3)
    assert body.is_watertight
    assert body.volume > 0
    spokes = np.arctan2(beam[:, 0], radius - beam[:, 1]) * radius
    assert (spokes.min(), spokes.max()) == pytest.approx((5, 55), abs=0.02)


def test_a_slim_rail_above_the_ground_is_a_beam_without_posts(placed):
    """esmini's e6mini gives the posts as objects of their own."""
    repeat = """<repeat s="0" length="40" distance="0" tStart="1" tEnd="1" heightStart="0.2"
      heightEnd="0.2" zOffsetStart="0.35" zOffsetEnd="0.35" widthStart="0.1" widthEnd="0.1"/>"""
    (beam,) = placed(objects(thing("railing", 0, 0, repeat)))
    assert beam.template == "beam"
    assert mesh(beam).volume == pytest.approx(40 * 0.1 * 0.2, rel=1e-3)
    assert tuple(mesh(beam).bounds[:, 2]) == pytest.approx((0.35, 0.55), abs=2e-3)


def test_a_wall_has_the_volume_of_its_figures(placed):
    repeat = """<repeat s="0" length="100" distance="0" tStart="-5" tEnd="-5" widthStart="0.4"
      widthEnd="0.4" heightStart="1" heightEnd="3"/>"""
    walls = placed(objects(thing("barrier", 0, 0, repeat, subtype="wall")))
    assert sum(mesh(wall).volume for wall in walls) == pytest.approx(100 * 0.4 * 2, rel=1e-3)
    assert max(np.ptp(mesh(wall).bounds[:, 0]) for wall in walls) <= 50


@pytest.mark.parametrize("t", [-5.0, 5.0])
def test_a_guard_rail_has_a_w_profile_that_bulges_towards_the_road(placed, t):
    repeat = f"""<repeat s="10" length="8" distance="0" tStart="{t}" tEnd="{t}" widthStart="0.1"
      widthEnd="0.1" heightStart="0.8" heightEnd="0.8"/>"""
    (rail,) = placed(objects(thing("barrier", 0, 0, repeat, subtype="guardRail")))
    beam = max(mesh(rail).split(only_watertight=False), key=lambda body: np.ptp(body.bounds[:, 0]))
    assert beam.is_watertight
    towards = -np.sign(t) * (beam.vertices[:, 1] - t)
    heights = np.unique(beam.vertices[towards > 0.045, 2].round(3))
    assert heights == pytest.approx([0.528, 0.56, 0.712, 0.744], abs=1e-3)
    assert beam.volume < 0.3 * 8 * 0.1 * (0.41 * 0.8), "a sheet, not a slab"


def test_a_hedge_is_wider_at_its_foot_than_at_its_top(placed):
    repeat = """<repeat s="10" length="8" distance="0" tStart="-5" tEnd="-5" widthStart="0.8"
      widthEnd="0.8" heightStart="1.5" heightEnd="1.5"/>"""
    (hedge,) = placed(objects(thing("barrier", 0, 0, repeat, subtype="hedge")))
    vertices = mesh(hedge).vertices
    spans = [np.ptp(vertices[np.abs(vertices[:, 2] - z) < 1e-3, 1]) for z in (0.0, 0.45, 1.5)]
    assert spans[1] > spans[0] > spans[2] > 0.4


CORNERS = [(0, 0), (6, 0), (6, 4), (3, 4), (3, 8), (0, 8)]
LOCAL = "".join(f'<cornerLocal u="{u}" v="{v}" z="0.5" height="5"/>' for u, v in CORNERS)
ON_ROAD = "".join(f'<cornerRoad s="{20 + u}" t="{v}" dz="0.5" height="5"/>' for u, v in CORNERS)


@pytest.mark.parametrize(
    ("outline", "hdg"),
    [
        (f"<outline>{LOCAL}</outline>", 0.0),
        (f'<outlines><outline id="1" outer="true">{LOCAL}</outline></outlines>', 0.7),
        (f"<outline>{ON_ROAD}</outline>", 0.7),
    ],
)
def test_a_building_stands_on_its_outline(placed, outline, hdg):
    """Trap 16: bare outlines and grouped ones; corners by s, t, dz and by u, v, z."""
    (house,) = placed(objects(thing("building", 20, 0, outline, hdg=hdg)))
    assert (house.kind, house.pose) == ("building", None)
    assert {name: len(part) for name, part in house.parts.items()} == {
        **{"wall": 6, "roof": 1, "ground": 1}
    }
    roof, ground = house.parts["roof"].points, house.parts["ground"].points
    angle = 0.0 if "cornerRoad" in outline else hdg
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    expected = shapely.Polygon(np.array(CORNERS) @ turn.T + (20, 0))
    assert shapely.Polygon(roof[:, :2]).symmetric_difference(expected).area < 0.05
    assert roof[:, 2] == pytest.approx(5.5)
    assert ground[:, 2] == pytest.approx(0.5)
    assert shapely.LinearRing(roof[:, :2]).is_ccw
    assert not shapely.LinearRing(ground[:, :2]).is_ccw
    assert house.size[2] == 5


def test_a_building_along_the_road_has_the_volume_of_its_figures(placed):
    repeat = """<repeat s="10" length="40" distance="0" tStart="9" tEnd="9" widthStart="6"
      widthEnd="6" heightStart="5" heightEnd="5"/>"""
    (house,) = placed(objects(thing("building", 0, 0, repeat)))
    assert (house.kind, house.pose, house.size[2]) == ("building", None, 5)
    assert {part: len(faces) > 0 for part, faces in house.parts.items()} == {
        **dict.fromkeys(("wall", "roof", "ground"), True)
    }
    corners = np.concatenate([each.points for each in house.parts.values()]).reshape(-1, 3, 3)
    body = trimesh.Trimesh(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3))
    body.merge_vertices()
    assert body.is_watertight
    assert body.volume == pytest.approx(40 * 6 * 5)


def test_the_shell_of_a_building_is_closed(placed):
    (house,) = placed(objects(thing("building", 20, 9, length=12, width=8, height=9, hdg=0.4)))
    edges = [
        (tuple(a), tuple(b))
        for part in house.parts.values()
        for number in range(len(part))
        for ring in part.rings(number)
        for a, b in zip(ring.tolist(), np.roll(ring, -1, axis=0).tolist(), strict=True)
    ]
    assert sorted(edges) == sorted((b, a) for a, b in edges)


def test_bodies_over_outlines_are_closed(placed):
    outline = f"<outline>{LOCAL}</outline>"
    (box,) = placed(objects(thing("obstacle", 20, 0, outline, name="controllerBox")))
    body = mesh(box)
    assert body.is_watertight
    assert body.volume == pytest.approx((6 * 4 + 3 * 4) * 5, rel=1e-3)


@pytest.mark.parametrize(
    ("type_", "subtype", "width"),
    [("soundBarrier", "", 0.4), ("barrier", "wall", 0.4), ("barrier", "", 0.0), ("wall", "", 0.2)],
)
def test_a_barrier_without_a_repeat_is_a_straight_element(placed, type_, subtype, width):
    """13.1: length along the object's x, width along y, height along z."""
    size = {"length": 6, "width": width, "height": 2, "hdg": np.pi / 2, "zOffset": 0.5}
    (wall,) = placed(objects(thing(type_, 50, 8, subtype=subtype, **size)))
    body, thickness = mesh(wall), width or 0.3
    assert body.is_watertight
    np.testing.assert_allclose(body.bounds[0], [50 - thickness / 2, 5, 0.5], atol=1e-3)
    np.testing.assert_allclose(body.bounds[1], [50 + thickness / 2, 11, 2.5], atol=1e-3)
    assert body.volume == pytest.approx(6 * thickness * 2, rel=1e-2)


@pytest.mark.parametrize("type_", ["railing", "barrier", "guardRail", "jerseyBarrier", "fence"])
def test_a_barrier_element_looks_like_a_barrier_along_the_road(placed, type_):
    repeat = """<repeat s="40" length="8" distance="0" tStart="-6" tEnd="-6" widthStart="0.3"
      widthEnd="0.3" heightStart="1" heightEnd="1" zOffsetStart="0" zOffsetEnd="0"/>"""
    (along,) = placed(objects(thing(type_, 0, 0, repeat)))
    (alone,) = placed(objects(thing(type_, 44, -6, length=8, width=0.3, height=1)))
    assert alone.template == along.template
    np.testing.assert_allclose(mesh(alone).bounds, mesh(along).bounds, atol=2e-3)
    assert mesh(alone).volume == pytest.approx(mesh(along).volume, rel=1e-2)


@pytest.mark.parametrize(("type_", "spacing"), [("guardRail", 4), ("railing", 2), ("fence", 2)])
def test_posts_of_a_barrier_element_are_spaced_evenly(placed, type_, spacing):
    (element,) = placed(objects(thing(type_, 44, -6, length=12, width=0.1, height=1)))
    bodies = mesh(element).split(only_watertight=False)
    centres = [body.bounds.mean(axis=0)[0] for body in bodies if np.ptp(body.bounds[:, 0]) < 1]
    expected = 38 + spacing / 2 + spacing * np.arange(12 // spacing)
    np.testing.assert_allclose(sorted(centres), expected, atol=2e-3)


def test_an_open_outline_is_a_curtain_seen_from_both_sides(placed):
    """13.3: an open outline is a line; its heights run linearly between the corners."""
    places = ((0, 0, 1), (6, 0, 3), (6, 4, 3))
    corners = "".join(
        f'<cornerLocal u="{u}" v="{v}" z="0.5" height="{height}"/>' for u, v, height in places
    )
    outlines = f'<outlines><outline id="0" closed="false">{corners}</outline></outlines>'
    (net,) = placed(objects(thing("barrier", 20, 8, outlines)))
    triangles = net.parts["body"].points.reshape(-1, 3, 3)
    across = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]) / 2
    assert np.linalg.norm(across, axis=1).sum() == pytest.approx(2 * (6 * 2 + 4 * 3), rel=1e-4)
    np.testing.assert_allclose(across.sum(axis=0), 0, atol=1e-6)
    bounds = triangles.reshape(-1, 3).min(axis=0), triangles.reshape(-1, 3).max(axis=0)
    np.testing.assert_allclose(bounds, [[20, 8, 0.5], [26, 12, 3.5]], atol=1e-3)


def test_barriers_of_a_spaced_repeat_are_elements(placed):
    repeat = '<repeat s="10" length="20" distance="5" tStart="6" tEnd="6"/>'
    elements = placed(objects(thing("barrier", 0, 0, repeat, length=2, width=0.5, height=1)))
    centres = [mesh(each).bounds.mean(axis=0)[0] for each in elements]
    np.testing.assert_allclose(centres, [10, 15, 20, 25, 30], atol=1e-3)


def test_an_outline_without_a_height_is_as_high_as_its_barrier(placed):
    corners = LOCAL.replace('height="5"', "")
    outline = f"<outline>{corners}</outline>"
    (hedge,) = placed(objects(thing("barrier", 20, 0, outline, subtype="hedge")))
    assert mesh(hedge).volume == pytest.approx(36 * 1.2, rel=1e-3)


@pytest.mark.parametrize(
    ("size", "volume"),
    [
        ({"length": 4, "width": 2, "height": 3}, 24),
        ({"radius": 2, "height": 3}, 12 * np.pi),
    ],
)
def test_an_object_of_unknown_type_has_its_bounding_body(placed, size, volume):
    (box,) = placed(objects(thing("monument", 20, 9, hdg=0.5, **size)))
    body = mesh(box)
    assert (box.template, body.is_watertight) == ("unknown", True)
    assert body.volume == pytest.approx(volume, rel=0.03)
    np.testing.assert_allclose(body.bounds.mean(axis=0), [20, 9, 1.5], atol=1e-3)


def test_an_object_of_unknown_type_and_size_is_a_point(placed):
    (point,) = placed(objects(thing("monument", 20, 9, height=2)))
    assert point.template == "unknown"
    np.testing.assert_allclose(point.pose.position, [20, 9, 0])
    assert point.size == (0, 0, 2)


def test_a_skeleton_becomes_tubes(placed):
    vertices = [(-4, 0), (-4, 5), (4, 5), (4, 0)]
    inner = "".join(f'<vertexRoad s="50" t="{t}" dz="{z}" radius="0.2"/>' for t, z in vertices)
    skeleton = f'<skeleton><polyline id="1">{inner}</polyline></skeleton>'
    (gantry,) = placed(objects(thing("gantry", 50, 0, skeleton)))
    low, high = mesh(gantry).bounds
    np.testing.assert_allclose(low, [49.8, -4.2, 0], atol=0.02)
    np.testing.assert_allclose(high, [50.2, 4.2, 5.2], atol=0.02)


@pytest.mark.parametrize(
    "type_", ["crosswalk", "parkingSpace", "roadMark", "trafficIsland", "roadSurface"]
)
def test_what_lies_on_the_road_is_left_to_the_surface(placed, type_):
    outline = f"<outline>{ON_ROAD}</outline>"
    assert placed(objects(thing(type_, 20, 0, outline, length=2, width=2))) == ()


@pytest.mark.parametrize(
    ("name", "template"),
    [
        ("CoulPine_Lg02", "tree"),
        ("Bush_Sm01", "bush"),
        ("Metal_CylinderPost_30ft", "street_light"),
        ("Signal_Post_15ft", "pole"),
        ("TrafficCone01", "traffic_cone"),
    ],
)
def test_names_of_models_tell_where_the_type_does_not(placed, name, template):
    (found,) = placed(objects(thing("-1", 5, 8, name=name, height=2)))
    assert found.template == template


@pytest.mark.parametrize(
    ("type_", "name", "template"),
    [
        ("vegetation", "Shrub_2", "bush"),
        ("pole", "oak_tall", "tree"),
        ("obstacle", "Warehouse", "obstacle"),
        ("pole", "stopsign", "pole"),
    ],
)
def test_a_name_makes_a_pole_or_an_obstacle_a_plant_and_no_house_or_sign(
    placed, type_, name, template
):
    (found,) = placed(objects(thing(type_, 5, 8, name=name, height=2)))
    assert found.template == template


@pytest.mark.parametrize(
    ("type_", "name", "least", "most"),
    [
        ("obstacle", "hydrant", 0.5, 1.2),  # pillar hydrants, EN 14384
        ("obstacle", "bollard", 0.7, 1.2),
        ("obstacle", "cone", 0.3, 1.0),  # EN 13422
        ("obstacle", "bench", 0.4, 1.0),
        ("obstacle", "trashbin", 0.7, 1.3),
        ("pole", "delineator", 0.9, 1.1),  # RPS
        ("pole", "streetlamp", 4.0, 12.0),
        ("gantry", "", 4.7, 8.0),  # above a clearance of 4.7 m
        ("busStop", "", 2.0, 3.5),
        ("pedestrian", "", 1.5, 2.0),
        ("car", "", 1.3, 2.0),
        ("tree", "", 4.0, 15.0),
    ],
)
def test_an_object_without_a_height_has_a_height_of_its_kind(placed, type_, name, least, most):
    (found,) = placed(objects(thing(type_, 5, 8, name=name)))
    assert least <= found.size[2] <= most


@pytest.mark.parametrize(
    ("subtype", "least", "most"),
    [("guardRail", 0.7, 0.9), ("jerseyBarrier", 0.8, 1.1), ("railing", 0.9, 1.3), ("", 0.7, 1.2)],
)
def test_a_barrier_without_a_height_ends_at_that_of_its_kind(placed, subtype, least, most):
    repeat = '<repeat s="20" length="10" distance="0" tStart="8" tEnd="8"/>'
    (found,) = placed(objects(thing("barrier", 0, 0, repeat, subtype=subtype, width=0.2)))
    assert least <= mesh(found).bounds[1, 2] <= most


def test_references_place_nothing_twice(network_of, road_xml):
    plan = '<geometry s="0" x="0" y="50" hdg="0" length="100"><line/></geometry>'
    first = road_xml("1", rest=signal(5, 5, id="s") + objects(thing("tree", 5, 9, id="o")))
    again = """<signals><signalReference s="5" t="5" id="s" orientation="+"/></signals>
      <objects><objectReference s="5" t="5" id="o"/></objects>"""
    network = network_of(first + road_xml("2", plan_view=plan, rest=again))
    assert len(road_features(network)) == 2
    assert network.roads["2"].signals[0].reference == "s"
    assert network.roads["2"].objects[0].reference == "o"
    assert network.issues == ()


def test_ids_are_names_and_unique(network_of, road_xml):
    rest = objects(thing("tree", 5, 9), thing("tree", 6, 9))
    roads = [road_xml(id_, rest=rest) for id_ in ("a b", "a/b", "a_b", "7")]
    names = [each.id for each in road_features(network_of("".join(roads)))]
    assert len(set(names)) == 8
    assert all(name.replace("_", "").replace("-", "").isalnum() for name in names)


def test_a_signal_placed_in_the_map_frame(placed):
    position = '<positionInertial x="30" y="-7" z="4" hdg="1.5" pitch="0" roll="0"/>'
    xml = signal(5, 5, zOffset=3).replace("/></signals>", f">{position}</signal></signals>")
    (sign,) = placed(xml)
    np.testing.assert_allclose(sign.pose.position, [30, -7, 1])
    assert np.cos(sign.pose.heading - (1.5 + np.pi)) == pytest.approx(1)


def test_signals_hold_for_the_lanes_of_their_validity_or_their_orientation(network_of, road_xml):
    """14.2: validity counts, also that of a reference on another road; else the orientation."""
    validity = '<validity fromLane="1" toLane="1"/>'
    first = f"""<signals>
        <signal id="a" s="10" t="-8" orientation="+" type="274" country="DE">{validity}</signal>
        <signal id="b" s="20" t="-8" orientation="+" type="274" country="DE"/>
        <signal id="c" s="30" t="8" orientation="-" type="274" country="DE">
            <dependency id="line"/><dependency id="b"/><dependency id="nobody"/></signal>
        <signal id="d" s="40" t="8" orientation="none" type="274" country="DE"/>
        <signal id="line" s="50" t="0" orientation="+" type="294" country="DE"/>
        <signalReference id="a" s="60" t="8" orientation="-"/></signals>"""
    second = """<signals><signalReference id="a" s="5" t="-8" orientation="+"/></signals>"""
    network = network_of(road_xml("1", rest=first) + road_xml("2", rest=second))
    a, b, c, d = (feature.relations for feature in road_features(network))

    assert a == SignalRelations(lanes=("road_1_s0_lane_1", "road_2_s0_lane_-1"))
    assert b == SignalRelations(lanes=("road_1_s0_lane_-1",))
    assert c.lanes == ("road_1_s0_lane_1",)
    assert d.lanes == ("road_1_s0_lane_1", "road_1_s0_lane_-1")
    assert {"signal_1_1", "signal_1_4_paint"} <= set(c.depends_on)
    assert not any("nobody" in target for target in c.depends_on)


def test_traffic_on_the_left_turns_the_meaning_of_the_orientation(network_of, road_xml):
    rest = (
        '<signals><signal id="a" s="10" t="8" orientation="+" type="274" country="DE"/></signals>'
    )
    network = network_of(road_xml(rest=rest, attributes='junction="-1" rule="LHT"'))
    (sign,) = road_features(network)
    assert sign.relations == SignalRelations(lanes=("road_1_s0_lane_1",))
