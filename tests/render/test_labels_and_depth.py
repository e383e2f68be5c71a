"""Labels and depth against what the pinhole formula says."""

import numpy as np
import pytest
from PIL import Image
from pxr import Gf, UsdGeom, Vt

from envgen_usd.label_taxonomy import labels
from envgen_usd.render.frames.label_images import INSTANCE_FACTOR, LabelPainter
from envgen_usd.render.stage.stage_reader import read_scene


def _names(frame, scene_objects):
    return np.array([scene_object.label for scene_object in scene_objects])[frame.scene_objects]


def test_a_wall_at_a_known_distance_has_that_depth_everywhere(author, shoot, small_camera, ahead):
    write = author()
    write.square("/World/wall", 12.5, (-50, -50), (50, 50), label="building")
    frame, scene_objects = shoot(write.stage, small_camera, ahead)
    assert np.unique(_names(frame, scene_objects)).tolist() == ["building"]
    np.testing.assert_allclose(frame.depth, 12.5, rtol=1e-6)


@pytest.mark.parametrize("distance", [0.5, 900.0, 20000.0])
def test_depth_has_no_far_limit(author, shoot, small_camera, ahead, distance):
    write = author()
    reach = 2 * distance
    write.square("/World/wall", distance, (-reach, -reach), (reach, reach), label="building")
    frame, _ = shoot(write.stage, small_camera, ahead)
    np.testing.assert_allclose(frame.depth, distance, rtol=1e-6)


def test_ground_has_the_depth_of_a_plane(author, shoot, small_camera, ahead):
    write = author()
    far, low = 1e5, -1.5
    points = [(-far, -far, low), (far, -far, low), (far, far, low), (-far, far, low)]
    write.mesh("/World/ground", points, [(0, 1, 2, 3)], label="road")
    frame, scene_objects = shoot(write.stage, small_camera, ahead)
    rows = np.arange(small_camera.height)
    below = rows > small_camera.cy + 1
    expected = small_camera.fy * 1.5 / (rows[below] - small_camera.cy)
    np.testing.assert_allclose(frame.depth[below], expected[:, None].repeat(200, 1), rtol=2e-5)
    assert np.unique(_names(frame, scene_objects)[: int(small_camera.cy)]).tolist() == ["sky"]
    assert not frame.depth[: int(small_camera.cy)].any()


def test_a_square_covers_the_pixels_whose_centres_it_covers(author, shoot, small_camera, ahead):
    write = author()
    write.square("/World/sign", 10.0, (-1.23, 0.52), (2.37, 3.11), label="pole")
    frame, scene_objects = shoot(write.stage, small_camera, ahead)
    u = small_camera.cx + small_camera.fx * np.array([-1.23, 2.37]) / 10.0
    v = small_camera.cy - small_camera.fy * np.array([3.11, 0.52]) / 10.0
    columns, rows = np.arange(200), np.arange(100)
    inside = ((rows > v[0]) & (rows < v[1]))[:, None] & (columns > u[0]) & (columns < u[1])
    np.testing.assert_array_equal(_names(frame, scene_objects) == "pole", inside)


def test_the_nearer_surface_wins(author, shoot, small_camera, ahead):
    write = author()
    write.square("/World/far", 20.001, (-50, -50), (50, 50), label="building")
    write.square("/World/near", 20.0, (-50, -50), (0, 50), label="vegetation")
    frame, scene_objects = shoot(write.stage, small_camera, ahead)
    names = _names(frame, scene_objects)
    assert (names[:, :100] == "vegetation").all()
    assert (names[:, 100:] == "building").all()


def test_pixels_hold_classes_and_nothing_between_them(author, shoot, small_camera, ahead):
    write = author()
    rng = np.random.default_rng(3)
    names = [entry.name for entry in labels() if entry.name not in {"sky", "void"}]
    for index, (x, z, size) in enumerate(rng.uniform(-4, 4, (200, 3)).tolist()):
        half = 0.05 + abs(size) / 20
        low, high = (x - half, z - half), (x + half, z + half)
        label = names[index % len(names)]
        write.square(f"/World/s{index}", 5 + index / 100, low, high, label=label)
    frame, scene_objects = shoot(write.stage, small_camera, ahead)
    images = LabelPainter(scene_objects).paint(frame.scene_objects)
    ids = {entry.id: entry.colour for entry in labels()}
    assert set(np.unique(images.semantic).tolist()) <= set(ids)
    found = {tuple(c) for c in images.colour.reshape(-1, 3).tolist()}
    assert found == {ids[i] for i in np.unique(images.semantic).tolist()}
    np.testing.assert_array_equal(images.instance // INSTANCE_FACTOR, images.semantic)
    assert frame.depth[images.semantic == 23].max() == 0
    assert frame.depth[images.semantic != 23].min() >= 5


def test_a_leaf_is_cut_out_where_its_texture_is(author, shoot, small_camera, ahead, tmp_path):
    pixels = np.full((64, 64, 4), (0, 40, 0, 255), np.uint8)
    pixels[:, :32, 3] = 0
    Image.fromarray(pixels).save(tmp_path / "half.png")
    write = author(tmp_path / "leaf.usda")
    mesh = write.square("/World/leaf", 10.0, (-4, -4), (4, 4), label="vegetation")
    write.uvs(mesh, [(0, 0), (1, 0), (1, 1), (0, 1)])
    write.bind(mesh.GetPrim(), write.material("/World/m", texture="./half.png", cut=0.5))
    frame, scene_objects = shoot(write.stage, small_camera, ahead)
    names = _names(frame, scene_objects)
    assert (names[20:80, 61:98] == "sky").all()
    assert (names[20:80, 102:138] == "vegetation").all()
    green = frame.rgb[30:70, 105:135].mean(axis=(0, 1))
    sky = frame.rgb[30:70, 65:95].mean(axis=(0, 1))
    assert np.abs(green - sky).min() > 50


def test_back_faces_are_culled_unless_double_sided(author, shoot, small_camera, ahead):
    write = author()
    left = write.square("/World/left", 10.0, (-9, -2), (-1, 2), label="pole")
    right = write.square("/World/right", 10.0, (1, -2), (9, 2), label="pole")
    for mesh in (left, right):
        mesh.GetFaceVertexIndicesAttr().Set([3, 2, 1, 0])
    right.CreateDoubleSidedAttr(True)
    frame, scene_objects = shoot(write.stage, small_camera, ahead)
    names = _names(frame, scene_objects)
    assert (names[:, :100] == "sky").all()
    assert (names[:, 100:] == "pole").any()


@pytest.mark.parametrize("mirrored", [False, True])
def test_left_handed_meshes_and_mirrored_prims_show_their_front(
    author, shoot, small_camera, ahead, mirrored
):
    write = author()
    mesh = write.square("/World/sign", 10.0, (-3, -2), (3, 2), label="pole")
    if mirrored:
        UsdGeom.Xformable(mesh).AddScaleOp().Set(Gf.Vec3f(-1, 1, 1))
    else:
        mesh.GetFaceVertexIndicesAttr().Set([3, 2, 1, 0])
        mesh.CreateOrientationAttr(UsdGeom.Tokens.leftHanded)
    frame, scene_objects = shoot(write.stage, small_camera, ahead)
    assert (_names(frame, scene_objects) == "pole").sum() == 60 * 40


def test_concave_polygons_keep_their_shape(author, shoot, small_camera, ahead):
    write = author()
    corners = [(-3, -3), (3, -3), (3, 3), (1, 3), (1, -1), (-1, -1), (-1, 3), (-3, 3)]
    points = [(x, 10.0, z) for x, z in corners]
    write.mesh("/World/u", points, [tuple(range(8))], label="building")
    frame, scene_objects = shoot(write.stage, small_camera, ahead)
    built = _names(frame, scene_objects) == "building"
    assert built.sum() == 60 * 60 - 20 * 40
    assert not built[25:55, 92:108].any()


def test_subsets_have_labels_of_their_own(author, shoot, small_camera, ahead):
    write = author()
    points = [(-4, 10, -2), (0, 10, -2), (4, 10, -2), (4, 10, 2), (0, 10, 2), (-4, 10, 2)]
    mesh = write.mesh("/World/ground", points, [(0, 1, 4, 5), (1, 2, 3, 4)], label="terrain")
    subset = UsdGeom.Subset.CreateGeomSubset(mesh, "walk", "face", Vt.IntArray([1]))
    write.label(subset.GetPrim(), "sidewalk")
    frame, scene_objects = shoot(write.stage, small_camera, ahead)
    names = _names(frame, scene_objects)
    assert (names[35:65, 65:95] == "terrain").all()
    assert (names[35:65, 105:135] == "sidewalk").all()


@pytest.mark.parametrize("up", ["Y", "Z"])
def test_other_units_and_axes_are_brought_to_metres_and_z_up(
    author, shoot, small_camera, ahead, up
):
    write = author(metres=0.01, up=up)
    (x, y, z), size = (100.0, 1000.0, 50.0), 40.0
    corners = [
        (x - size, z - size),
        (x + size, z - size),
        (x + size, z + size),
        (x - size, z + size),
    ]
    points = [(a, y, b) if up == "Z" else (a, b, -y) for a, b in corners]
    write.mesh("/World/sign", points, [(0, 1, 2, 3)], label="pole")
    frame, scene_objects = shoot(write.stage, small_camera, ahead)
    rows, columns = np.nonzero(_names(frame, scene_objects) == "pole")
    assert columns.mean() == pytest.approx(99.5 + 10.0, abs=0.51)
    assert rows.mean() == pytest.approx(49.5 - 5.0, abs=0.51)
    np.testing.assert_allclose(frame.depth[rows, columns], 10.0, rtol=1e-5)


def test_what_has_no_label_is_void_and_hides_what_is_behind(author, shoot, small_camera, ahead):
    write = author()
    write.square("/World/thing", 5.0, (-50, -50), (50, 50))
    write.square("/World/house", 9.0, (-50, -50), (50, 50), label="building")
    frame, scene_objects = shoot(write.stage, small_camera, ahead)
    assert (_names(frame, scene_objects) == "void").all()


def test_far_from_the_origin_nothing_is_lost(author, shoot, small_camera, ahead):
    """UTM coordinates: the chunk's own transform is in double precision."""
    write = author()
    place = Gf.Vec3d(512345.0, 5412345.5, 321.25)
    UsdGeom.Xform.Define(write.stage, "/World/chunk").AddTranslateOp(
        UsdGeom.XformOp.PrecisionDouble
    ).Set(place)
    write.square("/World/chunk/sign", 10.0, (-1.0, -1.0), (1.0, 1.0), label="pole")
    ahead.matrix[:3, 3] = place
    frame, scene_objects = shoot(write.stage, small_camera, ahead)
    assert (_names(frame, scene_objects) == "pole").sum() == 20 * 20
    np.testing.assert_allclose(frame.depth[frame.depth > 0], 10.0, rtol=1e-5)


def test_neighbouring_tiles_leave_no_gap(author, shoot, small_camera, ahead):
    """A ground of many triangles, cut at the tiles' borders, seen from above and afar."""
    write = author()
    n = 60
    x, y = np.meshgrid(np.linspace(-300.1, 299.3, n), np.linspace(-300.7, 299.9, n))
    z = 3.0 * np.sin(x / 17.0) * np.cos(y / 23.0)
    points = np.stack((x.ravel(), y.ravel(), z.ravel()), axis=1)
    corner = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    faces = np.stack((corner, corner + 1, corner + n + 1, corner + n), axis=1)
    write.mesh("/World/ground", points, faces.tolist(), label="terrain")
    ahead.matrix[:3, :3] = np.array([[1, 0, 0], [0, -1, 0], [0, 0, -1]]).T
    for height in (40.0, 120.0):
        ahead.matrix[:3, 3] = (0.3, 0.7, height)
        frame, scene_objects = shoot(write.stage, small_camera, ahead)
        assert (_names(frame, scene_objects) == "terrain").all()


def test_guides_proxies_and_the_invisible_are_not_drawn(author, shoot, small_camera, ahead):
    write = author()
    for index, purpose in enumerate(("guide", "proxy")):
        mesh = write.square(f"/World/p{index}", 4.0, (-9, -9), (9, 9), label="road")
        mesh.CreatePurposeAttr(purpose)
    hidden = write.square("/World/hidden", 4.0, (-9, -9), (9, 9), label="road")
    UsdGeom.Imageable(hidden).MakeInvisible()
    off = write.square("/World/off", 4.0, (-9, -9), (9, 9), label="road")
    off.GetPrim().SetActive(False)
    write.square("/World/wall", 8.0, (-50, -50), (50, 50), label="building")
    frame, scene_objects = shoot(write.stage, small_camera, ahead)
    assert (_names(frame, scene_objects) == "building").all()


def test_odd_meshes_are_left_out_and_reported(author):
    write = author()
    write.square("/World/wall", 8.0, (-5, -5), (5, 5), label="tower")
    broken = write.square("/World/broken", 8.0, (-5, -5), (5, 5), label="building")
    broken.GetFaceVertexIndicesAttr().Set([0, 1, 2, 9])
    write.stage.DefinePrim("/World/patch", "NurbsPatch")
    scene = read_scene(write.stage)
    kinds = {issue.kind: issue.where for issue in scene.issues}
    assert kinds["stage.mesh"] == "/World/broken"
    assert kinds["stage.unsupported"] == "/World/patch"
    assert kinds["label.unknown"] == "/World/wall"
