"""Points of scans, against closed forms of planes and boxes."""

import gc
import weakref
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from envgen_usd.render.lidar import tree_store
from envgen_usd.render.lidar.lidar_scan import Motion, scan
from envgen_usd.render.lidar.lidar_surfaces import SurfaceTable
from envgen_usd.render.lidar.static_tree import StaticTree
from envgen_usd.render.lidar.tree_store import TreeStore
from envgen_usd.render.render_scene import Level, Texture

HERE = np.zeros((2, 2))


def at(x=0.0, y=0.0, z=0.0, yaw=0.0):
    pose = np.eye(4)
    c, s = np.cos(np.radians(yaw)), np.sin(np.radians(yaw))
    pose[:2, :2] = [[c, -s], [s, c]]
    pose[:3, 3] = x, y, z
    return pose


def scanned(scene, model, pose, *, seed=0, motion=None, reach=None):
    tree = StaticTree(scene, HERE, reach or model.range + 20.0)
    return scan(tree, SurfaceTable(scene), model, pose, np.random.default_rng(seed), motion)


def test_rings_on_a_plane_have_the_radius_of_their_elevation(quads, perfect):
    quads.ground(quads.named("road"), height=-1.5)
    model = perfect(elevations=(10.0, 0.0, -2.0, -5.0, -10.0, -20.0, -45.0))
    got = scanned(quads.scene(), model, at(3.0, 4.0, 0.3, yaw=30.0))
    assert set(got.rings.tolist()) == {2, 3, 4, 5, 6}
    for ring in range(2, 7):
        points = got.points[got.rings == ring]
        assert len(points) == 360
        radius = 1.8 / np.tan(np.radians(-model.elevations[ring]))
        np.testing.assert_allclose(np.hypot(*points[:, :2].T), radius, rtol=1e-5)
        np.testing.assert_allclose(points[:, 2], -1.8, atol=1e-4)
    np.testing.assert_array_equal(got.scene_objects, 2)


def test_ranges_in_a_room_are_those_of_its_walls(quads, perfect):
    """A closed box around the sensor: the range is the least over the six planes."""
    low, high = np.array([-4.0, -3.0, -1.0]), np.array([6.0, 9.0, 2.0])
    names = []
    for axis in range(3):
        for side, value in ((0, low), (1, high)):
            meant = quads.named("building", f"{'xyz'[axis]}{side}", 1)
            names.append(meant)
            b, c = (axis + 1) % 3, (axis + 2) % 3
            corners = np.zeros((4, 3))
            corners[:, axis] = value[axis]
            corners[:, b] = [low[b], high[b], high[b], low[b]]
            corners[:, c] = [low[c], low[c], high[c], high[c]]
            quads.quad(corners, meant)
    model = perfect(elevations=tuple(np.linspace(80.0, -80.0, 33).tolist()))
    pose = at(0.5, 1.0, 0.2, yaw=17.0)
    got = scanned(quads.scene(), model, pose)
    assert len(got.points) == model.shots
    ways = model.directions.astype(np.float64) @ pose[:3, :3].T
    planes = np.where(ways[:, :, None] > 0.0, high[:, None], low[:, None])[:, :, 0]
    with np.errstate(divide="ignore"):
        ranges = np.abs((planes - pose[:3, 3]) / ways)
    np.testing.assert_allclose(np.linalg.norm(got.points, axis=1), ranges.min(axis=1), rtol=2e-5)
    axis = ranges.argmin(axis=1)
    expected = np.array(names)[2 * axis + (ways[np.arange(len(axis)), axis] > 0.0)]
    near = np.sort(ranges, axis=1)
    clear = near[:, 1] - near[:, 0] > 1e-3
    np.testing.assert_array_equal(got.scene_objects[clear], expected[clear])


def test_nothing_around_gives_no_points(quads, perfect):
    got = scanned(quads.scene(), perfect(), at())
    assert got.points.shape == (0, 3)
    quads.wall(130.0, quads.named("wall"))
    assert len(scanned(quads.scene(), perfect(), at()).points) == 0  # beyond the range


def test_noise_has_its_standard_deviation_and_steps(quads, perfect):
    quads.wall(20.0, quads.named("wall"))
    model = perfect(elevations=tuple(np.linspace(20, -20, 64).tolist()), columns=1000)
    scene = quads.scene()
    exact = np.linalg.norm(scanned(scene, model, at()).points, axis=1)
    noisy = scanned(scene, replace(model, noise=0.03), at(), seed=5)
    errors = np.linalg.norm(noisy.points, axis=1) - exact
    count = len(errors)
    assert count > 15_000
    assert abs(errors.mean()) < 4.0 * 0.03 / np.sqrt(count)
    assert errors.std() == pytest.approx(0.03, rel=4.0 / np.sqrt(2.0 * count))
    stepped = scanned(scene, replace(model, resolution=0.25), at())
    ranges = np.linalg.norm(stepped.points, axis=1)
    np.testing.assert_allclose(ranges, np.round(ranges * 4.0) / 4.0, atol=1e-5)
    assert np.abs(ranges - exact).max() <= 0.125 + 1e-5


def test_the_direction_of_a_noisy_point_is_that_of_its_shot(quads, perfect):
    quads.wall(20.0, quads.named("wall"))
    model = perfect(noise=0.1)
    got = scanned(quads.scene(), model, at(), seed=1)
    shots = got.rings.astype(np.int64) * model.columns + got.columns
    ways = got.points / np.linalg.norm(got.points, axis=1, keepdims=True)
    np.testing.assert_allclose(ways, model.directions[shots], atol=1e-6)
    np.testing.assert_allclose(got.times, model.times[got.columns], atol=1e-7)
    assert (np.diff(shots) > 0).all()


def test_lost_shots_are_the_share_of_the_device(quads, perfect):
    quads.ground(quads.named("road"), height=-2.0)
    model = perfect(elevations=tuple(np.linspace(-5, -60, 50).tolist()), drop_out=0.2)
    count = len(scanned(quads.scene(), model, at(), seed=3).points)
    assert count / model.shots == pytest.approx(0.8, abs=4.0 * np.sqrt(0.16 / model.shots))


def test_ranges_beyond_those_of_the_device_are_not_reported(quads, perfect):
    quads.ground(quads.named("road"), height=-2.0)
    model = perfect(
        elevations=tuple(np.linspace(-1, -80, 80).tolist()), range=30.0, nearest=5.0, noise=0.5
    )
    ranges = np.linalg.norm(scanned(quads.scene(), model, at()).points, axis=1)
    assert 5.0 <= ranges.min() < 5.5
    assert 28.0 < ranges.max() <= 30.0
    quads.wall(29.9, quads.named("wall"))
    level = perfect(elevations=(0.0,), range=30.0, noise=0.5)
    ranges = np.linalg.norm(scanned(quads.scene(), level, at()).points, axis=1)
    assert len(ranges)
    assert ranges.max() <= 30.0


def board(quads, reflectance, distance):
    """A grey board of a Lambertian class, across the x axis."""
    grey = quads.material(diffuse=(reflectance,) * 3)
    quads.wall(distance, quads.named("traffic_light"), grey, half=distance / 60.0)


@pytest.mark.parametrize(("share", "distance"), [(0.9, 50.0), (0.5, 50.0 * np.sqrt(1.2563))])
def test_a_dim_board_is_detected_as_often_as_the_data_sheet_says(
    quads, perfect, monkeypatch, share, distance
):
    """A board of 10 % at the dim range: 90 %; where the signal is the threshold: 50 %."""
    from envgen_usd.render.lidar import lidar_surfaces  # noqa: PLC0415

    rows = (lidar_surfaces.LidarSurface("void", 0.1),)
    monkeypatch.setattr(lidar_surfaces, "_rows", lambda: rows)
    board(quads, 0.1, distance)
    model = perfect(
        elevations=tuple(np.linspace(0.9, -0.9, 100).tolist()), columns=36000, dim_range=50.0
    )
    got = scanned(quads.scene(), model, at(), seed=2)
    # Rays that meet the board, within a degree of its normal.
    across = np.abs(np.tan(model.azimuths)) < 1.0 / 60.0
    ahead = np.count_nonzero(across & (np.abs(model.azimuths) < 1.0))
    shots = ahead * len(model.elevations)
    assert len(got.points) / shots == pytest.approx(share, abs=0.02)


def test_intensity_is_the_reflectance_times_the_angle(quads, perfect, monkeypatch):
    """Lambert: the cosine. Oren and Nayar with the light at the eye: A cos + B sin^2."""
    from envgen_usd.render.lidar import lidar_surfaces as surfaces  # noqa: PLC0415

    rows = (
        surfaces.LidarSurface("void", 0.6),
        surfaces.LidarSurface("road", 0.4, slope=30.0),
        surfaces.LidarSurface("road", 0.4, part="lane_marking", retro=50.0),
        surfaces.LidarSurface("wall", 0.2, colour=0.75),
    )
    monkeypatch.setattr(surfaces, "_rows", lambda: rows)
    quads.material(diffuse=(0.8, 0.8, 0.8))
    model = perfect(elevations=tuple(np.linspace(-3, -85, 42).tolist()), columns=8)
    cosine = np.sin(np.radians(-np.array(model.elevations)))
    square = np.radians(30.0) ** 2
    a, b = 1.0 - 0.5 * square / (square + 0.33), 0.45 * square / (square + 0.09)
    sine = np.sqrt(1.0 - cosine**2)
    retro = np.where(cosine > np.cos(np.radians(40.0)), 1.0, 0.4 * cosine)
    expected = {
        ("static", ""): 0.6 * cosine,
        ("road", "driving"): 0.4 * cosine * (a + b * sine * sine / cosine),
        ("road", "lane_marking"): retro,
        ("wall", ""): (0.25 * 0.2 + 0.75 * 0.8) * cosine,
    }
    for (label, part), values in expected.items():
        quads.geometries, quads.uses = [], []
        quads.ground(quads.named(label, part), height=-1.0)
        got = scanned(quads.scene(), model, at())
        np.testing.assert_allclose(got.intensities, values[got.rings], atol=0.5 / 255 + 2e-3)
        assert set(got.rings.tolist()) == set(range(42))


def test_rays_go_on_through_the_gaps_of_leaves(quads, perfect, tmp_path):
    """The lower left quarter of a card is solid; the wall behind it shows through the rest."""
    pixels = np.zeros((4, 4, 4), np.uint8)
    pixels[2:, :2, 3] = 255  # images begin at the top
    Image.fromarray(pixels).save(tmp_path / "leaf.png")
    cut = Texture(str(tmp_path / "leaf.png"), srgb=True, channel=3)
    leaf = quads.material(opacity_threshold=0.5, textures={"opacity": cut})
    solid = quads.material()
    crown, wall = quads.named("vegetation", "crown", 1), quads.named("building", number=1)
    cards = {12.0: 4.0, 11.0: -3.0, 10.0: 0.0}
    for x, mid in cards.items():
        left, right = mid + 5, mid - 5
        quads.quad([(x, left, -5), (x, right, -5), (x, right, 5), (x, left, 5)], crown, leaf)
    quads.wall(30.0, wall, solid)
    model = perfect(elevations=tuple(np.linspace(20.0, -20.0, 81).tolist()), columns=1441)
    got = scanned(quads.scene(), model, at())
    shots = got.rings.astype(np.int64) * model.columns + got.columns
    ways = model.directions[shots].astype(np.float64)
    expected = np.full(len(ways), 30.0)
    for x, mid in cards.items():
        y, z = (x * ways[:, axis] / ways[:, 0] for axis in (1, 2))
        expected[(y > mid) & (y < mid + 5.0) & (z < 0.0) & (z > -5.0)] = x
    edge = np.abs(got.points[:, 0] - expected) > 1e-3
    assert edge.mean() < 0.003  # float32 at the edges of texels
    np.testing.assert_array_equal(
        got.scene_objects[~edge], np.where(expected < 20.0, crown, wall)[~edge]
    )
    assert {10.0, 11.0, 12.0, 30.0} == set(expected.tolist())


def test_a_ray_ends_in_a_wood_without_end(quads, perfect):
    """A hundred cards without any leaf: more gaps than are followed, and the wall is not seen."""
    glass = quads.material(opacity=0.0, opacity_threshold=0.5)
    card, wall = quads.named("vegetation", number=1), quads.named("building", number=1)
    for number in range(30):
        quads.wall(5.0 + 0.1 * number, card, glass)
    quads.wall(20.0, wall, quads.material())
    model = perfect(elevations=(0.0,), columns=8)
    seen = scanned(quads.scene(), model, at())
    assert seen.scene_objects.tolist() == [wall] * 4
    for number in range(60):
        quads.wall(9.0 + 0.1 * number, card, glass)
    assert len(scanned(quads.scene(), model, at()).points) == 0


def test_a_moving_sensor_sees_each_point_from_where_it_is(quads, perfect):
    """Towards a wall with 20 m/s: the wall is nearer in later shots."""
    quads.wall(30.0, quads.named("wall"), half=100.0)
    model = perfect(elevations=(0.0,), columns=720, rate=10.0)
    motion = Motion.between(at(0.0), at(2.0), 0.1)
    got = scanned(quads.scene(), model, at(), motion=motion)
    assert len(got.points) > 200
    np.testing.assert_allclose(got.points[:, 0], 30.0 - 20.0 * got.times, atol=1e-4)
    assert np.ptp(got.times) > 0.03


def test_a_turning_sensor_reports_its_own_frame(quads, perfect):
    """The vehicle turns 9 degrees in a turn: the wall's points lie on a plane that turns back."""
    quads.wall(30.0, quads.named("wall"), half=100.0)
    model = perfect(elevations=(0.0,), columns=720)
    motion = Motion.between(at(yaw=0.0), at(yaw=9.0), 0.1)
    got = scanned(quads.scene(), model, at(), motion=motion)
    angle = np.radians(90.0) * got.times
    ahead = got.points[:, 0] * np.cos(angle) - got.points[:, 1] * np.sin(angle)
    np.testing.assert_allclose(ahead, 30.0, atol=1e-3)


def test_objects_have_one_level_of_detail(quads, level):
    """A board of 1 m has its far form beyond 10 m from the place."""
    near, far = quads.named("pole", number=1), quads.named("pole", number=2)
    places = [at(x, 0.0, 0.0) for x in (5.0, 9.0, 15.0, 40.0)]
    card = [(0, 0.5, -0.5), (0, -0.5, -0.5), (0, -0.5, 0.5), (0, 0.5, 0.5)]
    for meant, is_far in ((near, False), (far, True)):
        form = level(far=is_far, middle=(0.0, 0.0, 0.0), size=1.0)
        quads.quad(card, meant, matrices=places, level=form)
    scene = quads.scene()
    tree = StaticTree(scene, HERE, 100.0)
    assert tree.triangles == 8
    seen = {}
    for x in (4.0, 8.0, 14.0, 39.0):
        way = np.array([[1.0, 0.0, 0.0]], np.float32)
        hits = tree.cast(np.array([x, 0.1, 0.1]), way, 100.0)
        seen[x] = int(hits.scene_objects[0])
        assert hits.ranges[0] == pytest.approx(1.0, abs=1e-5)
    assert seen == {4.0: near, 8.0: near, 14.0: far, 39.0: far}
    # Around a larger place, more is near.
    wide = StaticTree(scene, np.array([(0.0, 0.0), (6.0, 0.0)]), 100.0)
    hits = wide.cast(np.array([14.0, 0.1, 0.1]), way, 100.0)
    assert int(hits.scene_objects[0]) == near


def test_placements_out_of_reach_are_left_out(quads, level):
    """A board every 10 m; those from -50 to 70 are within reach."""
    card = [(0, 0.5, -0.5), (0, -0.5, -0.5), (0, -0.5, 0.5), (0, 0.5, 0.5)]
    form = level(far=False, middle=(0.0, 0.0, 0.0), size=1000.0)
    places = [at(x, 0.0, 0.0) for x in np.arange(-200.0, 200.0, 10.0)]
    quads.quad(card, quads.named("pole"), matrices=places, level=form)
    tree = StaticTree(quads.scene(), np.array([(0.0, 0.0), (20.0, 0.0)]), 50.0)
    assert tree.triangles == 2 * 13


def first_hits(triangles, starts, ways):
    """Range and cosine of the first triangle (T x 3 x 3) that each ray meets, one by one.

    Source: Moeller and Trumbore, Fast, minimum storage ray-triangle intersection (1997).
    """
    one, two, three = triangles.transpose(1, 0, 2)
    normals = np.cross(two - one, three - one)
    ranges, cosines = np.full(len(ways), np.inf), np.zeros(len(ways))
    for ray, (start, way) in enumerate(zip(starts, ways, strict=True)):
        across = np.cross(way, three - one)
        with np.errstate(divide="ignore", invalid="ignore"):
            scale = 1.0 / np.einsum("ij,ij->i", two - one, across)
            u = np.einsum("ij,ij->i", start - one, across) * scale
            aside = np.cross(start - one, two - one)
            v = aside @ way * scale
            far = np.einsum("ij,ij->i", three - one, aside) * scale
        far[~((u >= 0) & (v >= 0) & (u + v <= 1) & (far > 0))] = np.inf
        best = far.argmin()
        ranges[ray] = far[best]
        cosines[ray] = abs(normals[best] @ way) / np.linalg.norm(normals[best])
    return ranges, cosines


def test_sheared_and_mirrored_placements_are_hit_where_they_are(quads):
    """Half of the boards are joined to one tree, the others are placed; against all triangles."""
    rng = np.random.default_rng(4)
    form = Level(far=False, middle=(0.0, 0.0, 0.0), size=1e6)
    card, triangles = [(0, 1, -1), (0, -1, -1), (0, -1, 1), (0, 1, 1)], []
    for level in (None, form):
        matrices = np.tile(np.eye(4), (150, 1, 1))
        matrices[:, :3, :3] = rng.normal(0.0, 2.0, (150, 3, 3))
        matrices[:, :3, 3] = rng.uniform(-30.0, 30.0, (150, 3))
        quads.quad(card, quads.named("pole"), matrices=matrices, level=level)
        corners = np.array(card, np.float64) @ matrices[:, :3, :3].transpose(0, 2, 1)
        corners += matrices[:, None, :3, 3]
        triangles += [corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]]
    ways = rng.normal(size=(1000, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    starts = rng.uniform(-5.0, 5.0, (1000, 3))
    ranges, cosines = first_hits(np.concatenate(triangles), starts, ways)
    tree = StaticTree(quads.scene(), HERE, 100.0)
    for order in (None, rng.permutation(1000)):
        got = tree.cast(starts, ways.astype(np.float32), 500.0, order)
        hit = np.isfinite(ranges)
        assert 300 < hit.sum() < 1000
        same = np.isclose(got.ranges, ranges, rtol=1e-4, atol=1e-3)
        assert same.mean() > 0.995  # Rays that touch an edge may miss it.
        both = same & hit
        np.testing.assert_allclose(got.cosines[both], cosines[both], atol=2e-3)


def test_trees_are_kept_for_the_next_place(quads, level, monkeypatch):
    card = [(0, 0.5, -0.5), (0, -0.5, -0.5), (0, -0.5, 0.5), (0, 0.5, 0.5)]
    form = level(far=False, middle=(0.0, 0.0, 0.0), size=1000.0)
    quads.quad(card, quads.named("pole"), matrices=[at(5.0)], level=form)
    quads.ground(quads.named("road"), height=-2.0)
    store, scene = TreeStore(), quads.scene()
    region = store.parts(scene, frozenset()).regions[0].tree
    board = store.tree(scene.geometries[0])
    ways = np.array([[0.0, 0.0, -1.0], [1.0, 0.0, 0.0]], np.float32)
    for x in (0.0, 3.0):
        place = np.array([(x, 0.0), (x, 0.0)])
        got = StaticTree(scene, place, 100.0, store=store).cast(np.array([x, 0, 0]), ways, 50.0)
        np.testing.assert_allclose(got.ranges, [2.0, 5.0 - x], atol=1e-5)
    assert store.parts(scene, frozenset()).regions[0].tree is region
    assert store.tree(scene.geometries[0]) is board
    # A geometry that the stage drops, and regions beyond the limit, free their memory.
    gone = weakref.ref(board), weakref.ref(region)
    del board, region
    monkeypatch.setattr(tree_store, "_KEPT", 1)
    store.parts(scene, frozenset())
    del scene
    quads.geometries.clear()
    gc.collect()
    assert [each() for each in gone] == [None, None]
