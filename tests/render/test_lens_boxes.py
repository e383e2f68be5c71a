"""Boxes of objects behind a lens: against formulas, and against what is drawn."""

import numpy as np
import pytest
from tests.render.test_lens_images import BROWN, CAMERAS, KANNALA, opencv_pixels

from envgen_usd.render.cameras.camera_pose import Pose, look_at
from envgen_usd.render.frames.frame_export import render_frames
from envgen_usd.render.frames.frame_set import read_frames
from envgen_usd.render.frames.lens_outlines import Hull, hull_of, lens_box
from envgen_usd.render.render_scene import Geometry

AHEAD = Pose(look_at(np.zeros(3), np.array([0.0, 1.0, 0.0])))
CUBE = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], np.float64)
PAIRS = np.array([(a, b) for a in range(8) for b in range(a)])


def _rig(camera):
    """A rig file of a camera."""
    figures = ("width", "height", "fx", "fy", "cx", "cy")
    lines = [f"{name} = {getattr(camera, name)}" for name in figures]
    lens = [
        f'{name} = "{value}"' if isinstance(value, str) else f"{name} = {value}"
        for name, value in vars(camera.lens).items()
    ]
    return "\n".join(["[camera]", *lines, "[camera.lens]", *lens]) + "\n"


@pytest.fixture
def boxes(opengl, author, tmp_path):
    """Draws cuboids (by name: low and high corner) through a lens; returns boxes and images."""
    assert opengl

    def drawn(camera, cuboids, name="a"):
        stage = tmp_path / f"{name}.usda"
        write = author(stage)
        for key, (low, high) in cuboids.items():
            mesh = write.box(f"/World/{key}", low, high, label="building")
            write.kind(mesh.GetPrim(), "component")
        write.stage.Save()
        (tmp_path / "rig.toml").write_text(_rig(camera))
        outputs, rig = ("boxes", "instance"), str(tmp_path / "rig.toml")
        render_frames(stage, tmp_path / name, rig=rig, poses=[AHEAD], outputs=outputs)
        frame = read_frames(tmp_path / name)[0]
        return {row["path"].rsplit("/", 1)[1]: row for row in frame.boxes}, frame.instance

    return drawn


SPREAD = {
    "middle": ((-1, 9, -1), (2, 12, 1)),
    "left": ((-9, 10, -2), (-6, 13, 3)),
    "right": ((5, 9, -1), (7, 10, 0.5)),
    "below": ((-2, 8, -4), (3, 9, -2.5)),
    "above": ((-3, 14, 4), (4, 15, 5)),
}


@CAMERAS
def test_full_boxes_are_those_of_the_drawn_objects(boxes, camera):
    found, values = boxes(camera, SPREAD)
    assert found.keys() == SPREAD.keys()
    for row in found.values():
        y, x = np.nonzero(values == row["instance"])
        drawn = [x.min(), y.min(), x.max() + 1, y.max() + 1]
        assert row["visible"] == drawn
        assert row["pixels"] == len(y) > 100
        # A pixel's label is that of a sample at most half a pixel from its centre.
        assert row["full"] == pytest.approx(drawn, abs=1.01)
        assert (row["occlusion"], row["truncation"]) == (0.0, 0.0)


@CAMERAS
def test_full_boxes_hold_all_points_of_edges(camera):
    """Against 20,000 points on each edge, by the formulas of OpenCV."""
    rng = np.random.default_rng(4)
    share = np.linspace(0.0, 1.0, 20_000)[:, None]
    for _ in range(12):
        corners = CUBE * rng.uniform(0.2, 2.0, 3) + (*rng.uniform(-3, 3, 2), rng.uniform(7, 12))
        points = np.concatenate([corners[a] * (1 - share) + corners[b] * share for a, b in PAIRS])
        u, v = (opencv_pixels(camera, points) + 0.5).T
        space = Pose(np.eye(4))
        box, whole = lens_box(camera, space, [Hull(corners, PAIRS)])
        assert whole
        assert box == pytest.approx((u.min(), v.min(), u.max(), v.max()), abs=0.01)


@CAMERAS
def test_occlusion_counts_what_the_object_alone_would_show(boxes, camera):
    back = ((-2, 14, -2), (2, 15, 2))
    both, values = boxes(camera, {"back": back, "front": ((0, 8, -3), (2, 9, 3))}, "both")
    alone, whole = boxes(camera, {"back": back}, "alone")
    pixels = (whole == alone["back"]["instance"]).sum()
    shown = (values == both["back"]["instance"]).sum()
    assert 0.2 * pixels < shown < 0.8 * pixels
    assert both["back"]["occlusion"] == pytest.approx(1.0 - shown / pixels, abs=1e-4)
    assert both["front"]["occlusion"] == 0.0
    assert both["back"]["full"] == alone["back"]["full"]
    assert both["back"]["visible"] != alone["back"]["visible"]


def test_an_object_beyond_the_image_circle_ends_there(boxes):
    """The circle has 190 degrees: a wall on the left reaches from ahead to far behind."""
    found, values = boxes(KANNALA, {"wall": ((-4, -30, -1), (-3, 6, 1))})
    row = found["wall"]
    y, x = np.nonzero(values == row["instance"])
    drawn = [x.min(), y.min(), x.max() + 1, y.max() + 1]
    assert row["full"] == pytest.approx(drawn, abs=1.01)


def test_an_object_beyond_the_image_is_truncated(boxes):
    found, values = boxes(BROWN, {"wide": ((6, 9, -1), (12, 10, 1))})
    row = found["wide"]
    assert row["visible"][2] == 320 == np.nonzero(values == row["instance"])[1].max() + 1
    assert row["full"][2] > 330
    assert 0.0 < row["truncation"] < 1.0


@pytest.mark.parametrize("flat", [False, True])
def test_hulls_keep_the_extent_of_meshes(flat):
    rng = np.random.default_rng(3)
    points = rng.normal(size=(400, 3)) * (1, 2, 0 if flat else 3)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    points = points @ turn
    triangles = np.arange(399).reshape(-1, 3).astype(np.uint32)
    nothing = np.empty((0, 3), np.float32)
    mesh = Geometry(points, nothing, nothing, nothing, triangles, 0, double_sided=False)
    hull = hull_of(mesh)
    assert len(hull.corners) < 200
    for way in rng.normal(size=(50, 3)):
        used = points[:399] @ way
        shown = hull.corners @ way
        assert (shown.min(), shown.max()) == pytest.approx((used.min(), used.max()), abs=1e-9)
    ends = set(hull.edges.reshape(-1).tolist())
    assert ends == set(range(len(hull.corners)))


def test_the_hull_of_a_line_is_its_ends():
    points = np.linspace(0.0, 1.0, 60)[:, None] * (1.0, 2.0, 3.0)
    nothing = np.empty((0, 3), np.float32)
    triangles = np.arange(60).reshape(-1, 3).astype(np.uint32)
    hull = hull_of(Geometry(points, nothing, nothing, nothing, triangles, 0, double_sided=False))
    np.testing.assert_allclose(hull.corners, [(0, 0, 0), (1, 2, 3)])
    assert hull.edges.tolist() == [[0, 1]]
