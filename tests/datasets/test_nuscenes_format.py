"""The layout of nuScenes, read by nuscenes-devkit."""

import json
from pathlib import Path

import numpy as np
import pytest

from envgen_usd.datasets.dataset_formats import write_formats
from envgen_usd.datasets.dataset_index import read_index
from envgen_usd.datasets.nuscenes_tables import CATEGORIES, category_of, visibility_token
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
        assert row["channel"] == "LIDAR_VELODYNE"
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


def test_annotations_count_the_points_of_their_objects(said):
    """Two poles have 20 points each; all other objects have none."""
    answer, _, _ = said
    hit = [row for row in answer["annotations"] if row["lidar"]]
    assert {row["lidar"] for row in hit} == {20}
    assert {row["attribute"] for row in hit} == {"class.pole"}
    assert 0 < len(hit) <= 24


def test_scans_without_beams_are_refused(made_up):
    for path in made_up.rglob("lidar.json"):
        content = json.loads(path.read_text()) | {"format": "kitti"}
        path.write_text(json.dumps(content))
        for scan in sorted(path.parent.rglob("*.npy")):
            rows = np.load(scan)
            values = np.column_stack([rows[name] for name in ("x", "y", "z", "intensity")])
            scan.with_suffix(".bin").write_bytes(values.astype("<f4").tobytes())
            (path.parent / "labels").mkdir(exist_ok=True)
            words = ((rows["instance"] % 10_000_000) << 16) | rows["semantic"]
            target = path.parent / "labels" / f"{scan.stem}.label"
            target.write_bytes(words.astype("<u4").tobytes())
    with pytest.raises(EnvgenError, match=r'velodyne: nuscenes needs .*; set lidar_format = "npy"'):
        write_formats(made_up, read_index(made_up), ["nuscenes"])


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
