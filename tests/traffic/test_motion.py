"""Actors on surfaces with a known shape."""

import numpy as np
import pytest
import shapely

from envgen_usd.errors import EnvgenError
from envgen_usd.models.actors import Actor, Motion, Obstacle, Trace
from envgen_usd.traffic.motion.actor_motion import ride
from envgen_usd.traffic.motion.conflicts import actor_conflicts, boxes_of, object_conflicts
from envgen_usd.traffic.motion.sidesteps import sidestepped
from envgen_usd.traffic.motion.surface_contact import ContactSurface

NONE = np.empty((0, 3, 3))
WHEELS = np.array([[1.4, 0.75], [1.4, -0.75], [-1.4, 0.75], [-1.4, -0.75]])


def plane(height, low=(-100.0, -20.0), high=(100.0, 20.0), step=5.0):
    """Triangles of a grid; the height is a number or a function of x and y."""
    xs = np.arange(low[0], high[0] + step / 2, step)
    ys = np.arange(low[1], high[1] + step / 2, step)
    x, y = np.meshgrid(xs, ys, indexing="ij")
    heights = height(x, y) if callable(height) else np.full_like(x, height)
    points = np.stack([x, y, heights], axis=-1)
    a, b, c, d = points[:-1, :-1], points[1:, :-1], points[1:, 1:], points[:-1, 1:]
    return np.concatenate([np.stack(t, axis=2).reshape(-1, 3, 3) for t in ((a, b, c), (a, c, d))])


def actor(times, places, headings, kind="car", name="a"):
    size = {"pedestrian": (0.5, 0.5, 1.8)}.get(kind, (4.0, 1.8, 1.5))
    return Actor(
        name, kind, *size, np.asarray(times, float), np.asarray(places, float),
        np.broadcast_to(np.asarray(headings, float), len(times)),
    )  # fmt: skip


def ridden(actors, roads=NONE, ground=NONE, rate=10.0, wheels=WHEELS):
    trace = Trace(tuple(actors), rate, "t", ())
    return ride(trace, lambda _: ContactSurface(roads, ground), lambda _: wheels)


def test_a_slope_gives_height_pitch_and_roll():
    heading = 0.7
    slope_x, slope_y = 0.06, -0.03
    times = np.arange(11) / 10
    places = np.stack([times * 10, times * 5], axis=1)
    found = ridden([actor(times, places, heading)], plane(lambda x, y: slope_x * x + slope_y * y))
    (motion,) = found.motions
    np.testing.assert_array_equal(motion.frames, np.arange(11))
    np.testing.assert_allclose(
        motion.places[:, 2], slope_x * places[:, 0] + slope_y * places[:, 1], atol=1e-9
    )
    # The vehicle's up, ahead and left are those of the plane, whatever the order of rotations.
    roll, pitch, turn = motion.turns[0]
    about_x = [[1, 0, 0], [0, np.cos(roll), -np.sin(roll)], [0, np.sin(roll), np.cos(roll)]]
    about_y = [[np.cos(pitch), 0, np.sin(pitch)], [0, 1, 0], [-np.sin(pitch), 0, np.cos(pitch)]]
    about_z = [[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]]
    matrix = np.array(about_z) @ about_y @ about_x
    normal = np.array([-slope_x, -slope_y, 1.0]) / np.linalg.norm([slope_x, slope_y, 1.0])
    np.testing.assert_allclose(matrix[:, 2], normal, atol=1e-9)
    assert np.arctan2(matrix[1, 0], matrix[0, 0]) == pytest.approx(heading)
    assert np.abs(motion.lifts).max() < 1e-9
    assert found.issues == ()


def test_a_kerb_lifts_two_wheels_and_is_reported():
    roads = np.concatenate([plane(0.0, high=(100, 0)),
                            plane(0.12, low=(-100, 0))])  # fmt: skip
    found = ridden([actor([0, 0.1], [[0, 0.2], [0, 0.2]], 0.0)], roads)
    (motion,) = found.motions
    # Left wheels on the sidewalk: a rigid plane through all four, so nothing is to be lifted.
    assert motion.places[0, 2] == pytest.approx(0.06)
    assert motion.turns[0, 0] == pytest.approx(np.arctan(0.12 / 1.5))
    assert found.issues == ()
    # Only the left front wheel on a corner of the sidewalk: each wheel misses by a quarter.
    corner = np.concatenate([plane(0.0, high=(100, 0)),
                             plane(0.0, low=(-100, 0), high=(0, 20)),
                             plane(0.12, low=(0, 0))])  # fmt: skip
    found = ridden([actor([0, 0.1], [[0, 0.2], [0, 0.2]], 0.0)], corner)
    np.testing.assert_allclose(found.motions[0].lifts[0], [0.03, -0.03, -0.03, 0.03], atol=1e-9)
    assert [issue.kind for issue in found.issues] == ["traffic.floating"]


def test_actors_stay_on_their_level_under_and_over_a_bridge():
    deck = plane(6.0, low=(-10, -5), high=(10, 5))

    def ramp(x, _):
        return np.minimum(6.0, (100 - np.abs(x)) / 15)

    ramps = [plane(ramp, low=(a, -5), high=(b, 5)) for a, b in ((-100, -10), (10, 100))]
    ground = plane(0.0)
    roads = np.concatenate([deck, *ramps])
    times = np.arange(0, 4.01, 0.1)
    over = np.stack([-50 + 25 * times, 0 * times], axis=1)
    under = np.stack([0 * times, -15 + 7.5 * times], axis=1)
    found = ridden(
        [actor(times, over, 0.0, name="over"), actor(times, under, np.pi / 2, name="under")],
        roads, ground,
    )  # fmt: skip
    high, low = found.motions
    assert high.places[20, 2] == pytest.approx(6.0)
    np.testing.assert_allclose(low.places[:, 2], 0.0, atol=1e-9)


def test_coarse_traces_follow_their_headings_around_curves():
    """A quarter circle, sampled once a second: the chord cuts 0.6 m, the curve does not."""
    angle = np.linspace(0, np.pi / 2, 5)
    radius = 20.0
    places = radius * np.stack([np.sin(angle), 1 - np.cos(angle)], axis=1)
    found = ridden(
        [actor(np.arange(5.0), places, angle)],
        plane(0.0, low=(-50, -50), high=(50, 50)), rate=1.0,
    )  # fmt: skip
    (motion,) = found.motions
    away = np.linalg.norm(motion.places[:, :2] - [0, radius], axis=1)
    assert len(motion.frames) == 41
    # The first and the last tangent are those of a single chord.
    np.testing.assert_allclose(away, radius, atol=0.04)
    assert motion.travelled[-1] == pytest.approx(radius * np.pi / 2, rel=2e-3)
    assert [issue.kind for issue in found.issues] == ["traffic.rate"]


def test_gaps_end_a_stay_and_rejoin_without_a_way():
    times = np.concatenate([np.arange(0, 1.01, 0.1), np.arange(5, 6.01, 0.1)])
    places = np.stack([times * 10, 0 * times], axis=1)
    (motion,) = ridden([actor(times, places, 0.0)], plane(0.0)).motions
    assert motion.stays == ((0, 10), (50, 60))
    assert motion.travelled[-1] == pytest.approx(20.0)


def test_driving_backwards_turns_wheels_backwards():
    times = np.arange(0, 1.01, 0.1)
    places = np.stack([-times * 3, 0 * times], axis=1)
    (motion,) = ridden([actor(times, places, 0.0)], plane(0.0)).motions
    assert motion.travelled[-1] == pytest.approx(-3.0)


def test_outside_of_the_map_actors_are_not_there():
    times = np.arange(0, 10.01, 0.1)
    places = np.stack([80 + times * 10, 0 * times], axis=1)
    lost = actor([0, 1], [[900, 0], [901, 0]], 0.0, name="lost")
    found = ridden([actor(times, places, 0.0), lost], plane(0.0))
    (motion,) = found.motions
    # Its rear wheels leave the map at x = 100, so the middle at 101.4.
    assert motion.stays == ((0, 21),)
    assert sorted(issue.where for issue in found.issues) == ["t: actor a", "t: actor lost"]
    with pytest.raises(EnvgenError, match="no actor is on the map"):
        ridden([lost], plane(0.0))


def standing(name, x, y, heading, frames=(0, 1, 2)):
    count = len(frames)
    places = np.tile([x, y, 0.0], (count, 1)).astype(float)
    turns = np.tile([0.0, 0.0, heading], (count, 1))
    who = actor([0.0], [[x, y]], heading, "car", name)
    frames = np.asarray(frames)
    return Motion(who, frames, places, turns, np.zeros(count), ((frames[0], frames[-1]),),
                  np.zeros((count, 4)))  # fmt: skip


def test_overlapping_actors_are_counted_in_their_frames_only():
    sizes = [np.array([4.0, 1.8, 1.5])] * 4
    motions = [
        standing("a", 0, 0, 0.0),
        standing("b", 3.5, 0.5, 0.0, (1, 2)),  # overlaps by half a metre in two frames
        standing("c", 0, 1.85, 0.0),  # beside a, and 4 cm from b's side would be no overlap
        standing("d", 0, 0, 0.0, (7, 8)),  # at the place of a, but later
    ]
    boxes = boxes_of(motions, sizes)
    (issue,) = actor_conflicts(boxes, ["a", "b", "c", "d"], "t")
    assert issue.message == "2 pairs of actors overlap: a and b (2 frames), b and c (2 frames)"


def test_people_step_around_objects_and_come_back():
    times = np.arange(0, 20.01, 0.1)
    places = np.stack([1.4 * times, 0 * times], axis=1)
    walker = actor(times, places, 0.0, "pedestrian", "p")
    other = actor(times, places, 0.0, "train", "t")
    bench = Obstacle("/bench", np.array([[13, -0.3], [15, -0.3], [15, 0.3], [13, 0.3]]), 0.0, 1.0)
    led, same = sidestepped(Trace((walker, other), 10.0, "t"), [bench]).actors
    assert same == other
    assert sidestepped(Trace((other,), 10.0, "t"), [bench]).actors == (other,)
    beside = (led.positions[:, 0] > 12.7) & (led.positions[:, 0] < 15.3)
    assert np.abs(led.positions[beside, 1]).min() > 0.3 + 0.25
    far = np.abs(led.positions[:, 0] - 14) > 6
    np.testing.assert_allclose(led.positions[far, 1], 0.0, atol=1e-9)
    # A gentle step: 0.9 m beside in 1.6 s, and looking along the way.
    assert np.abs(np.diff(led.positions[:, 1])).max() < 0.06
    drift = np.arctan2(*np.gradient(led.positions, axis=0).T[::-1])
    np.testing.assert_allclose(led.headings[1:-1], drift[1:-1], atol=0.02)


def box(low_x, low_y, high_x, high_y):
    corners = [[low_x, low_y], [high_x, low_y], [high_x, high_y], [low_x, high_y]]
    return Obstacle("/box", np.array(corners, dtype=float), 0.0, 1.5)


def rectangles(moved):
    """Body of an actor at each of its moments."""
    ahead = np.stack([np.cos(moved.headings), np.sin(moved.headings)], axis=1) * moved.length / 2
    left = np.stack([-np.sin(moved.headings), np.cos(moved.headings)], axis=1) * moved.width / 2
    middle = moved.positions[:, :2]
    corners = [middle + ahead + left, middle + ahead - left]
    return shapely.polygons(np.stack([*corners, middle - ahead - left, middle - ahead + left], 1))


def test_drivers_give_way_to_vehicles_half_on_the_sidewalk_and_stand_where_they_stood():
    """The middle of the lane is 0.75 m from the parked ones, half of the car's width is 0.9 m."""
    times = np.arange(0, 30.01, 0.1)
    ways = np.interp(times, [0, 7, 17, 30], [0, 56, 56, 160])  # it stands beside them for 10 s
    car = actor(times, np.stack([ways, 0 * ways], axis=1), 0.0)
    parked = [box(start, -1.75, start + 4.5, -0.75) for start in (50, 56, 62)]
    (led,) = sidestepped(Trace((car,), 10.0, "t"), parked).actors
    apart = min(shapely.distance(rectangles(led), shapely.Polygon(p.outline)).min() for p in parked)
    assert 0.1 < apart < 0.4
    away = (ways < 25) | (ways > 95)
    np.testing.assert_allclose(led.positions[away, 1], 0.0, atol=1e-9)
    stands = (times > 7) & (times < 17)
    assert np.ptp(led.positions[stands], axis=0).max() < 1e-9
    assert np.abs(led.headings).max() < 0.1


def test_who_goes_around_an_object_does_not_meet_another_actor():
    """The cheaper side of the post is the right one, where another car stands."""
    times = np.arange(0, 15.01, 0.1)
    car = actor(times, np.stack([8 * times, 0 * times], axis=1), 0.0)
    other = actor(times, np.tile([60.0, -2.4], (len(times), 1)), 0.0, name="b")
    post = box(59.9, 0.0, 60.1, 0.2)
    alone = sidestepped(Trace((car,), 10.0, "t"), [post]).actors[0]
    assert alone.positions[:, 1].min() < -0.9
    led, same = sidestepped(Trace((car, other), 10.0, "t"), [post]).actors
    assert same == other
    assert not shapely.intersects(rectangles(led), rectangles(other)).any()
    assert not shapely.intersects(rectangles(led), shapely.Polygon(post.outline)).any()


def test_people_do_not_step_onto_the_carriageway_to_pass_an_object():
    times = np.arange(0, 20.01, 0.1)
    walker = actor(times, np.stack([1.4 * times, 0 * times], axis=1), 0.0, "pedestrian", "p")
    car = actor(times, np.stack([8 * times, 0 * times - 1.7], axis=1), 0.0)  # to y = - 0.8
    bin_ = box(14.0, -0.1, 14.6, 0.3)  # passing on the right is shorter
    (alone,) = sidestepped(Trace((walker,), 10.0, "t"), [bin_]).actors
    assert alone.positions[:, 1].min() < -0.4
    led, _ = sidestepped(Trace((walker, car), 10.0, "t"), [bin_]).actors
    assert led.positions[:, 1].min() > -0.1
    assert not shapely.intersects(rectangles(led), shapely.Polygon(bin_.outline)).any()


def test_objects_in_the_way_are_named_but_not_those_above_or_below():
    boxes = boxes_of([standing("a", 0, 0, np.pi / 2)], [np.array([4.0, 1.8, 1.5])])
    square = np.array([[-0.2, 1.5], [0.2, 1.5], [0.2, 1.7], [-0.2, 1.7]])

    def hits(low, high, shift=0.0):
        obstacle = Obstacle("/World/pole", square + shift, low, high)
        return [i.message for i in object_conflicts(boxes, ["a"], [obstacle], "t")]

    assert hits(0.0, 3.0) == ["1 actors pass through objects: a through /World/pole (3 frames)"]
    assert hits(2.0, 3.0) == []
    assert hits(-1.0, 0.1) == []
    assert hits(0.0, 3.0, shift=3.0) == []
