"""Images of a lens: objects land where its formulas project them, at their distance."""

from dataclasses import replace

import numpy as np
import pytest
from shapely import Polygon, box, contains_xy, distance
from shapely import points as to_points
from tests.render.test_camera_response import PLAIN

from envgen_usd.errors import EnvgenError
from envgen_usd.render.cameras.camera_response import camera_picture
from envgen_usd.render.cameras.camera_rig import Camera
from envgen_usd.render.cameras.lens_models import BrownConrady, KannalaBrandt, Mei
from envgen_usd.render.drawing.drawn_frame import FrameRequest
from envgen_usd.render.opengl.gl_context import open_context
from envgen_usd.render.opengl.scene_tiles import pack
from envgen_usd.render.stage.stage_reader import read_scene

BROWN = Camera(
    320,
    200,
    180.0,
    184.0,
    161.0,
    98.0,
    lens=BrownConrady("brown_conrady", -0.28, 0.07, 2e-4, -6e-4),
)
KANNALA = Camera(
    300, 280, 80.0, 81.0, 148.0, 141.0,
    lens=KannalaBrandt("kannala_brandt", 0.05, -0.012, 0.004, -0.001, field=190.0),
)  # fmt: skip
MEI = Camera(
    350, 350, 334.08, 333.95, 179.2, 176.4,
    lens=Mei("mei", 2.2134, 0.016798, 1.6549, 4.2224e-4, 4.2462e-4, field=185.0),
)  # fmt: skip
CAMERAS = pytest.mark.parametrize("camera", [BROWN, KANNALA, MEI], ids=lambda c: c.lens.model)


def opencv_pixels(camera, points):
    """Pixels of points in camera space, by the formulas in OpenCV's documentation."""
    lens, (x, y, z) = camera.lens, points.T
    if lens.model == "kannala_brandt":
        angle, r = np.arctan2(np.hypot(x, y), z), np.hypot(x, y)
        powers = lens.k1 * angle**2 + lens.k2 * angle**4 + lens.k3 * angle**6 + lens.k4 * angle**8
        x, y = angle * (1 + powers) * x / r, angle * (1 + powers) * y / r
    else:
        shift = lens.xi * np.sqrt(x**2 + y**2 + z**2) if lens.model == "mei" else 0.0
        x, y = x / (z + shift), y / (z + shift)
        r2 = x**2 + y**2
        radial = 1 + lens.k1 * r2 + lens.k2 * r2**2 + getattr(lens, "k3", 0.0) * r2**3
        x, y = (
            x * radial + 2 * lens.p1 * x * y + lens.p2 * (r2 + 2 * x**2),
            y * radial + lens.p1 * (r2 + 2 * y**2) + 2 * lens.p2 * x * y,
        )
    return np.column_stack((camera.fx * x + camera.cx, camera.fy * y + camera.cy))


def cards(camera):
    """Squares of different sizes all over the field, each across its direction: N x 4 x 3."""
    widest = 86.0 if camera.lens.has_ranges else 38.0
    squares = []
    for step, angle in enumerate(np.radians(np.linspace(3.0, widest, 9))):
        turn = 2.4 * step
        ahead = np.array(
            [np.sin(angle) * np.cos(turn), np.sin(angle) * np.sin(turn), np.cos(angle)]
        )
        right = np.cross(ahead, (0.3, 0.4, 0.87))
        right /= np.linalg.norm(right)
        down, away = np.cross(ahead, right), 5.0 + step
        half = 0.06 * away
        corners = ((-1, -1), (1, -1), (1, 1), (-1, 1))
        squares.append([away * ahead + half * (a * right + b * down) for a, b in corners])
    return np.array(squares)


@pytest.fixture
def lens_shot(opengl):
    """Draws a frame of a stage with a lens; also returns the mask of the image circle."""
    assert opengl

    def draw(stage, camera, pose):
        scene = read_scene(stage)
        with open_context():
            from envgen_usd.render.drawing.lens_drawing import frame_drawing  # noqa: PLC0415 - binds the platform

            drawing = frame_drawing(scene, pack(scene), camera)
            return drawing.draw(FrameRequest(pose)), scene, drawing.inside

    return draw


@pytest.fixture
def carded(author, ahead, lens_shot):
    """Cards before the camera, drawn; each card is a scene object."""

    def draw(camera):
        write = author()
        write.sun()
        squares = cards(camera)
        for index, square in enumerate(squares):
            world = square @ ahead.matrix[:3, :3].T
            mesh = write.mesh(f"/World/c{index}", world, [(0, 1, 2, 3)], label="building")
            mesh.CreateDoubleSidedAttr(True)
            write.kind(mesh.GetPrim(), "component")
        frame, scene, inside = lens_shot(write.stage, camera, ahead)
        paths = [scene_object.path for scene_object in scene.scene_objects]
        ids = [paths.index(f"/World/c{index}") for index in range(len(squares))]
        return frame, ids, squares, inside

    return draw


@CAMERAS
def test_cards_land_within_half_a_pixel_of_their_projection(camera, carded):
    frame, ids, squares, _ = carded(camera)
    columns, rows = np.meshgrid(np.arange(camera.width), np.arange(camera.height))
    for number, square in zip(ids, squares, strict=True):
        sides = zip(square, np.roll(square, -1, axis=0), strict=True)
        outline = np.concatenate([a + np.linspace(0, 1, 50)[:-1, None] * (b - a) for a, b in sides])
        image = box(-0.5, -0.5, camera.width - 0.5, camera.height - 0.5)
        polygon = Polygon(opencv_pixels(camera, outline)).intersection(image)
        drawn = frame.scene_objects == number
        assert drawn.sum() == pytest.approx(polygon.area, rel=0.08)
        wrong = drawn != contains_xy(polygon, columns, rows)
        off = distance(polygon.exterior, to_points(columns[wrong], rows[wrong]))
        assert off.max(initial=0.0) <= 0.5
        middle = columns[drawn].mean(), rows[drawn].mean()
        assert np.hypot(*np.subtract(middle, polygon.centroid.coords[0])) < 0.25


@CAMERAS
def test_depth_is_the_range_of_a_fisheye_and_along_the_axis_else(camera, carded):
    frame, ids, squares, _ = carded(camera)
    for number, square in zip(ids, squares, strict=True):
        rows, columns = np.nonzero(frame.scene_objects == number)
        places = (columns - camera.cx) / camera.fx, (rows - camera.cy) / camera.fy
        rays = camera.lens.directions(np.column_stack(places))
        middle = square.mean(axis=0)
        ranges = middle @ middle / (rays @ middle)
        expected = ranges if camera.lens.has_ranges else ranges * rays[:, 2]
        np.testing.assert_allclose(frame.depth[rows, columns], expected, rtol=0.003)


@CAMERAS
def test_outside_of_the_circle_is_void_and_black(camera, carded):
    frame, *_, inside = carded(camera)
    assert inside is not None
    outside = ~inside
    assert outside.any() == (camera.lens.model != "brown_conrady")
    assert (frame.scene_objects[outside] == 1).all()
    assert (frame.depth[outside] == 0).all()
    assert (frame.radiance[outside] == 0).all()
    assert (frame.radiance[inside].max(axis=-1) > 0).all()
    assert (frame.scene_objects[inside] != 1).all()


def test_a_bent_bar_is_straight_after_undistortion(author, ahead, lens_shot):
    write = author()
    write.sun()
    write.square("/World/bar", 10.0, (-7.0, 2.8), (7.0, 3.0), label="pole")
    frame, scene, _ = lens_shot(write.stage, BROWN, ahead)
    number = [scene_object.label for scene_object in scene.scene_objects].index("pole")
    columns = np.flatnonzero((frame.scene_objects == number).any(axis=0))
    assert len(columns) > 200
    bar = frame.scene_objects[:, columns] == number
    upper = np.argmax(bar, axis=0) - 0.5
    chord = np.polyval(np.polyfit(columns[[0, -1]], upper[[0, -1]], 1), columns)
    assert np.abs(upper - chord).max() > 4.0
    places = np.column_stack(((columns - BROWN.cx) / BROWN.fx, (upper - BROWN.cy) / BROWN.fy))
    _, y, z = BROWN.lens.directions(places).T
    rows = BROWN.fy * y / z
    np.testing.assert_allclose(rows, BROWN.fy * -0.3, atol=1.0)
    assert abs(rows.mean() - BROWN.fy * -0.3) < 0.2


def test_a_lens_without_distortion_is_a_pinhole(street, lens_shot, small_camera, ahead):
    from pxr import Usd  # noqa: PLC0415

    ahead.matrix[2, 3] = 1.5
    stage = Usd.Stage.Open(str(street))
    plain, *_ = lens_shot(stage, small_camera, ahead)
    lens, *_ = lens_shot(stage, replace(small_camera, lens=BrownConrady("brown_conrady")), ahead)
    same = lens.scene_objects == plain.scene_objects
    assert same.mean() > 0.98
    assert np.median(lens.depth[same] - plain.depth[same]) == pytest.approx(0.0, abs=1e-3)
    assert lens.radiance.mean() == pytest.approx(plain.radiance.mean(), rel=0.01)


@pytest.mark.parametrize(
    ("camera", "said"),
    [
        (Camera(64, 64, 5e3, 5e3, -2e4, 32.0, lens=KannalaBrandt("kannala_brandt")), "nothing"),
        (Camera(9000, 8, 9e3, 9e3, 4.5e3, 4.0, lens=BrownConrady("brown_conrady")), "8192"),
    ],
)
def test_a_lens_that_cannot_be_drawn_is_named(camera, said):
    from envgen_usd.render.cameras.lens_views import lens_views  # noqa: PLC0415

    with pytest.raises(EnvgenError, match=said):
        lens_views(camera)


def test_exposure_and_vignetting_of_a_fisheye_are_those_of_its_circle():
    rows, columns = np.mgrid[:120, :160]
    inside = np.hypot(rows - 60, columns - 70) < 40
    radiance = np.where(inside[..., None], np.float32(0.3), np.float32(0.0)) * np.ones(
        3, np.float32
    )
    settings = replace(PLAIN, vignetting=0.4)
    whole = camera_picture(radiance[55:65, 65:75], PLAIN, np.random.default_rng(0))
    circle = camera_picture(radiance, PLAIN, np.random.default_rng(0), inside)
    assert abs(int(circle[60, 70, 1]) - int(whole[5, 5, 1])) <= 1
    assert (circle[~inside] == 0).all()
    linear = (camera_picture(radiance, settings, np.random.default_rng(0), inside) / 255.0) ** 2.2
    assert linear[60, 109, 1] / linear[60, 70, 1] == pytest.approx(0.6, abs=0.04)
