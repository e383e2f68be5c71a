"""What moves is where its time samples place it: images, boxes, flow and scans agree."""

import json
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux
from tests.render.conftest import counted_calls

import envgen_usd.render.stage.stage_scene as scene_module
from envgen_usd.datasets import read_scans
from envgen_usd.label_taxonomy import label
from envgen_usd.render.drawing.drawn_frame import FrameRequest
from envgen_usd.render.frames.frame_export import render_frames
from envgen_usd.render.frames.frame_set import read_frames
from envgen_usd.render.frames.scan_folder import LidarChoice
from envgen_usd.render.moving_parts import frozen_scene, lamps_at, overlapping
from envgen_usd.render.opengl.gl_context import open_context
from envgen_usd.render.opengl.scene_tiles import pack
from envgen_usd.render.render_scene import Moment
from envgen_usd.render.stage.stage_scene import StageScene
from envgen_usd.render.trajectories.trajectory import Trajectory

RATE = 10.0
CAMERA = "width = 352\nheight = 94\nfx = 138.0\nfy = 138.0\ncx = 170.0\ncy = 59.0\n"


@pytest.fixture(autouse=True)
def _own_cache(monkeypatch, tmp_path):
    monkeypatch.setenv("ENVGEN_USD_CACHE", str(tmp_path / "cache"))


def add_asset(author, path, half=0.5):
    """A cube above its origin, with a wheel before it, as a file that others reference."""
    asset = author(path)
    body = UsdGeom.Xform.Define(asset.stage, "/World/Body")
    asset.box("/World/Body/box", (-2 * half, -half, 0.0), (2 * half, half, 2 * half))
    wheel = UsdGeom.Xform.Define(asset.stage, "/World/Wheel")
    wheel.AddTranslateOp().Set(Gf.Vec3d(2 * half, 0.0, 0.0))
    asset.box("/World/Wheel/box", (-0.1, -0.1, 0.0), (0.1, 0.1, 0.2))
    assert body
    asset.stage.Save()


def add_traffic(author, folder, tracks, *, rate=RATE, label_name="car", wheels=False):
    """The layer `traffic.usda`: actors with a sample of place and heading at each time code.

    Args:
        author: Makes an `Author`.
        folder: Folder of the layer.
        tracks: Rows of (x, y, z, degrees) by name of the actor.
        rate: Time codes a second.
        label_name: Class of the actors.
        wheels: True if wheels turn.
    """
    add_asset(author, folder / "asset.usda")
    write = author(folder / "traffic.usda")
    write.stage.SetTimeCodesPerSecond(rate)
    write.stage.SetStartTimeCode(0.0)
    write.stage.SetEndTimeCode(max(len(rows) for rows in tracks.values()) - 1)
    for name, rows in tracks.items():
        actor = UsdGeom.Xform.Define(write.stage, f"/World/Traffic/{name}")
        actor.GetPrim().GetReferences().AddReference("./asset.usda")
        write.kind(actor.GetPrim(), "component")
        write.label(actor.GetPrim(), label_name)
        place, turn = actor.AddTranslateOp(), actor.AddRotateXYZOp()
        for code, (x, y, z, yaw) in enumerate(rows):
            place.Set(Gf.Vec3d(x, y, z), code)
            turn.Set(Gf.Vec3f(0.0, 0.0, yaw), code)
        if wheels:
            wheel = write.stage.OverridePrim(f"/World/Traffic/{name}/Wheel")
            spin = UsdGeom.Xformable(wheel).AddRotateXOp()
            for code in range(len(rows)):
                spin.Set(0.1 * code, code)
    write.stage.Save()
    return write


def on_stage(author, folder, still=None):
    """A stage over the traffic, with a road and a wall far behind."""
    write = author(folder / "stage.usda")
    write.sun()
    write.square("/World/Wall", 60.0, (-80.0, -10.0), (80.0, 40.0), label="building")
    write.mesh(
        "/World/Road",
        [(-40, -40, -2), (40, -40, -2), (40, 60, -2), (-40, 60, -2)],
        [(0, 1, 2, 3)],
        label="road",
    )
    if still:
        still(write)
    write.stage.GetRootLayer().subLayerPaths.append("./traffic.usda")
    write.stage.SetTimeCodesPerSecond(RATE)
    write.stage.Save()
    return folder / "stage.usda"


def draw(scene, camera, pose, moment):
    with open_context():
        from envgen_usd.render.drawing.render_passes import FrameRenderer  # noqa: PLC0415 - binds the platform

        renderer = FrameRenderer(scene, pack(scene), camera)
        return renderer.draw(FrameRequest(pose, moment=moment, normals=True))


def test_a_box_projects_to_the_pixels_of_its_time(opengl, author, small_camera, ahead, tmp_path):
    """A cube of 2 x 1 x 1 m, 10 m ahead, moves 2 m a second to the right, also between samples."""
    assert opengl
    add_traffic(author, tmp_path, {"a": [(-3.0 + 0.2 * k, 10.5, -0.5, 0.0) for k in range(31)]})
    stage = StageScene(on_stage(author, tmp_path))
    assert stage.moving is not None
    assert stage.moving.clock.duration == pytest.approx(3.0)
    car = [n for n, each in enumerate(stage.scene.scene_objects) if each.label == "car"]
    for seconds in (0.0, 0.5, 1.25, 3.0, 9.0):
        moment = stage.moving.at(seconds)
        frame = draw(stage.near(np.zeros((1, 3))), small_camera, ahead, moment)
        mask = np.isin(frame.scene_objects, car)
        rows, columns = np.nonzero(mask)
        x = -3.0 + 2.0 * min(seconds, 3.0)
        # Depth 10 at its face: 10 pixels a metre, from the middle 99.5; half a pixel of rounding.
        seen = columns[rows == 50]
        outer = seen.max() if x > 0.0 else seen.min()
        assert abs(outer - (99.5 + 10.0 * (x + np.sign(x)))) <= 1.0
        assert abs(rows.max() - (49.5 + 5.0)) <= 1.0
        face = (columns > 99.5 + 10.0 * (x - 0.9)) & (columns < 99.5 + 10.0 * (x + 0.9))
        np.testing.assert_allclose(frame.depth[mask][face], 10.0, atol=1e-4)
        np.testing.assert_allclose(frame.normals[mask][face], [[0, 0, -1]] * face.sum(), atol=1e-4)


def test_a_frame_equals_that_of_a_stage_where_nothing_moves(
    opengl, author, small_camera, ahead, tmp_path
):
    """Picture, labels, depth, shadows: as if the actors were static at their places."""
    assert opengl
    rows = [(0.5 * k - 2.0, 8.0, -1.0, 7.0 * k) for k in range(11)]
    tracks = {"a": rows, "b": [(x + 1.0, y + 4.0, z + 1.0, yaw) for x, y, z, yaw in rows]}
    add_traffic(author, tmp_path, tracks, wheels=True)
    moving = StageScene(on_stage(author, tmp_path))
    (tmp_path / "still").mkdir()
    at = {name: [track[6]] for name, track in tracks.items()}
    add_traffic(author, tmp_path / "still", at, wheels=False)
    still = StageScene(on_stage(author, tmp_path / "still"))
    assert still.moving is None
    here = np.zeros((1, 3))
    moment = replace(moving.moving.at(0.6), time=0.6)
    one = draw(moving.near(here), small_camera, ahead, moment)
    other = draw(still.near(here), small_camera, ahead, None)
    names = [
        [(each.label, each.path, each.number) for each in stage.scene.scene_objects]
        for stage in (moving, still)
    ]
    same = (
        np.array(names[0], object)[one.scene_objects]
        == np.array(names[1], object)[other.scene_objects]
    )
    assert same.all(axis=-1).mean() > 0.999
    assert {"car"} <= {names[0][n][0] for n in np.unique(one.scene_objects)}
    both = same.all(axis=-1)
    np.testing.assert_allclose(one.depth[both], other.depth[both], rtol=1e-4, atol=1e-3)
    apart = np.abs(one.rgb.astype(int) - other.rgb.astype(int)).max(axis=2)
    assert (apart <= 2).mean() > 0.995


def test_visibility_switches_and_hides(opengl, author, small_camera, ahead, tmp_path):
    """Of two phases of a walk, one is drawn; a hidden actor has neither pixels nor instance."""
    assert opengl
    write = author(tmp_path / "traffic.usda")
    write.stage.SetTimeCodesPerSecond(RATE)
    actor = UsdGeom.Xform.Define(write.stage, "/World/Traffic/p")
    write.kind(actor.GetPrim(), "component")
    write.label(actor.GetPrim(), "person")
    place = actor.AddTranslateOp()
    for code in (0, 10):
        place.Set(Gf.Vec3d(0.1 * code, 10.0, 0.0), code)
    for name, low, shown in (("one", -1.0, ("inherited", "invisible")), ("two", 1.0, None)):
        box = write.box(f"/World/Traffic/p/{name}", (low - 0.5, 0, -0.5), (low + 0.5, 1, 0.5))
        values = shown or ("invisible", "inherited")
        for code, value in zip((0, 5), values, strict=True):
            box.GetVisibilityAttr().Set(value, code)
    actor.GetVisibilityAttr().Set("inherited", 0)
    actor.GetVisibilityAttr().Set("invisible", 9)
    write.stage.Save()
    stage = StageScene(on_stage(author, tmp_path))
    scene = stage.near(np.zeros((1, 3)))
    person = [n for n, each in enumerate(scene.scene_objects) if each.label == "person"]
    assert len(person) == 1
    for seconds, middle in ((0.2, 0.2 - 1.0), (0.7, 0.7 + 1.0)):
        frame = draw(scene, small_camera, ahead, stage.moving.at(seconds))
        columns = np.nonzero(frame.scene_objects == person[0])[1]
        assert abs(columns.mean() - (99.5 + 10.0 * middle)) < 1.0
    frame = draw(scene, small_camera, ahead, stage.moving.at(0.95))
    assert not np.isin(frame.scene_objects, person).any()


def drive(author, folder, *, lidar="", wheels=True):
    """A street with three actors: one ahead, one that crosses, one that overtakes."""

    def lanes(write):
        write.lane("/World/Lanes/a", "a", [(0, -30, -2), (0, 55, -2)])

    tracks = {
        "lead": [(0.3, 0.5 * k, -2.0, 90.0) for k in range(41)],
        "cross": [(-6.0 + 0.4 * k, 14.0, -2.0, 3.0 * k) for k in range(41)],
        "fast": [(-3.0, -20.0 + 1.2 * k, -2.0, 90.0) for k in range(41)],
    }
    add_traffic(author, folder, tracks, wheels=wheels)
    rig = folder / "rig.toml"
    head = '[[camera]]\nname = "front"\nposition = [1.35, 0.0, 1.8]\n'
    rig.write_text(head + CAMERA + lidar)
    return on_stage(author, folder, lanes), str(rig), tracks


def test_flow_leads_moving_pixels_to_their_object(opengl, author, tmp_path):
    """99 % of the pixels that nothing hides in the next frame have its label there."""
    assert opengl
    stage, rig, _ = drive(author, tmp_path)
    outputs = ("flow", "depth", "instance", "semantic")
    way = Trajectory("drive", fps=RATE, speed=5.0)
    render_frames(stage, tmp_path / "f", 4, rig=rig, trajectory=way, outputs=outputs)
    frames = read_frames(tmp_path / "f")
    moved = hits = 0
    for first, second in pairwise(frames):
        rows, columns = np.indices(first.depth.shape)
        aim = np.stack((columns, rows), axis=-1) + first.flow
        x, y = np.round(aim).astype(int).transpose(2, 0, 1)
        car = first.semantic == label("car").id
        inside = (x >= 1) & (x < 351) & (y >= 1) & (y < 93)
        # Pixels at outlines are of both sides; a pixel within an object is of it.
        plain = car & inside
        for dy, dx in ((0, 1), (0, -1), (1, 0), (-1, 0)):
            plain &= np.roll(first.instance, (dy, dx), (0, 1)) == first.instance
        there = y[plain], x[plain]
        # What something nearer hides in the next frame is left out.
        free = second.depth[there] > first.depth[plain] - 3.0
        moved += free.sum()
        hits += (second.instance[there] == first.instance[plain])[free].sum()
        assert np.abs(first.flow[car & inside]).max() > 0.5
    assert moved > 300
    assert hits / moved > 0.99


def test_flow_of_a_crossing_box_is_its_speed(opengl, author, tmp_path):
    """The camera stands; a box 10 m ahead moves 2 m a second: 100 pixels / 10 m x 0.2 m."""
    assert opengl
    add_traffic(author, tmp_path, {"a": [(-3.0 + 0.2 * k, 10.5, -0.5, 0.0) for k in range(31)]})
    stage = on_stage(author, tmp_path)
    (tmp_path / "rig.toml").write_text(
        "[camera]\nwidth = 200\nheight = 100\nfx = 100.0\nfy = 100.0\ncx = 99.5\ncy = 49.5\n"
    )
    (tmp_path / "p.csv").write_text("x,y,z,yaw,time\n0,0,0,90,0.5\n0,0,0,90,0.6\n0,0,0,90,0.7\n")
    outputs = ("flow", "semantic", "depth", "boxes", "instance")
    render_frames(
        stage,
        tmp_path / "f",
        rig=str(tmp_path / "rig.toml"),
        trajectory=str(tmp_path / "p.csv"),
        outputs=outputs,
    )
    frames = read_frames(tmp_path / "f")
    face = (frames[0].semantic == label("car").id) & (np.abs(frames[0].depth - 10.0) < 1e-3)
    assert face.sum() > 100
    np.testing.assert_allclose(frames[0].flow[face][:, 0], 2.0, atol=1e-3)
    np.testing.assert_allclose(frames[0].flow[face][:, 1], 0.0, atol=1e-3)
    still = frames[0].semantic == label("building").id
    np.testing.assert_allclose(frames[0].flow[still], 0.0, atol=1e-3)
    for frame, x in zip(frames, (-2.0, -1.8, -1.6), strict=True):
        (row,) = [each for each in frame.boxes if each["class"] == "car"]
        # The box is 2 m long; the wheel reaches 0.1 m beyond its end.
        np.testing.assert_allclose(row["box_3d"]["size"], (2.1, 1.0, 1.0), atol=2e-3)
        np.testing.assert_allclose(row["box_3d"]["centre"], (x + 0.05, 10.5, 0.0), atol=2e-3)
        np.testing.assert_allclose(row["velocity"], (2.0, 0.0, 0.0), atol=2e-3)
        assert row["instance"] == frames[0].boxes[-1]["instance"]
    assert all("velocity" not in row for row in frames[0].boxes if row["class"] != "car")


def test_what_stands_at_the_end_of_its_time_has_no_velocity(opengl, author, tmp_path):
    """From -0.5 to 0 s and from 3 s on it stands; between, it has 2 m a second."""
    assert opengl
    add_traffic(author, tmp_path, {"a": [(-3.0 + 0.2 * k, 10.5, -0.5, 0.0) for k in range(31)]})
    stage = on_stage(author, tmp_path)
    (tmp_path / "rig.toml").write_text(
        "[camera]\nwidth = 200\nheight = 100\nfx = 50.0\nfy = 50.0\ncx = 99.5\ncy = 49.5\n"
    )
    speeds = {-0.5: 0.0, 0.0: 2.0, 1.55: 2.0, 3.0: 2.0, 3.04: 0.0, 7.0: 0.0}
    rows = "".join(f"0,0,0,90,{time}\n" for time in speeds)
    (tmp_path / "p.csv").write_text("x,y,z,yaw,time\n" + rows)
    render_frames(
        stage,
        tmp_path / "f",
        rig=str(tmp_path / "rig.toml"),
        trajectory=str(tmp_path / "p.csv"),
        outputs=("boxes",),
    )
    found = [
        row["velocity"][0]
        for frame in read_frames(tmp_path / "f")
        for row in frame.boxes
        if row["class"] == "car"
    ]
    np.testing.assert_allclose(found, [*speeds.values()], atol=2e-3)


def test_deactivated_traffic_is_not_drawn(opengl, author, tmp_path):
    """OpenUSD refuses to load what lies below a deactivated prim; that ended the command."""
    assert opengl
    add_traffic(author, tmp_path, {"a": [(0.1 * k, 0.0, 0.0, 0.0) for k in range(31)]})
    path = on_stage(author, tmp_path)
    assert StageScene(path).moving is not None
    over = Usd.Stage.CreateNew(str(tmp_path / "without.usda"))
    over.GetRootLayer().subLayerPaths.append(str(path))
    over.OverridePrim("/World/Traffic").SetActive(False)
    over.SetDefaultPrim(over.OverridePrim("/World"))
    over.Save()
    assert StageScene(tmp_path / "without.usda").moving is None


def test_boxes_look_ahead_and_instances_stay(opengl, author, tmp_path):
    assert opengl
    stage, rig, tracks = drive(author, tmp_path)
    outputs = ("boxes", "instance", "objects")
    way = Trajectory("drive", fps=RATE, speed=5.0)
    render_frames(stage, tmp_path / "f", 20, rig=rig, trajectory=way, outputs=outputs)
    frames = read_frames(tmp_path / "f")
    table = json.loads((tmp_path / "f" / "cameras.json").read_text())["frames"]
    numbers: dict[str, set[int]] = {}
    for frame, row in zip(frames, table, strict=True):
        assert frame.time == row["time"] == pytest.approx(0.1 * row["frame"], abs=1e-5)
        for box in frame.boxes:
            if box["class"] != "car":
                continue
            numbers.setdefault(box["path"], set()).add(box["instance"])
            name = box["path"].rsplit("/", 1)[1]
            x, y, _, degrees = tracks[name][row["frame"]]
            yaw = np.radians(degrees)
            assert np.cos(box["box_3d"]["yaw"] - yaw) > 1.0 - 1e-6
            np.testing.assert_allclose(box["box_3d"]["size"], (2.1, 1.0, 1.0), atol=5e-3)
            centre = np.array(box["box_3d"]["centre"][:2]) - (x, y)
            np.testing.assert_allclose(
                centre, 0.05 * np.array([np.cos(yaw), np.sin(yaw)]), atol=0.01
            )
    # The layer of the run plays in time with the traffic: frame 7 is at 0.7 s, time code 7.
    top = Usd.Stage.Open(str(tmp_path / "f" / "cameras.usda"))
    assert top.GetTimeCodesPerSecond() == RATE
    rig_at = UsdGeom.Xformable(top.GetPrimAtPath("/Rig")).ComputeLocalToWorldTransform(7.0)
    lead = UsdGeom.Xformable(top.GetPrimAtPath("/World/Traffic/lead"))
    place = lead.ComputeLocalToWorldTransform(7.0).ExtractTranslation()
    np.testing.assert_allclose(place, tracks["lead"][7][:3])
    seen = np.array(table[7]["camera_to_world"])[:2, 3] - rig_at.ExtractTranslation()[:2]
    np.testing.assert_allclose(np.hypot(*seen), 1.35, atol=1e-3)
    assert set(numbers) == {f"/World/Traffic/{name}" for name in ("lead", "cross", "fast")}
    assert all(len(each) == 1 for each in numbers.values())


EXACT = """name = "exact"
elevations = [4.0, 2.0, 1.0, 0.0, -1.0, -2.0, -3.0, -4.0, -5.0, -6.0, -8.0, -10.0]
columns = 1800
rate = 10.0
nearest = 0.1
range = 100.0
dim_range = 10000.0
"""


def test_scans_hit_what_moves_where_it_is(opengl, author, tmp_path):
    assert opengl
    (tmp_path / "exact.toml").write_text(EXACT)
    lidar = '[[lidar]]\nname = "roof"\nmodel = "exact.toml"\nposition = [1.35, 0.0, 1.8]\n'
    stage, rig, tracks = drive(author, tmp_path, lidar=lidar)
    way = Trajectory("drive", fps=2.0, speed=5.0)
    outputs = ("lidar", "instance", "objects")
    choice = LidarChoice("npy")
    render_frames(stage, tmp_path / "f", 5, rig=rig, trajectory=way, outputs=outputs, lidar=choice)
    scans = read_scans(tmp_path / "f" / "roof")
    seen = set()
    for number, scan in enumerate(scans):
        for value in np.unique(scan.instances[scan.classes == label("car").id]).tolist():
            path = scan.objects[value]
            name = path.rsplit("/", 1)[1]
            x, y, z, degrees = tracks[name][5 * number]
            yaw = np.radians(degrees)
            local = scan.world[scan.instances == value] - (x, y, z)
            along = local[:, 0] * np.cos(yaw) + local[:, 1] * np.sin(yaw)
            across = local[:, 1] * np.cos(yaw) - local[:, 0] * np.sin(yaw)
            assert along.min() >= -1.01
            assert along.max() <= 1.11
            assert np.abs(across).max() <= 0.51
            seen.add(name)
        # The wall behind is hit, too, but not through the actors.
        assert (scan.classes == label("building").id).sum() > 100
    assert seen == {"lead", "cross", "fast"}


def test_stills_have_drawn_times_and_fewer_are_a_prefix(opengl, author, tmp_path):
    assert opengl
    stage, rig, _ = drive(author, tmp_path)
    for count in (3, 6):
        render_frames(stage, tmp_path / str(count), count, rig=rig, outputs=("semantic",))
    few, more = (
        json.loads((tmp_path / str(count) / "cameras.json").read_text())["frames"]
        for count in (3, 6)
    )
    assert few == more[:3]
    times = [row["time"] for row in more]
    assert len(set(times)) == 6
    assert all(0.0 <= time <= 4.0 for time in times)
    # A file of these poses and times draws the same again.
    shown = str(tmp_path / "6" / "cameras.json")
    render_frames(stage, tmp_path / "again", rig=rig, trajectory=shown, outputs=("semantic",))
    for number in range(6):
        name = f"semantic/{number:06d}.png"
        assert (tmp_path / "6" / name).read_bytes() == (tmp_path / "again" / name).read_bytes()


def test_a_late_drive_and_the_own_vehicle_are_named(opengl, author, tmp_path):
    """The lead drives where the camera starts: it is hidden as long as it overlaps the vehicle."""
    assert opengl
    stage, rig, _ = drive(author, tmp_path)
    (tmp_path / "p.csv").write_text(
        "x,y,z,yaw,time\n0,1,-0.2,90,0\n0,-9,-0.2,90,0.1\n0,-9,-0.2,90,99\n"
    )
    outputs = ("semantic", "instance", "objects")
    result = render_frames(
        stage, tmp_path / "f", rig=rig, trajectory=str(tmp_path / "p.csv"), outputs=outputs
    )
    kinds = {issue.kind: issue for issue in result.issues}
    assert kinds["render.own_vehicle"].where == "/World/Traffic/lead"
    assert "1 frames are later than the 4 s" in kinds["render.time"].message
    first, second, third = (set(frame.objects.values()) for frame in read_frames(tmp_path / "f"))
    assert "/World/Traffic/lead" not in first
    assert {"/World/Traffic/lead", "/World/Traffic/cross"} <= second
    assert "/World/Traffic/fast" in third


def test_lamps_of_actors_move_and_turn_with_them(author, tmp_path):
    """A headlamp 2 m before the middle of an actor that turns by 90 degrees a second."""
    write = author(tmp_path / "traffic.usda")
    write.stage.SetTimeCodesPerSecond(RATE)
    actor = UsdGeom.Xform.Define(write.stage, "/World/Traffic/a")
    place, turn = actor.AddTranslateOp(), actor.AddRotateXYZOp()
    for code in (0, 10):
        place.Set(Gf.Vec3d(code, 0.0, 0.0), code)
        turn.Set(Gf.Vec3f(0.0, 0.0, 9.0 * code), code)
    actor.GetVisibilityAttr().Set("inherited", 0)
    actor.GetVisibilityAttr().Set("invisible", 20)
    lamp = UsdLux.DiskLight.Define(write.stage, "/World/Traffic/a/lamp")
    lamp.AddTranslateOp().Set(Gf.Vec3d(2.0, 0.0, 0.6))
    lamp.AddRotateYOp().Set(-90.0)  # its beam points along -z
    lamp.CreateIntensityAttr(100.0)
    write.stage.Save()
    stage = StageScene(on_stage(author, tmp_path))
    assert not len(stage.scene.lamps.places)
    for seconds, at, ahead in ((0.0, (2, 0), (1, 0)), (1.0, (10, 2), (0, 1))):
        lamps = lamps_at(stage.scene, stage.moving.at(seconds))
        np.testing.assert_allclose(lamps.places, [(*at, 0.6)], atol=1e-6)
        np.testing.assert_allclose(lamps.axes, [(*ahead, 0.0)], atol=1e-6)
    assert not len(lamps_at(stage.scene, stage.moving.at(2.0)).places)


def test_the_path_tracer_gets_the_actors_where_they_are(author, tmp_path):
    add_traffic(author, tmp_path, {"a": [(float(k), 20.0, 0.0, 90.0) for k in range(11)]})
    stage = StageScene(on_stage(author, tmp_path))
    scene = stage.near(np.zeros((1, 3)))
    still = frozen_scene(scene, stage.moving.at(0.55))
    assert still.moving is None
    label_of = [each.label for each in still.scene_objects]
    boxes = [
        still.geometries[use.geometry].boxes(use.matrices)
        for use in still.uses
        if label_of[use.scene_objects[0]] == "car"
    ]
    low, high = np.concatenate(boxes)[:, 0].min(axis=0), np.concatenate(boxes)[:, 1].max(axis=0)
    np.testing.assert_allclose(low, (5.0, 19.0, 0.0), atol=1e-5)
    np.testing.assert_allclose(high, (6.0, 21.1, 1.0), atol=1e-5)


def test_boxes_overlap_along_the_axes_of_both():
    """A turned box beside a corner touches in the frame of the one, but not in its own."""
    extents = np.array([[(-2.0, -0.5, 0.0), (2.0, 0.5, 1.0)]])
    box = np.array([(-1.0, -1.0, 0.0), (1.0, 1.0, 1.0)])
    for x, y, degrees, z, expected in (
        (0.0, 1.4, 0.0, 0.0, True),
        (0.0, 1.6, 0.0, 0.0, False),
        (1.6, 1.6, -45.0, 0.0, False),
        (1.2, 1.2, -45.0, 0.0, True),
        (0.0, 0.0, 0.0, 1.5, False),
    ):
        place = np.array(Gf.Matrix4d(Gf.Rotation(Gf.Vec3d(0, 0, 1), degrees), Gf.Vec3d(x, y, z))).T
        moment = Moment(0.0, place[None], np.ones(1, bool))
        assert bool(len(overlapping(extents, moment, np.eye(4), box))) == expected
        hidden = Moment(0.0, place[None], np.zeros(1, bool))
        assert not len(overlapping(extents, hidden, np.eye(4), box))


def test_the_cache_holds_what_stands_still(author, tmp_path):
    """A second run reads the town from the cache; instance numbers are the same."""

    def houses(write):
        house = UsdGeom.Xform.Define(write.stage, "/World/House").GetPrim()
        write.kind(house, "component")
        write.label(house, "car")
        write.box("/World/House/walls", (4, 20, 0), (6, 22, 1))

    add_traffic(author, tmp_path, {"a": [(0.0, float(k), 0.0, 0.0) for k in range(3)]})
    path = on_stage(author, tmp_path, houses)
    scenes = []
    for _ in range(2):
        opened = StageScene(path)
        scenes.append(opened.scene.scene_objects)
        assert "/World/Traffic/a" not in {
            each.path for each in opened._reading.summary.scene_objects
        }
        assert opened.near(np.zeros((1, 3))).moving is not None
        del opened
    assert scenes[0] == scenes[1]
    numbers = {each.path: each.number for each in scenes[0] if each.label == "car"}
    assert numbers == {"/World/House": 1, "/World/Traffic/a": 2}
    stored = list((tmp_path / "cache" / "stages").iterdir())
    assert len(stored) == 1
    # Other traffic changes nothing of the town; a prim that stands still in its layer does.
    add_traffic(author, tmp_path, {"b": [(0.0, float(k), 0.0, 0.0) for k in range(5)]})
    assert StageScene(path).moving.paths == ("/World/Traffic/b",)
    assert list((tmp_path / "cache" / "stages").iterdir()) == stored
    write = add_traffic(author, tmp_path, {"b": [(0.0, float(k), 0.0, 0.0) for k in range(5)]})
    write.box("/World/Kiosk", (4, 30, 0), (6, 32, 1), label="car")
    write.stage.Save()
    del write
    named = {each.path for each in StageScene(path).scene.scene_objects}
    assert {"/World/Kiosk", "/World/House", "/World/Traffic/b"} <= named
    assert len(list((tmp_path / "cache" / "stages").iterdir())) == 2


def moving_content(stage):
    """All that frames of moving actors follow from, as plain values."""
    scene, moving = stage.scene, stage.moving
    parts = moving.parts
    meshes = [
        {name: np.asarray(value).tolist() for name, value in vars(mesh).items()}
        for mesh in parts.geometries
    ]
    uses = [
        (use.geometry, use.matrices.tolist(), use.scene_objects.tolist(), use.level)
        for use in parts.uses
    ]
    tables = [array.tolist() for array in (*parts.bodies, *parts.layouts, parts.owners)]
    lamps = [array.tolist() for array in (*vars(parts.lamps).values(), parts.lamp_bodies)]
    places = [moving.at(t).matrices.tolist() for t in (0.0, 0.07)], moving.at(0.0).shown.tolist()
    looks = scene.materials, scene.scene_objects, scene.issues, stage.digests
    return meshes, uses, tables, lamps, places, looks, moving.paths


@pytest.fixture
def readings(monkeypatch):
    """Grows by an entry with each reading of moving actors."""
    return counted_calls(monkeypatch, scene_module, "read_moving")


def with_payloads(author, folder):
    """Two actors with wheels, whose meshes and lamp are in a payload."""
    write = add_traffic(
        author,
        folder,
        {name: [(x + k, 0.0, 0.0, 0.0) for k in range(3)] for name, x in (("a", 0.0), ("b", 9.0))},
        wheels=True,
    )
    for name in ("a", "b"):
        references = write.stage.GetPrimAtPath(f"/World/Traffic/{name}")
        references.GetReferences().ClearReferences()
        references.GetPayloads().AddPayload("./asset.usda")
    write.stage.Save()
    asset = Usd.Stage.Open(str(folder / "asset.usda"))
    lamp = UsdLux.DiskLight.Define(asset, "/World/Body/lamp")
    lamp.AddTranslateOp().Set(Gf.Vec3d(1.0, 0.0, 0.5))
    lamp.CreateIntensityAttr(100.0)
    asset.Save()


@pytest.mark.parametrize("change", ["nothing", "payload", "town", "track", "record", "arrays"])
def test_moving_actors_come_from_the_cache_unless_anything_changed(
    author, tmp_path, readings, change
):
    """What is stored is what is read; another payload, town or track is read anew."""
    with_payloads(author, tmp_path)
    path = on_stage(author, tmp_path)
    first = moving_content(StageScene(path))
    assert len(readings) == 1
    assert moving_content(StageScene(path)) == first
    assert len(readings) == 1
    if change == "payload":
        edit(tmp_path / "asset.usda", "100", "200")
    elif change == "town":
        edit(path, "building", "terrain")
    elif change == "track":
        edit(tmp_path / "traffic.usda", "(11, 0, 0)", "(15, 0, 0)")
    elif change != "nothing":
        (folder,) = (tmp_path / "cache" / "moving").iterdir()
        damaged = folder / ("scene.msgpack" if change == "record" else "arrays")
        content = damaged.read_bytes()
        damaged.unlink()
        damaged.write_bytes(content[: len(content) // 2])
    second = moving_content(StageScene(path))
    assert len(readings) == 1 + (change != "nothing")
    assert (second == first) == (change in ("nothing", "record", "arrays"))
    assert moving_content(StageScene(path, cache=False)) == second


def edit(path, old, new):
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))


def test_samples_that_are_not_drawn_are_named(author, tmp_path):
    add_traffic(author, tmp_path, {"a": [(0.0, float(k), 0.0, 0.0) for k in range(3)]})

    def melting(write):
        blob = write.square("/World/Blob", 20.0, (0, 0), (1, 1), label="terrain")
        points = blob.GetPointsAttr()
        for code in (0, 5):
            points.Set(
                [Gf.Vec3f(x, 20, z + code) for x, z in ((0, 0), (1, 0), (1, 1), (0, 1))], code
            )
        spin = UsdGeom.Xformable(write.stage.GetPrimAtPath("/World")).AddRotateZOp()
        spin.Set(0.0, 0)
        spin.Set(9.0, 5)

    stage = StageScene(on_stage(author, tmp_path, melting))
    named = {issue.where for issue in stage.scene.issues if issue.kind == "stage.time_samples"}
    assert named == {"/World", "/World/Blob"}


def test_a_layer_with_a_rate_of_its_own_is_in_seconds(author, tmp_path):
    """24 codes a second above, 10 in the layer: USD scales its samples, and the range follows."""
    add_traffic(author, tmp_path, {"a": [(0.0, float(k), 0.0, 0.0) for k in range(21)]})
    path = on_stage(author, tmp_path)
    root = Sdf.Layer.FindOrOpen(str(path))
    root.timeCodesPerSecond = 24.0
    root.Save()
    stage = StageScene(path)
    assert stage.moving.clock.duration == pytest.approx(2.0)
    for seconds in (0.0, 0.55, 2.0):
        assert stage.moving.at(seconds).matrices[0, 1, 3] == pytest.approx(10.0 * seconds)


def test_a_range_without_length_and_a_rate_of_nothing_stay_at_the_start(author, tmp_path):
    add_traffic(author, tmp_path, {"a": [(0.0, float(k), 0.0, 0.0) for k in range(3)]})
    path = on_stage(author, tmp_path)
    root = Sdf.Layer.FindOrOpen(str(path))
    root.timeCodesPerSecond, root.startTimeCode, root.endTimeCode = 0.0, 2.0, 1.0
    root.Save()
    stage = StageScene(path)
    assert stage.moving.clock.duration == 0.0
    assert np.isfinite(stage.moving.at(5.0).matrices).all()


def test_what_has_no_finite_place_is_hidden_then(author, tmp_path):
    write = add_traffic(author, tmp_path, {"a": [(0.0, float(k), 0.0, 0.0) for k in range(5)]})
    place = write.stage.GetPrimAtPath("/World/Traffic/a").GetAttribute("xformOp:translate")
    place.Set(Gf.Vec3d(0.0, float("nan"), 0.0), 2.0)
    write.stage.Save()
    stage = StageScene(on_stage(author, tmp_path))
    shown = [bool(stage.moving.at(seconds).shown.all()) for seconds in (0.1, 0.2, 0.3)]
    assert shown == [True, False, True]


def test_what_leaves_the_place_of_its_parent_hides_with_it(author, tmp_path):
    track = {"a": [(5.0, float(k), 0.0, 0.0) for k in range(5)]}
    write = add_traffic(author, tmp_path, track, wheels=True)
    actor, wheel = (f"/World/Traffic/a{below}" for below in ("", "/Wheel"))
    seen = UsdGeom.Imageable.Get(write.stage, actor).CreateVisibilityAttr()
    for code, token in ((0.0, "inherited"), (2.0, "invisible"), (3.0, "inherited")):
        seen.Set(token, code)
    UsdGeom.Xformable.Get(write.stage, wheel).SetResetXformStack(True)
    write.stage.Save()
    stage = StageScene(on_stage(author, tmp_path))
    moments = [stage.moving.at(seconds) for seconds in (0.1, 0.2, 0.3)]
    assert [moment.shown.tolist() for moment in moments] == [[True] * 2, [False] * 2, [True] * 2]
    for code, moment in enumerate(moments, 1):
        np.testing.assert_allclose(moment.matrices[0, :3, 3], (5.0, code, 0.0), atol=1e-6)
        np.testing.assert_allclose(moment.matrices[1, :2, 3], (1.0, 0.0), atol=1e-6)


def test_prims_of_any_layer_move(author, tmp_path):
    """An artist animates a prim anywhere below the world, and a reference brings its animation."""
    add_traffic(author, tmp_path, {"a": [(0.0, float(k), 0.0, 0.0) for k in range(3)]})
    crane = author(tmp_path / "crane.usda")
    arm = UsdGeom.Xform.Define(crane.stage, "/World/Arm")
    spin = arm.AddRotateZOp()
    for code in (0, 10):
        spin.Set(9.0 * code, code)
    crane.box("/World/Arm/beam", (0, 0, 5), (9, 1, 6), label="building")
    crane.stage.Save()

    def add(write):
        boat = UsdGeom.Xform.Define(write.stage, "/World/Harbour/Boat")
        lift = boat.AddTranslateOp()
        for code in (0, 10):
            lift.Set(Gf.Vec3d(0, 0, code), code)
        write.box("/World/Harbour/Boat/hull", (0, 0, 0), (1, 1, 1), label="building")
        there = UsdGeom.Xform.Define(write.stage, "/World/Crane")
        there.GetPrim().GetReferences().AddReference("./crane.usda")

    stage = StageScene(on_stage(author, tmp_path, add))
    assert set(stage.moving.paths) == {
        "/World/Crane/Arm",
        "/World/Harbour/Boat",
        "/World/Traffic/a",
    }


def test_a_stage_without_samples_has_nothing_that_moves(street):
    stage = StageScene(street)
    assert stage.moving is None
    assert stage.near(np.zeros((1, 3))).moving is None


def test_equal_actors_share_meshes_and_others_do_not(author, tmp_path):
    """Two actors of an asset share its meshes; an opinion below one of them is not lost."""
    rows = [(float(k), 0.0, 0.0, 0.0) for k in range(3)]
    write = add_traffic(author, tmp_path, {"a": rows, "b": rows, "c": rows}, wheels=True)
    other = write.stage.OverridePrim("/World/Traffic/c/Body/box")
    UsdGeom.Xformable(other).AddTranslateOp().Set(Gf.Vec3d(0.0, 0.0, 7.0))
    write.stage.Save()
    stage = StageScene(on_stage(author, tmp_path))
    parts = stage.moving.parts
    assert len(parts.geometries) == 2
    assert [len(use.matrices) for use in parts.uses] == [3, 3]
    owners = [{stage.scene.scene_objects[n].path for n in use.scene_objects} for use in parts.uses]
    assert owners == [{f"/World/Traffic/{name}" for name in "abc"}] * 2
    moment = stage.moving.at(0.1)
    heights = [
        moment.matrices[bodies] @ use.matrices
        for use, bodies in zip(parts.uses, parts.bodies, strict=True)
    ]
    assert sorted(heights[0][:, 2, 3].tolist()) == [0.0, 0.0, 7.0]
    # Each wheel turns by its own samples, before its own body.
    assert len(set(parts.bodies[1].tolist())) == 3
    np.testing.assert_allclose(heights[1][:, 0, 3], 2.0)
