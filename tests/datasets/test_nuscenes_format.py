"""The layout of nuScenes, read by nuscenes-devkit."""

import json
from pathlib import Path

import numpy as np
import pytest
from tests.datasets.conftest import as_kitti

from envgen_usd.datasets.dataset_index import read_index
from envgen_usd.datasets.formats.dataset_formats import write_formats
from envgen_usd.datasets.formats.nuscenes.box_points import points_in_boxes
from envgen_usd.datasets.formats.nuscenes.nuscenes_sensors import lidar_channels
from envgen_usd.datasets.formats.nuscenes.nuscenes_tables import (
    CATEGORIES,
    category_of,
    visibility_token,
)
from envgen_usd.errors import EnvgenError
from envgen_usd.label_taxonomy import labels


@pytest.fixture
def said(written, read):
    """What the devkit says, the folder, and the frames by the file of their picture."""
    folder, frames = written("nuscenes")
    answer = read("nuscenes", folder)
    inodes = {(folder.parent / each.file("rgb")).stat().st_ino: each for each in frames}
    for row in answer["images"]:
        assert row["exists"]
    return answer, folder.parent, inodes


def _frame(row, inodes):
    return inodes[Path(row["path"]).stat().st_ino]


def test_the_devkit_places_cameras_where_they_are(said):
    answer, root, inodes = said
    assert len(answer["images"]) == len(inodes) == 24
    for row in answer["images"]:
        each = _frame(row, inodes)
        cameras = json.loads((root / each.folder / "cameras.json").read_text())
        matrix = np.array(cameras["frames"][each.frame]["camera_to_world"])
        matrix[:2, 3] -= row["origin"]
        np.testing.assert_allclose(row["camera_to_world"], matrix, atol=1e-9)
        assert row["intrinsics"] == [[50.0, 0.0, 29.5], [0.0, 51.0, 19.5], [0.0, 0.0, 1.0]]
        assert row["channel"] == f"CAM_{each.camera.upper()}"
        assert row["town"] == each.town


def test_the_devkit_gives_boxes_in_the_space_of_the_camera(said):
    answer, root, inodes = said
    corners = np.array(np.meshgrid(*[(-0.5, 0.5)] * 3)).reshape(3, -1).T
    for row in answer["images"]:
        each = _frame(row, inodes)
        matrix = np.array(row["camera_to_world"])
        take = each.folder.rsplit("/", 1)[0]
        truth = {}
        for camera in ("left", "right"):
            path = root / take / camera / "boxes" / f"{each.frame:06d}.json"
            truth |= {box["instance"]: box["box_3d"] for box in json.loads(path.read_text())}
        expected = []
        for box in truth.values():
            cos, sin = np.cos(box["yaw"]), np.sin(box["yaw"])
            turn = np.array([(cos, -sin, 0), (sin, cos, 0), (0, 0, 1)])
            placed = (corners * box["size"]) @ turn.T + box["centre"] - (*row["origin"], 0.0)
            expected.append((placed - matrix[:3, 3]) @ matrix[:3, :3])
        assert len(expected) == len(row["boxes"])
        for found in map(np.array, row["boxes"].values()):
            gaps = [np.linalg.norm(found[:, None] - e[None], axis=2).min(axis=1) for e in expected]
            assert min(gap.max() for gap in gaps) < 1e-4


def test_scenes_are_drives_of_a_split(said):
    """Each take has two routes: of two frames and of one."""
    answer, _, inodes = said
    assert list(answer["scenes"].values()) == [2, 1] * 4
    in_split = {name: set(scenes) for name, scenes in answer["splits"].items()}
    assert not in_split["train"] & in_split["val"]
    assert in_split["train"] | in_split["val"] == answer["scenes"].keys()
    for row in answer["images"]:
        each = _frame(row, inodes)
        assert row["scene"] in in_split[each.split]
        step = 750_000 if each.weather == "fog" else 500_000
        assert row["next"] == (row["timestamp"] + step if each.frame == 0 else "")


def test_tracks_are_the_objects_of_a_scene(said):
    answer, _, _ = said
    by_token = {row["token"]: row for row in answer["annotations"]}
    assert sorted(mark for track in answer["tracks"].values() for mark in track) == sorted(by_token)
    assert max(map(len, answer["tracks"].values())) == 2
    for track in answer["tracks"].values():
        rows = [by_token[mark] for mark in track]
        assert len({row["attribute"] for row in rows}) == 1
        assert len({row["volume"] for row in rows}) == 1  # the same box
        assert len({row["sample"] for row in rows}) == len(rows)
    kinds = {(row["attribute"], row["category"]) for row in by_token.values()}
    assert ("class.vegetation", "static.vegetation") in kinds
    assert ("class.building", "static.manmade") in kinds
    assert len({row["visibility"] for row in by_token.values()}) == 4


def test_the_map_is_the_road_of_the_stage(said):
    """The vehicle is at y = 5: roads reach to 8, sidewalks to 10, and the road begins at 2."""
    answer, _, _ = said
    for row in answer["images"]:
        assert row["origin"] == [-21.0, -31.0]
        assert row["on_road"]
        assert row["beside"] == [True, False, False]


def test_the_devkit_places_points_where_the_lidar_saw_them(said):
    answer, root, inodes = said
    images = {row["path"].split("__")[0].rsplit("/", 1)[1]: row for row in answer["images"]}
    assert len(answer["scans"]) == 12
    for row in answer["scans"]:
        assert row["channel"] == "LIDAR_TOP"
        take, _, time = Path(row["path"]).name.removesuffix(".pcd.bin").split("__")
        each = _frame(images[take], inodes)
        frames = {
            str(i["timestamp"]): _frame(i, inodes) for i in answer["images"] if take in i["path"]
        }
        number = frames[time].frame
        folder = root / Path(*Path(each.folder).parts[:3]) / "velodyne"
        rows = np.load(folder / "points" / f"{number:06d}.npy")
        pose = json.loads((folder / "lidar.json").read_text())["frames"][number]["lidar_to_world"]
        points = np.column_stack([rows[axis] for axis in "xyz"]).astype(float)
        world = points @ np.array(pose)[:3, :3].T + np.array(pose)[:3, 3]
        world[:, :2] -= images[take]["origin"]
        found = np.array(row["points"])
        np.testing.assert_allclose(found[:, :3], world, atol=1e-4)
        np.testing.assert_allclose(found[:, 3], np.round(255 * rows["intensity"]), atol=1e-3)
        names = {entry.id: category_of(entry.name) for entry in labels()}
        assert row["classes"] == [names[value] for value in rows["semantic"].tolist()]
        raw = np.fromfile(row["path"], "<f4").reshape(-1, 5)
        np.testing.assert_array_equal(raw[:, 4], 7 - rows["ring"])  # from the lowest


def test_the_devkit_counts_the_same_points_in_boxes(made_up, read):
    """The boxes of the first frame are moved and grown, so that they hold many points."""
    for path in made_up.rglob("boxes/*.json"):
        rows = json.loads(path.read_text())
        for row in rows:
            rng = np.random.default_rng(row["instance"])
            length, width, height = np.sort(rng.uniform(2.0, 40.0, 3))[::-1].tolist()
            box = {"centre": rng.uniform((-20, -20, -20), 20).tolist(), "yaw": row["box_3d"]["yaw"]}
            row["box_3d"] = box | {"size": [length, width, height]}
        path.write_text(json.dumps(rows))
    write_formats(made_up, read_index(made_up), ["nuscenes"])
    pairs = [row["lidar"] for row in read("nuscenes", made_up / "nuscenes")["annotations"]]
    assert all(ours == theirs for ours, theirs in pairs)
    assert len({ours for ours, _ in pairs}) > 20


def test_the_devkit_projects_points_where_the_camera_sees_them(said):
    answer, root, inodes = said
    each = _frame(answer["seen"], inodes)
    take = root / Path(*Path(each.folder).parts[:3]) / "velodyne"
    rows = np.load(take / "points" / f"{each.frame:06d}.npy")
    pose = json.loads((take / "lidar.json").read_text())["frames"][each.frame]["lidar_to_world"]
    points = np.column_stack([rows[axis] for axis in "xyz"]).astype(float)
    world = points @ np.array(pose)[:3, :3].T + np.array(pose)[:3, 3]
    cameras = json.loads((root / each.folder / "cameras.json").read_text())
    eye = np.array(cameras["frames"][each.frame]["camera_to_world"])
    local = (world - eye[:3, 3]) @ eye[:3, :3]
    pixels = local[:, :2] / local[:, 2:] * (50.0, 51.0) + (29.5, 19.5)
    seen = (local[:, 2] > 1.0) & (pixels > 1.0).all(axis=1) & (pixels < (59.0, 39.0)).all(axis=1)
    assert np.count_nonzero(seen) > 5
    np.testing.assert_allclose(answer["seen"]["pixels"], pixels[seen], atol=0.01)
    np.testing.assert_allclose(answer["seen"]["depths"], local[seen, 2], atol=1e-3)


def test_scans_in_files_of_kitti_give_the_same(made_up):
    """KITTI's files have no numbers of lasers; the elevations of the points tell them."""

    def scans():
        folders = (made_up / "nuscenes" / name for name in ("samples/LIDAR_TOP", "lidarseg"))
        return {
            path.relative_to(made_up): path.read_bytes()
            for folder in folders
            for path in sorted(folder.rglob("*.bin"))
        }

    write_formats(made_up, read_index(made_up), ["nuscenes"])
    whole = scans()
    as_kitti(made_up)
    write_formats(made_up, read_index(made_up), ["nuscenes"])
    assert len(whole) == 24
    assert scans() == whole


def test_a_point_on_a_side_is_in_the_box():
    """A box of 4 x 2 x 3 m whose length leads along y; the points are steps from its middle."""
    box = {"centre": [10.0, 20.0, 1.5], "size": [4.0, 2.0, 3.0], "yaw": np.pi / 2.0}
    inside = [(0, 0, 0), (0, 1.99, 0), (0.99, 0, 0), (0, 0, 1.5), (0, 0, -1.5), (-0.9, -1.9, 1.4)]
    outside = [(1.01, 0, 0), (0, 2.01, 0), (0, 0, 1.51), (1.9, 0.9, 0), (0, -2.01, 0)]
    points = np.array([*inside, *outside]) + box["centre"]
    far = {"centre": [500.0, 0.0, 0.0], "size": [1.0, 1.0, 1.0], "yaw": 0.0}
    assert points_in_boxes(points, [box, far]).tolist() == [len(inside), 0]
    turned = box | {"yaw": 0.0}
    assert points_in_boxes(points, [turned]).tolist() == [6]
    assert points_in_boxes(np.empty((0, 3)), [box]).tolist() == [0]


@pytest.mark.parametrize(
    ("names", "channels"),
    [
        (["velodyne"], ["LIDAR_TOP"]),
        (["front", "top"], ["LIDAR_FRONT", "LIDAR_TOP"]),
        (["LIDAR_TOP", "side"], ["LIDAR_TOP", "LIDAR_SIDE"]),
        (["left", "right"], ["LIDAR_TOP", "LIDAR_RIGHT"]),
        ([], []),
    ],
)
def test_one_lidar_has_the_channel_that_the_devkit_wants(names, channels):
    assert lidar_channels(names) == channels


def test_tokens_do_not_change_with_other_frames(made_up):
    write_formats(made_up, read_index(made_up), ["nuscenes"])
    table = made_up / "nuscenes" / "v1.0-trainval" / "sample_annotation.json"
    whole = {row["token"]: row for row in json.loads(table.read_text())}
    few = [each for each in read_index(made_up) if each.road == "b"]
    write_formats(made_up, few, ["nuscenes"])
    part = {row["token"]: row for row in json.loads(table.read_text())}
    assert part.keys() < whole.keys()
    assert all(whole[mark] == row for mark, row in part.items())
    assert all(len(mark) == 32 for mark in whole)


def test_all_classes_have_a_category_of_nuscenes():
    assert {category_of(entry.name) for entry in labels()} < set(CATEGORIES)
    assert [visibility_token(share) for share in (0.0, 0.39, 0.4, 0.6, 0.79, 0.8, 1.0)] == [
        *"1123344"
    ]


def test_what_is_missing_is_named(made_up):
    frames = read_index(made_up)
    (made_up / "towns" / frames[0].town / "stage.usda").unlink()
    with pytest.raises(EnvgenError, match=r"a_road_1_residential_0/stage.usda: is missing"):
        write_formats(made_up, frames, ["nuscenes"])
    for path in made_up.rglob("cameras.json"):
        content = json.loads(path.read_text())
        content["camera"]["lens"] = {"model": "mei"}
        path.write_text(json.dumps(content))
    with pytest.raises(EnvgenError, match="nuscenes: no rig has a camera without a lens model"):
        write_formats(made_up, frames, ["nuscenes"])
