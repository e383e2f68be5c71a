"""Traces of other programs: frames, angles and reference points against closed forms."""

import gzip

import numpy as np
import pytest

from envgen_usd.errors import EnvgenError
from envgen_usd.traffic.traces.actor_kinds import kind_of
from envgen_usd.traffic.traces.esmini_csv import read_csv_trace
from envgen_usd.traffic.traces.sumo_fcd import read_fcd

FCD = """<?xml version="1.0" encoding="UTF-8"?>
<fcd-export>
  <timestep time="0.00">
    <vehicle id="east" x="110.0" y="50.0" angle="90.0" type="DEFAULT_VEHTYPE" speed="10"/>
    <vehicle id="north" x="100.0" y="60.0" angle="0.0" type="lorry" speed="5"/>
    <person id="walker" x="101.0" y="52.0" angle="180.0" speed="1"/>
  </timestep>
  <timestep time="0.10">
    <vehicle id="east" x="111.0" y="50.0" angle="90.0" type="DEFAULT_VEHTYPE" speed="10"/>
    <vehicle id="north" x="100.0" y="60.5" angle="0.0" type="lorry" speed="5"/>
    <person id="walker" x="101.0" y="51.9" angle="180.0" speed="1"/>
  </timestep>
</fcd-export>
"""
NET = """<net><location netOffset="100.00,50.00" convBoundary="0,0,1,1"/></net>"""
ROUTES = """<routes><vType id="lorry" vClass="truck" length="8.0"/></routes>"""


def fcd_trace(folder, text=FCD, **more):
    (folder / "fcd.xml").write_text(text)
    (folder / "a.net.xml").write_text(NET)
    (folder / "a.rou.xml").write_text(ROUTES)
    return read_fcd(folder / "fcd.xml", folder / "a.net.xml", [folder / "a.rou.xml"], **more)


def test_floating_car_data_give_the_middle_behind_the_bumper(tmp_path):
    trace = fcd_trace(tmp_path)
    actors = {actor.id: actor for actor in trace.actors}
    assert trace.rate == 10.0
    assert [actor.kind for actor in trace.actors] == ["car", "truck", "pedestrian"]
    # SUMO's angle 90 is east, its position the front of 5 m, its frame moved by (100, 50).
    np.testing.assert_allclose(actors["east"].positions, [[7.5, 0.0], [8.5, 0.0]], atol=1e-9)
    np.testing.assert_allclose(actors["east"].headings, 0.0, atol=1e-9)
    # Angle 0 is north; the route file's 8 m count, width and height are those of the class.
    np.testing.assert_allclose(actors["north"].positions, [[0.0, 6.0], [0.0, 6.5]], atol=1e-9)
    np.testing.assert_allclose(actors["north"].headings, np.pi / 2)
    assert actors["north"].size == (8.0, 2.4, 2.4)
    np.testing.assert_allclose(actors["walker"].positions, [[1.0, 2.0], [1.0, 1.9]], atol=1e-9)
    assert trace.issues == ()


def test_packed_floating_car_data_are_the_same(tmp_path):
    plain = fcd_trace(tmp_path)
    with gzip.open(tmp_path / "fcd.xml.gz", "wt") as file:
        file.write(FCD)
    packed = read_fcd(tmp_path / "fcd.xml.gz", tmp_path / "a.net.xml", [tmp_path / "a.rou.xml"])
    assert packed.actors == plain.actors


def test_headings_unwrap_over_north(tmp_path):
    rows = "".join(
        f'<timestep time="{k / 10}"><vehicle id="a" x="0" y="0" angle="{angle}" type="bus"/>'
        "</timestep>"
        for k, angle in enumerate((350.0, 0.0, 10.0))
    )
    (tmp_path / "fcd.xml").write_text(f"<fcd-export>{rows}</fcd-export>")
    (actor,) = read_fcd(tmp_path / "fcd.xml").actors
    assert actor.kind == "bus"
    np.testing.assert_allclose(np.degrees(np.diff(actor.headings)), -10.0)


def test_times_that_go_back_are_sorted_and_named(tmp_path):
    again = FCD.replace('time="0.10"', 'time="-0.10"')
    trace = fcd_trace(tmp_path, again)
    assert [actor.times.tolist() for actor in trace.actors] == [[-0.1, 0.0]] * 3
    assert {(issue.kind, issue.action) for issue in trace.issues} == {("traffic.time", "sorted")}
    assert "actor east" in trace.issues[0].where
    plain = fcd_trace(tmp_path)
    for actor, other in zip(trace.actors, plain.actors, strict=True):
        np.testing.assert_array_equal(actor.positions, other.positions[::-1])


def test_two_actors_of_one_id_are_named(tmp_path):
    """The second was lost with a word about times alone."""
    rows = [f"{k / 10},{name},{x + k},0,0\n" for k in range(5) for name, x in (("a", 0), ("a", 30))]
    (tmp_path / "own.csv").write_text("time,id,x,y,h\n" + "".join(rows))
    trace = read_csv_trace(tmp_path / "own.csv")
    (actor,) = trace.actors
    np.testing.assert_allclose(np.diff(actor.positions[:, 0]), 1.0)
    (issue,) = [each for each in trace.issues if each.kind == "traffic.time"]
    assert issue.message.startswith("5 samples at times that it has already")


@pytest.mark.parametrize(("step", "jumps"), [(9.9, 0), (10.1, 4), (60.0, 4)])
def test_jumps_are_named(tmp_path, step, jumps):
    """A step of 10 m in a tenth of a second is 360 km/h."""
    rows = [f"{k / 10},a,{step * k},0,0\n" for k in range(5)]
    (tmp_path / "own.csv").write_text("time,id,x,y,h\n" + "".join(rows))
    found = [each for each in read_csv_trace(tmp_path / "own.csv").issues if "jump" in each.kind]
    assert [each.message.split()[0] for each in found] == ([str(jumps)] if jumps else [])


def test_an_unknown_type_is_named_and_judged_by_its_size(tmp_path):
    routes = '<routes><vType id="lorry" vClass="hovercraft" length="9.0" width="2.5"/></routes>'
    (tmp_path / "b.rou.xml").write_text(routes.replace("lorry", "thing"))
    (tmp_path / "fcd.xml").write_text(FCD.replace('"lorry"', '"thing"'))
    trace = read_fcd(tmp_path / "fcd.xml", None, [tmp_path / "b.rou.xml"])
    assert trace.actors[1].kind == "truck"
    (issue,) = trace.issues
    assert issue.kind == "traffic.unknown_kind"
    assert "hovercraft" in issue.message


def test_files_of_another_kind_are_refused(tmp_path):
    (tmp_path / "net.xml").write_text(NET)
    with pytest.raises(EnvgenError, match=r"root element is net, expected fcd-export"):
        read_fcd(tmp_path / "net.xml")
    with pytest.raises(EnvgenError, match="cannot be read"):
        read_fcd(tmp_path / "missing.xml")
    (tmp_path / "a.csv").write_text("1,2,3\n")
    with pytest.raises(EnvgenError, match="no header"):
        read_csv_trace(tmp_path / "a.csv")


LOGGED = """esmini GIT REV: v2.37
Scenario File Name: cut-in.xosc
Number of Vehicles: 2
Index [-] , TimeStamp [s] , #1 Entity_Name [-] , #1 Entity_ID [-] , #1 bb_x [m] , #1 bb_y [m] , \
#1 bb_length [m] , #1 bb_width [m] , #1 bb_height [m] , #1 World_Position_X [m] , \
#1 World_Position_Y [m] , #1 World_Position_Z [m] , #1 World_Heading_Angle [rad] , \
#2 Entitity_Name [-] , #2 bb_x [m] , #2 bb_y [m] , #2 bb_length [m] , #2 bb_width [m] , \
#2 bb_height [m] , #2 World_Position_X [m] , #2 World_Position_Y [m] , #2 World_Position_Z [m] , \
#2 World_Heading_Angle [rad] ,
1, 0.00, Ego_car, 0, 1.4, 0.0, 5.0, 2.0, 1.5, 10.0, 2.0, 0.5, 1.5707963, bus_blue, \
3, 0, 12, 2.5, 3, 0, 0, 0, 0,
2, 0.05, Ego_car, 0, 1.4, 0.0, 5.0, 2.0, 1.5, 10.0, 2.5, 0.5, 1.5707963, bus_blue, \
3, 0, 12, 2.5, 3, 1, 0, 0, 0,
"""


def test_the_logger_of_esmini_gives_boxes(tmp_path):
    (tmp_path / "log.csv").write_text(LOGGED)
    trace = read_csv_trace(tmp_path / "log.csv")
    ego, bus = trace.actors
    assert trace.rate == 20.0
    assert (ego.kind, bus.kind) == ("car", "bus")
    assert ego.size == (5.0, 2.0, 1.5)
    # The box is 1.4 m ahead of the rear axle, and the front is north.
    np.testing.assert_allclose(ego.positions, [[10, 3.4, 0.5], [10, 3.9, 0.5]], atol=1e-6)
    np.testing.assert_allclose(bus.positions[:, 0], [3.0, 4.0])
    assert trace.issues == ()


def test_zeros_at_the_end_of_a_name_are_part_of_it(tmp_path):
    """NumPy's texts have none: such a name was lost, and ended the reading (fuzzing, seed 12)."""
    (tmp_path / "log.csv").write_text(LOGGED.replace(", Ego_car,", ", Ego_car\0\0,", 1))
    trace = read_csv_trace(tmp_path / "log.csv")
    assert [actor.id.rstrip("\0") for actor in trace.actors] == ["Ego_car", "bus_blue"]


def test_rows_of_dat2csv_stand_on_the_rear_axle(tmp_path):
    text = """Version: 2, OpenDRIVE: road.xodr, 3DModel:
time, id, name, x, y, z, h, p, r, speed, wheel_angle, wheel_rot
0.0, 0, car_red, 0.0, 0.0, 0.0, 0.0, 0, 0, 10, 0, 0
0.0, 1, pedestrian_adult, 5.0, 4.0, 0.0, 3.0, 0, 0, 1, 0, 0
0.1, 0, car_red, 1.0, 0.0, 0.0, 0.0, 0, 0, 10, 0, 0
0.1, 1, pedestrian_adult, 5.1, 4.0, 0.0, 3.0, 0, 0, 1, 0, 0
"""
    (tmp_path / "dat.csv").write_text(text)
    trace = read_csv_trace(tmp_path / "dat.csv")
    car, walker = trace.actors
    assert (car.kind, walker.kind) == ("car", "pedestrian")
    assert car.positions[0, 0] == pytest.approx(0.3 * car.length)
    np.testing.assert_allclose(walker.positions[:, 0], [5.0, 5.1])
    assert [issue.kind for issue in trace.issues] == ["traffic.no_sizes"]


def test_rows_with_sizes_are_taken_as_they_are(tmp_path):
    text = """time,id,kind,length,width,height,x,y,h
0,a,truck,9,2.5,3.5,1,2,0
1,a,truck,9,2.5,3.5,nan,2,0
2,a,truck,9,2.5,3.5,3,2,0
"""
    (tmp_path / "own.csv").write_text(text)
    trace = read_csv_trace(tmp_path / "own.csv")
    (actor,) = trace.actors
    np.testing.assert_allclose(actor.positions, [[1, 2], [3, 2]])
    assert actor.size == (9.0, 2.5, 3.5)
    assert [issue.kind for issue in trace.issues] == ["traffic.broken_rows"]


@pytest.mark.parametrize(
    ("name", "kind"),
    [("car_white", "car"), ("delivery", "van"), ("semi-trailer", "truck"), ("bus_blue", "bus"),
     ("rail_urban", "train"), ("Bicycle", "bicycle"), ("mc", "motorcycle"), ("glider", "")],
)  # fmt: skip
def test_names_of_kinds(name, kind):
    assert kind_of(name) == kind
