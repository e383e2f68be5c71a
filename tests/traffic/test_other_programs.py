"""SUMO and betterosi, where they are installed."""

import numpy as np
import pytest
from lxml import etree

from envgen_usd.errors import EnvgenError
from envgen_usd.geometry.mirrored_opendrive import mirror_document
from envgen_usd.models.actors import Actor
from envgen_usd.opendrive.reader import read
from envgen_usd.opendrive.surface import build_surface
from envgen_usd.recipe.build_options import demo_road
from envgen_usd.recipe.traffic_build import add_traffic, simulated
from envgen_usd.streets.network_roads import network_xml
from envgen_usd.streets.street_layouts import grid_network
from envgen_usd.traffic.open_scenario.scenario_lanes import LaneMap
from envgen_usd.traffic.traces import osi_trace, sumo_run
from envgen_usd.traffic.traces.osi_trace import read_osi
from envgen_usd.traffic.traces.sumo_run import (
    FleetBody,
    SumoOptions,
    simulate,
    turnout_issues,
)


def _lanes(road):
    surface = build_surface(read(demo_road(road)).network, 0.02)
    return surface.lanes, surface.roads


def test_sumo_drives_on_the_lanes_of_the_road():
    pytest.importorskip("sumo")
    fleet = [FleetBody("car", "car_sedan", (4.5, 1.8, 1.4))]
    trace = simulate(demo_road("town"), fleet, SumoOptions(5.0, 6, 4, 1))
    assert trace.rate == 10.0
    cars = [actor for actor in trace.actors if actor.model == "car_sedan"]
    assert cars
    assert all(actor.size == pytest.approx((4.5, 1.8, 1.4)) for actor in cars)
    assert min(actor.times[0] for actor in trace.actors) >= 0.0
    assert max(actor.times[-1] for actor in trace.actors) <= 5.0
    # Their middles are on the lanes as we read them, and look in the direction of travel.
    lanes = LaneMap(*_lanes("town"))
    on_lane = []
    for actor in cars:
        for (x, y), heading in zip(actor.positions[::10, :2], actor.headings[::10], strict=True):
            place = lanes.nearest(x, y, heading)
            turn = heading - lanes.path(place, 1.0).pose(0.0, 0.0)[3]
            if place.lane.junction:
                continue  # SUMO draws ways of its own over junctions.
            on_lane.append(abs(place.offset) < 0.3 and np.cos(turn) > 0.98)
    assert np.mean(on_lane) > 0.9
    again = simulate(demo_road("town"), fleet, SumoOptions(5.0, 6, 4, 1))
    assert again.actors == trace.actors


def _actor(kind, metres, number=0):
    """An actor that goes so many metres in a second."""
    places = np.column_stack(([0.0, metres], [0.0, 0.0]))
    return Actor(f"{kind}_{number}", kind, 4.5, 1.8, 1.4, np.arange(2.0), places, np.zeros(2))


@pytest.mark.parametrize(
    ("metres", "wanted", "expected"),
    [
        ((9.0, 0.0), {"vehicle": 2, "person": 1}, []),
        ((9.0, 0.0), {"vehicle": 3, "person": 1}, [("traffic.fewer", "info")]),
        ((9.0, 0.0), {"vehicle": 16, "person": 6},
         [("traffic.fewer", "warning"), ("traffic.fewer", "warning")]),
        ((0.1, 0.0), {"vehicle": 2, "person": 0}, [("traffic.standing", "warning")]),
        ((), {"vehicle": 0, "person": 1}, []),
    ],
)  # fmt: skip
def test_traffic_that_does_not_come_or_does_not_move_is_named(metres, wanted, expected):
    cars = [_actor("car", each, number) for number, each in enumerate(metres)]
    issues = turnout_issues([*cars, _actor("pedestrian", 1.3)], wanted)
    assert [(issue.kind, issue.severity.value) for issue in issues] == expected


def test_a_small_map_has_the_vehicles_that_are_asked_for(tmp_path):
    """A ring of four streets: vehicles arrive within 30 s, and none was left when it was shown."""
    pytest.importorskip("sumo")
    road = tmp_path / "ring.xodr"
    road.write_bytes(network_xml(grid_network((1, 1), 1), "ring"))
    trace = simulate(road, [], SumoOptions(10.0, 16, 0, 0))
    present = [sum(a.times[0] <= time <= a.times[-1] for a in trace.actors) for time in range(10)]
    assert 10 <= min(present) <= max(present) <= 26
    moved = [np.ptp(actor.positions[:, :2], axis=0).max() for actor in trace.actors]
    assert np.mean(np.array(moved) > 1.0) > 0.5
    assert not [
        issue for issue in trace.issues if issue.kind in {"traffic.fewer", "traffic.standing"}
    ]


def test_sumo_drives_on_the_left_where_the_road_says_so(tmp_path):
    """On the lanes as we read them, in their direction: netconvert itself knows only the right."""
    pytest.importorskip("sumo")
    root = etree.fromstring(demo_road("town").read_bytes())
    mirror_document(root)
    road = tmp_path / "left.xodr"
    road.write_bytes(etree.tostring(root))
    surface = build_surface(read(road).network, 0.02)
    trace = simulate(road, [], SumoOptions(5.0, 6, 0, 1))
    lanes = LaneMap(surface.lanes, surface.roads)
    on_lane = []
    for actor in trace.actors:
        for (x, y), heading in zip(actor.positions[::10, :2], actor.headings[::10], strict=True):
            place = lanes.nearest(x, y, heading)
            turn = heading - lanes.path(place, 1.0).pose(0.0, 0.0)[3]
            if not place.lane.junction:
                on_lane.append(abs(place.offset) < 0.3 and np.cos(turn) > 0.98)
    assert len(on_lane) > 10
    assert np.mean(on_lane) > 0.9


def test_larger_maps_have_more_traffic(tmp_path):
    """35 vehicles a kilometre of driving lane, 40 people a kilometre of sidewalk."""
    pytest.importorskip("sumo")
    for blocks in (2, 4):
        path = tmp_path / f"grid_{blocks}.xodr"
        path.write_bytes(network_xml(grid_network((blocks, blocks), 1), "grid"))
        length = {"driving": 0.0, "sidewalk": 0.0}
        for lane in build_surface(read(path).network, 0.02).lanes:
            if lane.lane_type in length and not lane.junction:
                steps = np.diff(lane.points[:, :2], axis=0)
                length[lane.lane_type] += np.hypot(*steps.T).sum() / 1000.0
        actors = simulate(path, [], SumoOptions(1.0)).actors
        people = sum(actor.kind == "pedestrian" for actor in actors)
        vehicles = len(actors) - people
        # Some have arrived before the first frame.
        assert 0.7 * 35 * length["driving"] < vehicles < 1.1 * 35 * length["driving"] + 1
        assert 0.5 * 40 * length["sidewalk"] < people < 1.1 * 40 * length["sidewalk"] + 1


def test_a_road_without_ways_is_named(street):
    pytest.importorskip("sumo")
    with pytest.raises(EnvgenError, match="has no way for vehicles or people"):
        simulated(street, street.parent / "street.xodr", SumoOptions(5.0, 4, 0, 0))


@pytest.mark.parametrize(
    ("country", "stop", "wait"), [("US", "206", "205"), ("DE", "R1-1", "r1-2")]
)
def test_netconvert_gets_the_signs_that_it_knows(tmp_path, monkeypatch, country, stop, wait):
    """A program in the place of netconvert keeps what it is given."""
    for folder in ("bin", "tools"):
        (tmp_path / folder).mkdir()
    (tmp_path / "tools" / "randomTrips.py").touch()
    program = tmp_path / "bin" / "netconvert"
    program.write_text(f'#!/bin/sh\ncp "$2" {tmp_path}/given.xodr\n')
    program.chmod(0o755)
    monkeypatch.setattr(sumo_run.importlib.util, "find_spec", lambda _: None)
    monkeypatch.setenv("SUMO_HOME", str(tmp_path))
    text = demo_road("straight").read_text()
    signs = "".join(
        f'<signal id="{n}" s="{n}" t="4" orientation="+" dynamic="no" country="{country}" '
        f'type="{code}"/>'
        for n, code in enumerate(("R1-1", "r1-2", "r2-1"))
    )
    assert text.count("</lanes>") == 1
    road = tmp_path / "road.xodr"
    road.write_text(text.replace("</lanes>", f"</lanes><signals>{signs}</signals>"))
    with pytest.raises(EnvgenError, match="makes no network"):
        simulate(road, [], SumoOptions(1.0))
    given = etree.parse(tmp_path / "given.xodr")
    assert [each.get("type") for each in given.iter("signal")] == [stop, wait, "r2-1"]


def test_sumo_needs_the_road_of_the_build(street, tmp_path):
    other = tmp_path / "other.xodr"
    other.write_text(demo_road("straight").read_text())
    with pytest.raises(EnvgenError, match="is not the road of"):
        simulated(street, other, SumoOptions())


def test_missing_extras_are_named(tmp_path, monkeypatch):
    monkeypatch.setattr(sumo_run.importlib.util, "find_spec", lambda _: None)
    monkeypatch.delenv("SUMO_HOME", raising=False)
    with pytest.raises(EnvgenError, match=r"envgen-usd\[traffic\]"):
        simulate(demo_road("town"), [], SumoOptions())
    monkeypatch.setitem(__import__("sys").modules, "betterosi", None)
    with pytest.raises(EnvgenError, match=r"envgen-usd\[osi\]"):
        osi_trace.read_osi(tmp_path / "a.osi")


def test_osi_traces_give_boxes(town, tmp_path):
    osi = pytest.importorskip("betterosi")
    kind = osi.MovingObject.VehicleClassification.Type

    def moving(name, what, x, vehicle=None):
        more = {}
        if vehicle is not None:
            more["vehicle_classification"] = osi.MovingObject.VehicleClassification(type=vehicle)
        base = osi.BaseMoving(
            dimension=osi.Dimension3d(length=4.4, width=1.8, height=1.5),
            position=osi.Vector3d(x=x, y=-1.8, z=0.75),
            orientation=osi.Orientation3d(yaw=0.1),
        )
        return osi.MovingObject(id=osi.Identifier(value=name), type=what, base=base, **more)

    path = tmp_path / "trace_gt_.osi"
    with osi.Writer(str(path)) as writer:
        for step in range(4):
            stamp = osi.Timestamp(seconds=step // 2, nanos=500_000_000 * (step % 2))
            objects = [
                moving(7, osi.MovingObject.Type.VEHICLE, 20.0 + step, kind.DELIVERY_VAN),
                moving(9, osi.MovingObject.Type.PEDESTRIAN, 10.0),
                moving(11, osi.MovingObject.Type.ANIMAL, 40.0),
            ]
            # The frame of the trace is that of the road file; the offset leads on to a map.
            offset = osi.GroundTruth.ProjFrameOffset(position=osi.Vector3d(x=5e5, y=1e4), yaw=1.0)
            writer.add(
                osi.GroundTruth(timestamp=stamp, moving_object=objects, proj_frame_offset=offset)
            )
    trace = read_osi(path)
    assert [actor.kind for actor in trace.actors] == ["van", "pedestrian", "car"]
    assert [issue.kind for issue in trace.issues] == ["traffic.unknown_kind"]
    van = trace.actors[0]
    np.testing.assert_allclose(van.positions[1], [21.0, -1.8, 0.0])
    np.testing.assert_allclose(van.headings, 0.1)
    np.testing.assert_allclose(van.times, [0, 0.5, 1.0, 1.5])
    assert add_traffic(town, lambda: trace).actors["van"] == 1
    path.write_bytes(b"\x10\x00\x00\x00nothing")
    with pytest.raises(EnvgenError, match="cannot be read as an OSI trace"):
        read_osi(path)
