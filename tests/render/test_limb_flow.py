"""Flow within bodies whose poses replace each other, against closed forms."""

import numpy as np
import pytest
from pxr import UsdGeom

from envgen_usd.render.frames.frame_export import render_frames
from envgen_usd.render.frames.frame_set import read_frames

CAMERA = "width = 200\nheight = 100\nfx = 100.0\nfy = 100.0\ncx = 99.5\ncy = 49.5\n"
SPEED = 0.1
"""Metres to the right from a frame to the next; 1 pixel at a depth of 10 m."""
STILL = [(-2.0, 0.0), (0.0, 0.0), (2.0, 0.0), (-2.0, 1.0), (0.0, 1.0), (2.0, 1.0)]
BENT = [(-2.0, 0.0), (0.0, 0.0), (2.6, 0.4), (-2.0, 1.0), (0.0, 1.0), (2.6, 1.4)]
"""The same faces; the right side is 0.6 m further out and 0.4 m higher."""
HAT = [(-1.0, 10.0, 2.0), (1.0, 10.0, 2.0), (1.0, 10.0, 3.0), (-1.0, 10.0, 3.0)]
FACES = [(0, 1, 4, 3), (1, 2, 5, 4)]


@pytest.fixture(autouse=True)
def _own_cache(monkeypatch, tmp_path):
    monkeypatch.setenv("ENVGEN_USD_CACHE", str(tmp_path / "cache"))


def _sheet(write, name, outline, faces, shown):
    """A pose 10 m ahead, which is visible in one of both frames."""
    path = f"/World/Traffic/walker/{name}"
    pose = UsdGeom.Xform.Define(write.stage, path)
    write.mesh(f"{path}/Mesh", [(x, 10.0, z) for x, z in outline], faces, label="person")
    # A mesh that both poses share comes first among the meshes that are known by then.
    write.mesh(f"{path}/Hat", HAT, [(0, 1, 2, 3)], label="person")
    for code in (0, 1):
        pose.CreateVisibilityAttr().Set("inherited" if code == shown else "invisible", code)


def _frames(author, folder, outline, faces):
    """Two frames of a camera at rest; a walker goes to the right and changes its pose."""
    write = author(folder / "stage.usda")
    write.sun()
    walker = UsdGeom.Xform.Define(write.stage, "/World/Traffic/walker")
    write.kind(walker.GetPrim(), "component")
    place = walker.AddTranslateOp()
    for code in (0, 1):
        place.Set((SPEED * code, 0.0, 0.0), code)
    # The order on the stage is not that in time.
    _sheet(write, "second", outline, faces, 1)
    _sheet(write, "first", STILL, FACES, 0)
    root = write.stage.GetRootLayer()
    root.timeCodesPerSecond, root.startTimeCode, root.endTimeCode = 10.0, 0.0, 1.0
    write.stage.Save()
    (folder / "rig.toml").write_text(f"[camera]\n{CAMERA}")
    (folder / "p.csv").write_text("x,y,z,yaw,time\n0,0,0.5,90,0\n0,0,0.5,90,0.1\n")
    render_frames(
        folder / "stage.usda",
        folder / "f",
        rig=str(folder / "rig.toml"),
        trajectory=str(folder / "p.csv"),
        outputs=("flow", "semantic", "instance"),
    )
    return read_frames(folder / "f")


def _sheet_pixels(frame):
    """The sheet below the hat: 4 m x 1 m, 10 pixels a metre."""
    sheet = frame.instance == frame.instance[50, 99]
    sheet[:40] = False
    assert sheet.sum() == 400
    return sheet


def test_a_point_moves_to_its_place_in_the_next_pose(opengl, author, tmp_path):
    """The right half is stretched: a share x / 2 of (0.6, 0.4) m, 10 pixels a metre."""
    assert opengl
    first, second = _frames(author, tmp_path, BENT, FACES)
    person = _sheet_pixels(first)
    rows, columns = np.nonzero(person)
    x = (columns - 99.5) / 10.0
    share = np.clip(x / 2.0, 0.0, None)
    flow = first.flow[person]
    np.testing.assert_allclose(flow[:, 0], 1.0 + 6.0 * share, atol=1e-3)
    np.testing.assert_allclose(flow[:, 1], -4.0 * share, atol=1e-3)
    aim = np.round(np.column_stack((columns, rows)) + flow).astype(int)
    inner = np.abs(rows - 49.5) < 4.0
    assert (second.instance[aim[:, 1], aim[:, 0]] == first.instance[person])[inner].all()


def test_a_pose_with_other_faces_moves_as_a_whole(opengl, author, tmp_path):
    assert opengl
    first, _ = _frames(author, tmp_path, [*BENT, (3.0, 2.0)], [*FACES, (5, 2, 6)])
    person = _sheet_pixels(first)
    np.testing.assert_allclose(first.flow[person], [[1.0, 0.0]] * 400, atol=1e-3)


def test_wheels_below_a_pose_turn_on_below_the_next_one(opengl, author, tmp_path):
    """Two equal wheels, each with a body of its own in both poses, turn clockwise by 20 degrees."""
    assert opengl
    write = author(tmp_path / "stage.usda")
    write.sun()
    rider = UsdGeom.Xform.Define(write.stage, "/World/Traffic/rider")
    write.kind(rider.GetPrim(), "component")
    place = rider.AddTranslateOp()
    for code in (0, 1):
        place.Set((SPEED * code, 0.0, 0.0), code)
    square = [(-0.5, 0.0, -0.5), (0.5, 0.0, -0.5), (0.5, 0.0, 0.5), (-0.5, 0.0, 0.5)]
    centres = {"rear": -2.0, "front": 2.0}
    for shown, pose_name in enumerate(("first", "second")):
        path = f"/World/Traffic/rider/{pose_name}"
        pose = UsdGeom.Xform.Define(write.stage, path)
        for code in (0, 1):
            pose.CreateVisibilityAttr().Set("inherited" if code == shown else "invisible", code)
        for name, x in centres.items():
            write.mesh(f"{path}/{name}", square, [(0, 1, 2, 3)], label="bicycle")
            wheel = UsdGeom.Xformable(write.stage.GetPrimAtPath(f"{path}/{name}"))
            wheel.AddTranslateOp().Set((x, 10.0, 0.5))
            turn = wheel.AddRotateYOp()
            for code in (0, 1):
                turn.Set(20.0 * code, code)
    root = write.stage.GetRootLayer()
    root.timeCodesPerSecond, root.startTimeCode, root.endTimeCode = 10.0, 0.0, 1.0
    write.stage.Save()
    (tmp_path / "rig.toml").write_text(f"[camera]\n{CAMERA}")
    (tmp_path / "p.csv").write_text("x,y,z,yaw,time\n0,0,0.5,90,0\n0,0,0.5,90,0.1\n")
    render_frames(
        tmp_path / "stage.usda",
        tmp_path / "f",
        rig=str(tmp_path / "rig.toml"),
        trajectory=str(tmp_path / "p.csv"),
        outputs=("flow", "semantic", "instance"),
    )
    first, _ = read_frames(tmp_path / "f")
    angle = np.radians(20.0)
    for x in centres.values():
        middle = np.array([99.5 + 10.0 * x, 49.5])
        rows, columns = np.mgrid[46:54, int(middle[0]) - 3 : int(middle[0]) + 5]
        out = np.stack([columns, rows], axis=-1) - middle
        # Rows count downwards, so a turn about the axis ahead is clockwise in the image.
        turned = np.stack(
            [
                out[..., 0] * np.cos(angle) - out[..., 1] * np.sin(angle),
                out[..., 0] * np.sin(angle) + out[..., 1] * np.cos(angle),
            ],
            axis=-1,
        )
        flow = first.flow[rows, columns]
        np.testing.assert_allclose(flow, turned - out + [1.0, 0.0], atol=1e-3)
