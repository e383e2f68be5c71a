"""What is left out of a frame as hidden is hidden; what is smoothed covers its share."""

import numpy as np
import pytest

from envgen_usd.render.cameras.camera_pose import look_at
from envgen_usd.render.cameras.camera_rig import Camera
from envgen_usd.render.drawing import label_pass
from envgen_usd.render.lighting.sun_shadows import (
    CASCADES,
    CasterChoice,
    ShadedPlaces,
    beyond,
    shadow_view,
    window,
)
from envgen_usd.render.opengl.depth_pyramid import DepthPyramid, Rectangles, camera_rectangles


@pytest.mark.parametrize("least", [1, 4])
def test_a_box_is_hidden_only_behind_every_pixel_of_its_rectangle(least):
    rng = np.random.default_rng(0)
    depth = rng.uniform(1, 100, (37, 53)).astype(np.float32)
    depth[10:14, 20:29] = 2.0
    low = rng.integers(-5, (40, 56), (4000, 2))
    high = low + rng.integers(0, 9, (4000, 2))
    boxes = Rectangles(low, high, rng.uniform(0.5, 110, 4000))
    visible = DepthPyramid(depth, least).leaves_visible(boxes)
    hidden = 0
    for (top, left), (bottom, right), nearest, seen in zip(
        low, high, boxes.nearest, visible, strict=True
    ):
        part = depth[max(top, 0) : max(bottom + 1, 0), max(left, 0) : max(right + 1, 0)]
        if part.size and part.max() >= nearest:
            assert seen
        if not part.size:
            assert not seen
        hidden += part.size > 0 and not seen
    assert 100 < hidden < 3000


def test_ground_behind_a_wall_is_hidden_right_below_the_sky():
    depth = np.full((40, 64), 10.0, np.float32)
    depth[:19] = np.inf
    wide = Rectangles(np.array([[20, 3]]), np.array([[22, 60]]), np.array([50.0]))
    assert not DepthPyramid(depth, 4).leaves_visible(wide).any()


def test_a_rectangle_holds_the_centres_that_its_box_covers():
    rng = np.random.default_rng(1)
    camera = Camera(width=200, height=100, fx=90.0, fy=110.0, cx=80.0, cy=55.0)
    pose = look_at(np.array([3.0, -2.0, 1.5]), np.array([20.0, 30.0, 4.0]))
    low = rng.uniform(-60, 60, (500, 3))
    boxes = np.stack((low, low + rng.uniform(0, 12, (500, 3))), axis=1)
    found = camera_rectangles(boxes, camera, pose)
    inside = boxes[:, :1] + rng.random((500, 40, 3)) * (boxes[:, 1:] - boxes[:, :1])
    x, y, z = np.moveaxis((inside - pose[:3, 3]) @ pose[:3, :3], -1, 0)
    assert (z >= found.nearest[:, None] - 1e-9)[z > 0].all()
    seen = z > camera.near
    column = camera.fx * x / np.where(seen, z, 1.0) + camera.cx
    row = camera.fy * y / np.where(seen, z, 1.0) + camera.cy
    seen &= (column >= 0) & (column <= 199) & (row >= 0) & (row <= 99)
    assert seen.sum() > 1000
    for value, axis in ((row, 0), (column, 1)):
        low_side, high_side = found.low[:, axis], found.high[:, axis]
        first = np.ceil(np.where(seen, value, np.inf).min(axis=1))
        last = np.floor(np.where(seen, value, -np.inf).max(axis=1))
        covered = first <= last
        assert covered.sum() > 20
        assert (low_side <= first)[covered].all()
        assert (high_side >= last)[covered].all()


@pytest.mark.parametrize(("column", "is_held"), [(7.0, True), (7.05, True), (7.5, False)])
def test_what_lies_between_the_centres_of_pixels_is_left_out(column, is_held):
    camera = Camera(width=20, height=10, fx=10.0, fy=10.0, cx=9.5, cy=4.5)
    middle = np.array([(column - 9.5) / 10 * 50, -0.5 / 10 * 50, 50.0])
    half = np.array([0.4, 6.0, 0.1])  # 0.16 pixels wide, 2.4 high
    box = np.stack((middle - half, middle + half))[None]
    assert camera_rectangles(box, camera, np.eye(4)).hold_pixels.tolist() == [is_held]


@pytest.mark.parametrize("cascade", CASCADES)
def test_only_what_lies_towards_the_sun_casts_a_shadow(cascade):
    towards = np.array([0.4, 0.1, 0.9]) / np.linalg.norm([0.4, 0.1, 0.9])
    eye = np.array([100.0, 50.0, 1.5])
    pose = np.eye(4)
    pose[:3, 2], pose[:3, 3] = (1.0, 0.0, 0.0), eye
    view = shadow_view(cascade, pose, towards)
    place = np.array([[cascade.ahead], [3.0], [-1.5]], np.float32)
    middle = eye + place[:, 0] + np.array([0.0, 0.0, 0.2])
    cell = 2 * cascade.reach / 128
    aside = np.array([0.0, 8 * cell, 0.0])
    up = 2.0 * view.texel * towards
    middles = [
        middle + 5 * towards,
        middle + 5 * towards + aside,
        middle - 5 * towards,
        middle + up,
    ]
    half = np.full(3, 2.0 * view.texel)
    boxes = np.stack([np.stack((m - half, m + half)) for m in middles])
    shaded = ShadedPlaces.of(view, place, eye)
    assert CasterChoice(view, shaded, eye).of(boxes).tolist() == [True, False, False, True]
    left, bottom, width, height = window(shaded.farthest, cascade.side)
    column, row = (
        view.clip_from(eye)[:2] @ [*place[:, 0], 1.0] * cascade.side / 2 + cascade.side / 2
    )
    assert left <= column <= left + width
    assert bottom <= row <= bottom + height
    assert width <= 3 * cascade.side / 128
    assert beyond(view, place, eye).shape == (3, 0)
    assert beyond(view, place + np.float32(cascade.reach), eye).shape == (3, 1)


@pytest.mark.parametrize("cascade", CASCADES)
def test_what_is_too_small_or_too_low_for_a_shadow_map_casts_no_shadow(cascade):
    """A texel of width or of height above the only place below."""
    towards = np.array([0.0, 0.0, 1.0])
    pose, ground = np.eye(4), np.array([[cascade.ahead], [3.0], [-1.5]], np.float32)
    pose[:3, 2] = (1.0, 0.0, 0.0)
    view = shadow_view(cascade, pose, towards)
    choice = CasterChoice(view, ShadedPlaces.of(view, ground, pose[:3, 3]), pose[:3, 3])
    for width, top, is_caster in ((1, 9, False), (9, 9, True), (9, 0.5, False), (9, 1.5, True)):
        half = np.array([width / 2, width / 2, 0.2]) * view.texel
        middle = ground[:, 0] + [0.0, 0.0, top * view.texel - half[2]]
        assert choice.of(np.stack((middle - half, middle + half))[None]).tolist() == [is_caster]


def test_a_box_beyond_the_image_or_behind_the_camera_holds_no_pixel():
    camera = Camera(width=20, height=10, fx=10.0, fy=10.0, cx=9.5, cy=4.5)
    half = np.full(3, 0.5)
    places = {
        "ahead": (0.0, 0.0, 8.0),
        "right": (30.0, 0.0, 8.0),
        "left": (-30.0, 0.0, 8.0),
        "above": (0.0, -20.0, 8.0),
        "behind": (0.0, 0.0, -8.0),
        "around": (0.0, 0.0, 0.0),
        "beside": (3.0, 0.0, 0.0),
        "nowhere": (np.nan, np.nan, np.nan),
    }
    boxes = np.array([(np.array(m) - half, np.array(m) + half) for m in places.values()])
    held = camera_rectangles(boxes, camera, np.eye(4)).hold_pixels.tolist()
    assert dict(zip(places, held, strict=True)) == dict.fromkeys(places, False) | {
        "ahead": True,
        "around": True,
    }


def test_labels_are_the_same_with_and_without_hidden_parts(
    author, shoot, small_camera, ahead, monkeypatch
):
    write = author()
    rng = np.random.default_rng(2)
    for index, (across, up, far, size) in enumerate(rng.random((400, 4)).tolist()):
        y = 5.0 + 240.0 * far
        half = y * (0.02 + 0.08 * size)
        x, z = (across - 0.5) * 2.2 * y, (up - 0.5) * 0.8 * y
        low, high = (x - half, y, z - half), (x + half, 1.1 * y, z + half)
        write.box(f"/World/b{index}", low, high, label="building")
        write.kind(write.stage.GetPrimAtPath(f"/World/b{index}"), "component")
    frame, _ = shoot(write.stage, small_camera, ahead)
    monkeypatch.setattr(label_pass, "_BANDS", (np.inf,))
    whole, _ = shoot(write.stage, small_camera, ahead)
    assert len(np.unique(whole.scene_objects)) > 50
    np.testing.assert_array_equal(frame.scene_objects, whole.scene_objects)
    np.testing.assert_array_equal(frame.depth, whole.depth)
    np.testing.assert_array_equal(frame.radiance, whole.radiance)


@pytest.mark.parametrize("offset", [0.0, 0.3, 0.5, 0.8])
def test_a_slanted_edge_covers_its_share_of_the_pixels(author, shoot, small_camera, ahead, offset):
    """The mean over rows of a black square's edge, against its area in the image."""
    write = author()
    black = write.material("/World/black", colour=(0.0, 0.0, 0.0))
    white = write.material("/World/white", colour=(1.0, 1.0, 1.0))
    back = write.square("/World/back", 10.02, (-50, -50), (50, 50), label="building")
    write.bind(back.GetPrim(), white)
    side, lean = offset / 10, 0.5
    points = [(-50, 10, -6), (side - lean, 10, -6), (side + lean, 10, 6), (-50, 10, 6)]
    front = write.mesh("/World/front", points, [(0, 1, 2, 3)], label="pole")
    write.bind(front.GetPrim(), black)
    frame, _ = shoot(write.stage, small_camera, ahead)
    grey = frame.radiance.mean(axis=2)[30:70, 90:110]
    dark, bright = grey[:, 0].mean(), grey[:, -1].mean()
    covered = ((bright - grey) / (bright - dark)).sum(axis=1)
    rows = np.arange(30, 70)
    edge = 99.5 + 10 * side + (49.5 - rows) / 6 / 2 * 1.0 - 89.5
    assert np.abs(covered - edge).max() < 0.35
    assert (covered - edge).mean() == pytest.approx(0.0, abs=0.1)
    between = (grey - dark) / (bright - dark)
    assert ((between > 0.1) & (between < 0.9)).any(axis=1).mean() > 0.4
