"""OpenSCENARIO files against closed forms of their motions."""

import numpy as np
import pytest

from envgen_usd.errors import EnvgenError
from envgen_usd.opendrive.reader import read
from envgen_usd.opendrive.surface import build_surface
from envgen_usd.recipe.build_options import demo_road
from envgen_usd.traffic.open_scenario.scenario_file import ScenarioFile
from envgen_usd.traffic.open_scenario.scenario_play import play

CAR = """<Vehicle name="car_red" vehicleCategory="car"><BoundingBox>
<Center x="1.4" y="0" z="0.75"/><Dimensions width="1.8" length="4.5" height="1.5"/></BoundingBox>
</Vehicle>"""
WALKER = """<Pedestrian name="p" mass="80" pedestrianCategory="pedestrian"><BoundingBox>
<Center x="0" y="0" z="0.9"/><Dimensions width="0.5" length="0.4" height="1.8"/></BoundingBox>
</Pedestrian>"""


def scenario(folder, init, events="", *, entities=None, stop="", head=""):
    """A file with entities, initial actions and events (each an Event element) of the ego."""
    entities = entities or {"ego": CAR}
    objects = "".join(
        f'<ScenarioObject name="{name}">{text}</ScenarioObject>' for name, text in entities.items()
    )
    privates = "".join(
        f'<Private entityRef="{name}">'
        + "".join(f"<PrivateAction>{action}</PrivateAction>" for action in actions)
        + "</Private>"
        for name, actions in init.items()
    )
    acts = f"""<Story name="s"><Act name="act"><ManeuverGroup name="g" maximumExecutionCount="1">
<Actors selectTriggeringEntities="false"><EntityRef entityRef="ego"/></Actors>
<Maneuver name="m">{events}</Maneuver></ManeuverGroup>{when_time(0)}</Act></Story>"""
    path = folder / "test.xosc"
    path.write_text(f"""<?xml version="1.0"?><OpenSCENARIO>
<FileHeader revMajor="1" revMinor="2" date="2026-01-01T00:00:00" description="" author=""/>
{head}<RoadNetwork/><Entities>{objects}</Entities><Storyboard><Init><Actions>{privates}</Actions>
</Init>{acts if events else ""}{stop}</Storyboard></OpenSCENARIO>""")
    return ScenarioFile(path)


def when_time(value, tag="StartTrigger", rule="greaterThan"):
    return when(f'<ByValueCondition><SimulationTimeCondition value="{value}" rule="{rule}"/>'
                "</ByValueCondition>", tag)  # fmt: skip


def when(condition, tag="StartTrigger", delay=0):
    return f"""<{tag}><ConditionGroup><Condition name="c" delay="{delay}" conditionEdge="rising">
{condition}</Condition></ConditionGroup></{tag}>"""


def event(name, action, trigger):
    return f"""<Event name="{name}" priority="override"><Action name="{name}">
<PrivateAction>{action}</PrivateAction></Action>{trigger}</Event>"""


def on_lane(lane, s, offset=0.0):
    return (f'<TeleportAction><Position><LanePosition roadId="1" laneId="{lane}" s="{s}" '
            f'offset="{offset}"/></Position></TeleportAction>')  # fmt: skip


def speed(value, shape="step", span=0.0, dimension="time"):
    return f"""<LongitudinalAction><SpeedAction><SpeedActionDynamics dynamicsShape="{shape}"
value="{span}" dynamicsDimension="{dimension}"/><SpeedActionTarget><AbsoluteTargetSpeed
value="{value}"/></SpeedActionTarget></SpeedAction></LongitudinalAction>"""


@pytest.fixture(scope="module")
def straight():
    surface = build_surface(read(demo_road("straight")).network, 0.02)
    return surface.lanes, surface.roads


@pytest.fixture(scope="module")
def middle(straight):
    """y of each lane's centre line; the road lies along x."""
    return {lane.lane: float(lane.points[0, 1]) for lane in straight[0]}


def played(file, straight, seconds=10.0):
    return play(file, *straight, seconds)


def test_lanes_and_speeds_give_places_ahead_of_the_rear_axle(tmp_path, straight, middle):
    file = scenario(tmp_path, {"ego": [speed(10), on_lane(-1, 50)]})
    trace = played(file, straight, 4.0)
    (ego,) = trace.actors
    assert (ego.kind, ego.model, ego.size) == ("car", "car_red", (4.5, 1.8, 1.5))
    np.testing.assert_allclose(ego.times, np.arange(41) / 10, atol=1e-9)
    np.testing.assert_allclose(ego.positions[:, 0], 51.4 + 10 * ego.times, atol=1e-6)
    np.testing.assert_allclose(ego.positions[:, 1], middle[-1], atol=1e-6)
    assert trace.issues == ()


def test_the_other_direction_drives_back(tmp_path, straight, middle):
    file = scenario(tmp_path, {"ego": [on_lane(1, 50, 0.5), speed(10)]})
    (ego,) = played(file, straight, 2.0).actors
    np.testing.assert_allclose(ego.positions[:, 0], 48.6 - 10 * ego.times, atol=1e-6)
    np.testing.assert_allclose(np.abs(ego.headings), np.pi, atol=1e-9)
    # The offset is to the left of the road, not of the vehicle.
    np.testing.assert_allclose(ego.positions[:, 1], middle[1] + 0.5, atol=1e-6)


def test_a_linear_brake_is_constant_deceleration(tmp_path, straight):
    brake = event("brake", speed(0, "linear", 4.0), when_time(1.0))
    file = scenario(tmp_path, {"ego": [on_lane(-1, 20), speed(8)]}, brake)
    (ego,) = played(file, straight, 8.0).actors
    # The trigger fires in the first step after 1 s.
    start, step = 1.05, 0.05
    after = np.clip(ego.times - start, 0, 4)
    before = np.minimum(ego.times, start)
    way = 8 * before + 8 * after - 8 / 4 * after**2 / 2
    np.testing.assert_allclose(ego.positions[:, 0] - ego.positions[0, 0], way, atol=8 * step)
    assert ego.positions[-1, 0] - ego.positions[0, 0] == pytest.approx(8.4 + 16, abs=0.25)


def test_a_rate_brakes_at_that_rate(tmp_path, straight):
    brake = event("brake", speed(2, "linear", 3.0, "rate"), when_time(1.0))
    file = scenario(tmp_path, {"ego": [on_lane(-1, 20), speed(8)]}, brake)
    (ego,) = played(file, straight, 8.0).actors
    pace = np.diff(ego.positions[:, 0]) / 0.1
    assert pace[int(2.0 / 0.1)] == pytest.approx(8 - 3 * 1.0, abs=0.2)
    assert pace[-1] == pytest.approx(2.0, abs=1e-6)


def test_a_lane_change_is_a_sine_over_its_time(tmp_path, straight, middle):
    change = """<LateralAction><LaneChangeAction><LaneChangeActionDynamics
dynamicsShape="sinusoidal" value="4" dynamicsDimension="time"/><LaneChangeTarget>
<RelativeTargetLane entityRef="ego" value="1"/></LaneChangeTarget></LaneChangeAction>
</LateralAction>"""
    file = scenario(tmp_path, {"ego": [on_lane(-2, 20), speed(10)]},
                    event("change", change, when_time(2.0)))  # fmt: skip
    (ego,) = played(file, straight, 10.0).actors
    share = np.clip((ego.times - 2.05) / 4, 0, 1)
    y = middle[-2] + (middle[-1] - middle[-2]) * (1 - np.cos(np.pi * share)) / 2
    rear = ego.positions[:, 1] - 1.4 * np.sin(ego.headings)
    np.testing.assert_allclose(rear, y, atol=0.03)
    assert ego.headings.max() > 0.05
    np.testing.assert_allclose(ego.headings[-1], 0.0, atol=1e-9)


def test_events_wait_for_ways_and_gaps(tmp_path, straight):
    """The ego brakes when it has driven 20 m; again when the lead is 30 m ahead."""
    driven = """<ByEntityCondition><TriggeringEntities triggeringEntitiesRule="any"><EntityRef
entityRef="ego"/></TriggeringEntities><EntityCondition><TraveledDistanceCondition value="20"/>
</EntityCondition></ByEntityCondition>"""
    gap = """<ByEntityCondition><TriggeringEntities triggeringEntitiesRule="any"><EntityRef
entityRef="ego"/></TriggeringEntities><EntityCondition><RelativeDistanceCondition entityRef="lead"
relativeDistanceType="longitudinal" value="40" freespace="false" rule="greaterThan"/>
</EntityCondition></ByEntityCondition>"""
    lead = """<TeleportAction><Position><RelativeLanePosition entityRef="ego" dLane="0" ds="20"
/></Position></TeleportAction>"""
    file = scenario(
        tmp_path,
        {"ego": [on_lane(-1, 20), speed(10)], "lead": [lead, speed(10)]},
        event("first", speed(5), when(driven)) + event("second", speed(0), when(gap)),
        entities={"ego": CAR, "lead": CAR},
    )
    ego, ahead = played(file, straight, 12.0).actors
    np.testing.assert_allclose(ahead.positions[0] - ego.positions[0], [20, 0, 0], atol=1e-6)
    pace = np.diff(ego.positions[:, 0]) / 0.1
    changes = [ego.times[np.argmax(pace < limit)] for limit in (9.0, 4.0)]
    # 20 m at 10 m/s, then a gap that grows by 5 m/s from 20 m to 40 m.
    np.testing.assert_allclose(changes, [2.0, 6.0], atol=0.11)


def test_delays_and_states_chain_events(tmp_path, straight):
    done = """<ByValueCondition><StoryboardElementStateCondition storyboardElementType="event"
storyboardElementRef="first" state="completeState"/></ByValueCondition>"""
    file = scenario(
        tmp_path,
        {"ego": [on_lane(-1, 20), speed(10)]},
        event("first", speed(6, "linear", 2.0), when_time(1.0))
        + event("then", speed(3), when(done, delay=1.5)),
    )
    (ego,) = played(file, straight, 8.0).actors
    pace = np.diff(ego.positions[:, 0]) / 0.1
    begun = ego.times[1:][pace < 3.5][0]
    assert begun == pytest.approx(1.05 + 2.0 + 1.5, abs=0.2)


def trajectory(points, times=None, timing=True):
    vertices = "".join(
        f'<Vertex time="{t}"><Position><WorldPosition x="{x}" y="{y}"/></Position></Vertex>'
        for (x, y), t in zip(points, times or [0] * len(points), strict=True)
    )
    reference = (
        '<Timing domainAbsoluteRelative="absolute" scale="1" offset="0"/>' if timing else "<None/>"
    )
    return f"""<RoutingAction><FollowTrajectoryAction><TrajectoryRef><Trajectory name="t"
closed="false"><ParameterDeclarations/><Shape><Polyline>{vertices}</Polyline></Shape></Trajectory>
</TrajectoryRef><TimeReference>{reference}</TimeReference><TrajectoryFollowingMode
followingMode="position"/></FollowTrajectoryAction></RoutingAction>"""


def test_people_follow_trajectories_by_time_or_by_speed(tmp_path, straight):
    points = [(50, -8), (54, -8), (54, 8)]
    file = scenario(tmp_path, {"ego": [trajectory(points, [0, 2, 10])]}, entities={"ego": WALKER})
    (walker,) = played(file, straight, 10.0).actors
    assert walker.kind == "pedestrian"
    # It looks along each chord, and turns at the corner between them.
    np.testing.assert_allclose(walker.headings[[5, 10, 20, 60]], [0, 0, np.pi / 4, np.pi / 2])
    np.testing.assert_allclose(
        walker.positions[[10, 20, 60]], [(52, -8), (54, -8), (54, 0)], atol=1e-9
    )
    file = scenario(tmp_path, {"ego": [speed(2), trajectory(points, timing=False)]},
                    entities={"ego": WALKER})  # fmt: skip
    (walker,) = played(file, straight, 10.0).actors
    np.testing.assert_allclose(
        walker.positions[[10, 20, 60]], [(52, -8), (54, -8), (54, 0)], atol=1e-9
    )


def test_parameters_expressions_and_catalogues(tmp_path, straight):
    (tmp_path / "vehicles").mkdir()
    (tmp_path / "vehicles" / "all.xosc").write_text(
        f'<OpenSCENARIO><Catalog name="cars">{CAR}</Catalog></OpenSCENARIO>'
    )
    head = """<ParameterDeclarations><ParameterDeclaration name="pace" parameterType="double"
value="6"/></ParameterDeclarations><CatalogLocations><VehicleCatalog><Directory path="vehicles"/>
</VehicleCatalog></CatalogLocations>"""
    reference = '<CatalogReference catalogName="cars" entryName="car_red"/>'
    file = scenario(tmp_path, {"ego": [on_lane(-1, 20), speed("${$pace * 2 + 1}")]},
                    entities={"ego": reference}, head=head)  # fmt: skip
    (ego,) = played(file, straight, 2.0).actors
    assert (ego.positions[-1, 0] - ego.positions[0, 0]) / 2 == pytest.approx(13.0)
    with pytest.raises(EnvgenError, match=r"parameter \$size is not declared"):
        scenario(tmp_path, {"ego": [on_lane(-1, 20), speed("$size")]})
    missing = reference.replace("car_red", "car_blue")
    file = scenario(tmp_path, {"ego": [on_lane(-1, 20)]}, entities={"ego": missing}, head=head)
    with pytest.raises(EnvgenError, match="an entry car_blue"):
        played(file, straight)


def test_routes_choose_at_forks(tmp_path):
    """At the junction of the shipped town, a route to another arm turns off."""
    surface = build_surface(read(demo_road("town")).network, 0.02)
    lanes = {lane.id: lane for lane in surface.lanes}
    forks = [
        lane for lane in lanes.values()
        if lane.lane_type == "driving" and len(lane.successors) > 1 and not lane.junction
    ]  # fmt: skip
    start = forks[0]
    ends = {lanes[way].successors[0] for way in start.successors if lanes[way].successors}
    assert len(ends) > 1
    for name in sorted(ends):
        begin, goal = start.points[-1], lanes[name].points[len(lanes[name].points) // 2]
        route = f"""<RoutingAction><AssignRouteAction><Route name="r" closed="false">
<Waypoint routeStrategy="shortest"><Position><WorldPosition x="{begin[0]}" y="{begin[1]}"/>
</Position></Waypoint><Waypoint routeStrategy="shortest"><Position><WorldPosition x="{goal[0]}"
y="{goal[1]}"/></Position></Waypoint></Route></AssignRouteAction></RoutingAction>"""
        place = (f'<TeleportAction><Position><WorldPosition x="{begin[0]}" y="{begin[1]}"/>'
                 "</Position></TeleportAction>")  # fmt: skip
        file = scenario(tmp_path, {"ego": [place, speed(15), route]}, entities={"ego": CAR})
        (ego,) = play(file, surface.lanes, surface.roads, 60.0).actors
        away = np.linalg.norm(ego.positions[:, :2] - goal[:2], axis=1)
        assert away.min() < 2.0, name


def test_what_is_skipped_is_listed_once(tmp_path, straight):
    appearance = "<AppearanceAction/>"
    light = '<VisibilityAction graphics="true"/>'
    file = scenario(tmp_path, {"ego": [on_lane(-1, 20), appearance, light, appearance]})
    trace = played(file, straight, 1.0)
    assert sorted(issue.message for issue in trace.issues) == [
        "AppearanceAction is not supported", "VisibilityAction is not supported",
    ]  # fmt: skip


def test_ends_by_trigger_and_at_the_end_of_the_road(tmp_path, straight):
    stop = when_time(3.0, "StopTrigger")
    file = scenario(tmp_path, {"ego": [on_lane(-1, 20), speed(10)]}, stop=stop)
    assert played(file, straight, 60.0).actors[0].times[-1] == pytest.approx(3.0)
    file = scenario(tmp_path, {"ego": [on_lane(-1, 380), speed(10)]})
    trace = played(file, straight, 10.0)
    assert trace.actors[0].times[-1] == pytest.approx(2.0, abs=0.11)
    assert [issue.kind for issue in trace.issues] == ["scenario.entity"]


def test_unknown_roads_and_entities_are_named(tmp_path, straight):
    lost = on_lane(-1, 20).replace('roadId="1"', 'roadId="77"')
    with pytest.raises(EnvgenError, match="no lane -1 of road 77"):
        played(scenario(tmp_path, {"ego": [lost]}), straight)
    near = """<TeleportAction><Position><RelativeObjectPosition entityRef="nobody" dx="1" dy="0"/>
</Position></TeleportAction>"""
    with pytest.raises(EnvgenError, match="no entity nobody; known: ego"):
        played(scenario(tmp_path, {"ego": [near]}), straight)
    with pytest.raises(EnvgenError, match="places no entity"):
        played(scenario(tmp_path, {"ego": []}), straight)
    (tmp_path / "bomb.xosc").write_text(
        '<!DOCTYPE x [<!ENTITY a "b">]><OpenSCENARIO><Storyboard/></OpenSCENARIO>'
    )
    with pytest.raises(EnvgenError, match="declares entity a"):
        ScenarioFile(tmp_path / "bomb.xosc")


def test_a_file_of_another_writer_plays(tmp_path, straight, middle):
    xosc = pytest.importorskip("scenariogeneration.xosc")
    box = xosc.BoundingBox(2, 5, 1.8, 2.0, 0, 0.9)
    axle = xosc.Axle(0.5, 0.8, 1.68, 2.98, 0.4)
    car = xosc.Vehicle("car_white", xosc.VehicleCategory.car, box, axle, axle, 69, 10, 10)
    entities = xosc.Entities()
    entities.add_scenario_object("ego", car)
    init = xosc.Init()
    init.add_init_action("ego", xosc.TeleportAction(xosc.LanePosition(25, 0, -2, "1")))
    step = xosc.TransitionDynamics(xosc.DynamicsShapes.step, xosc.DynamicsDimension.time, 1)
    init.add_init_action("ego", xosc.AbsoluteSpeedAction(10, step))
    trigger = xosc.ValueTrigger(
        "t", 0, xosc.ConditionEdge.none, xosc.SimulationTimeCondition(2, xosc.Rule.greaterThan)
    )
    smooth = xosc.TransitionDynamics(xosc.DynamicsShapes.sinusoidal, xosc.DynamicsDimension.time, 3)
    change = xosc.Event("change", xosc.Priority.override)
    change.add_action("go", xosc.AbsoluteLaneChangeAction(-1, smooth))
    change.add_trigger(trigger)
    maneuver = xosc.Maneuver("m")
    maneuver.add_event(change)
    stop = xosc.ValueTrigger(
        "e", 0, xosc.ConditionEdge.none, xosc.SimulationTimeCondition(6, xosc.Rule.greaterThan),
        triggeringpoint="stop",
    )  # fmt: skip
    board = xosc.StoryBoard(init, stop)
    board.add_maneuver(maneuver, "ego")
    whole = xosc.Scenario(
        "test", "author", xosc.ParameterDeclarations(), entities, board,
        xosc.RoadNetwork("straight.xodr"), xosc.Catalog(),
    )  # fmt: skip
    whole.write_xml(str(tmp_path / "other.xosc"))
    file = ScenarioFile(tmp_path / "other.xosc")
    assert file.road == tmp_path / "straight.xodr"
    (ego,) = played(file, straight, 20.0).actors
    assert ego.positions[0, 1] == pytest.approx(middle[-2])
    assert ego.positions[-1, 1] == pytest.approx(middle[-1])
    assert ego.times[-1] == pytest.approx(6.0, abs=0.11)
