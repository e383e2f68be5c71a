"""KITTI-360's boxes, read by kitti360Scripts and by py123d."""

import json
import shutil
from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from envgen_usd.datasets.dataset_index import read_index, write_index
from envgen_usd.datasets.formats.dataset_formats import write_formats
from envgen_usd.datasets.formats.kitti360.short_instances import (
    pixels_of,
    sequence_numbers,
    short_instances,
)
from envgen_usd.label_taxonomy import label, labels
from envgen_usd.render.frames.image_files import write_instances
from envgen_usd.render.lidar.scan_files import ROW

FACTOR = 10_000_000
FIRST = "2013_05_28_drive_0000_sync"
SEPARATE = {entry.id: entry.cityscapes for entry in labels() if entry.kitti_360_has_instances}


def corners(box):
    """Corners of a box by the words of docs/render.md, 8 x 3."""
    cos, sin = np.cos(box["yaw"]), np.sin(box["yaw"])
    length, width, height = box["size"]
    ahead, aside = np.array((cos, sin, 0)) * length, np.array((-sin, cos, 0)) * width
    up = np.array((0, 0, height))
    signs = product((-0.5, 0.5), repeat=3)
    return np.array([box["centre"] + a * ahead + b * aside + c * up for a, b, c in signs])


def same_corners(one, other):
    gaps = np.linalg.norm(np.array(one)[:, None] - np.array(other)[None], axis=2)
    return gaps.min(axis=0).max() < 1e-6 and gaps.min(axis=1).max() < 1e-6


def boxes_of(root, take, cameras):
    """Box, frames and value of each object of a take that KITTI-360 separates."""
    found = {}
    for camera in cameras:
        for path in sorted((root / take / camera / "boxes").glob("*.json")):
            for row in json.loads(path.read_text()):
                if row["instance"] // FACTOR in SEPARATE:
                    known = found.setdefault(row["instance"], (row["box_3d"], []))
                    known[1].append(int(path.stem))
    return found


def tables_of(folder, sequence):
    """Value on the stage by the value in 16 bits, over all frames of a sequence."""
    found = {}
    for path in (folder / "data_2d_semantics" / "train" / sequence).rglob("instance_table/*.json"):
        for short, value in json.loads(path.read_text()).items():
            assert found.setdefault(int(short), value) == value
    return found


def test_kitti360scripts_reads_the_boxes_of_what_the_images_show(written, read):
    folder, frames = written("kitti360")
    said = read("kitti360", folder / "two")["boxes"]
    take = frames[0].folder.rsplit("/", 1)[0]
    truth = boxes_of(folder.parent, take, ("left", "right"))
    table = tables_of(folder / "two", FIRST)
    assert len(said) == len(truth) == len(table) > 10
    for name, box in said.items():
        kind, number = map(int, name.split())
        expected, seen = truth[table[kind * 1000 + number]]
        assert box["name"] == SEPARATE[kind]
        assert box["frames"] == [min(seen), max(seen)]
        assert same_corners(box["vertices"], corners(expected))
        vertices = np.array(box["vertices"])
        sides = np.sort([np.linalg.norm(vertices[a] - vertices[b]) for a, b in box["sides"]])
        np.testing.assert_allclose(sides, np.sort(np.repeat(expected["size"], 4)), atol=1e-6)
        # The triangles enclose the box, and look outwards.
        volume = np.linalg.det(vertices[box["faces"]]).sum() / 6.0
        assert volume == pytest.approx(np.prod(expected["size"]), rel=1e-6)


def test_without_boxes_there_is_no_file_of_them(made_up):
    for path in made_up.rglob("boxes"):
        shutil.rmtree(path)
    write_formats(made_up, read_index(made_up), ["kitti360"])
    assert not list(made_up.rglob("data_3d_bboxes"))
    assert list(made_up.rglob("instanceDict.json"))


def test_objects_keep_their_number_over_a_sequence():
    """Three objects want the number 5 and are never seen together; 2003 is seen in more pixels."""
    pole = label("pole").id * FACTOR
    frames = [np.full((1, size), pole + n, np.uint32) for n, size in ((5, 1), (1004, 2), (2003, 3))]
    numbers = sequence_numbers([pixels_of(values) for values in frames])
    assert numbers == {pole + 5: 5, pole + 1004: 2, pole + 2003: 1}
    shown = [short_instances(values, numbers).image[0, 0] % 1000 for values in frames]
    assert shown == [5, 2, 1]


def test_objects_beyond_999_are_in_no_list(made_up):
    """Frame 0 shows the poles 1 to 999, and frame 1 two more, which have a number there alone."""
    frames = [each for each in read_index(made_up) if each.camera == "left"]
    pole = label("pole")
    for each in frames[:3]:
        values = np.full((40, 60), label("road").id * FACTOR, np.uint32)
        shown = {0: np.arange(1, 1000), 1: np.array([1000, 1001]), 2: np.array([7])}[each.frame]
        values.reshape(-1)[: len(shown)] = pole.id * FACTOR + shown
        write_instances(made_up / each.file("instance"), values)
    write_formats(made_up, frames, ["kitti360"])
    folder = made_up / "kitti360" / "two" / "data_2d_semantics" / "train" / FIRST
    table = json.loads((folder / "image_00/instance_table/0000000001.json").read_text())
    assert sorted(table.values()) == [pole.id * FACTOR + n for n in (1000, 1001)]
    listed = json.loads((folder / "instanceDict.json").read_text())
    assert len(listed) == 999
    assert listed[str(pole.id * 1000 + 7)] == ["0000000000.png", "0000000002.png"]
    assert not any("0000000001.png" in names for names in listed.values())


LENS = {"model": "mei", "xi": 1.5, "k1": 0.02, "k2": 0.3, "p1": 0.0, "p2": 0.0, "field": 180.0}
AROUND = {"left": "west", "right": "east"}
"""Perspective camera and the fisheye that stands in its place."""


@pytest.fixture
def recording(made_up):
    """A rig with KITTI-360's sensors; its scans show a box with many points and one with few."""
    frames = read_index(made_up)
    for each in frames:
        source = made_up / each.folder
        target = source.parent / AROUND[each.camera]
        if not target.is_dir():
            shutil.copytree(source, target)
            content = json.loads((target / "cameras.json").read_text())
            content["camera"]["lens"] = LENS
            (target / "cameras.json").write_text(json.dumps(content))
    wide = [
        replace(
            each,
            folder=f"{each.folder.rsplit('/', 1)[0]}/{AROUND[each.camera]}",
            camera=AROUND[each.camera],
        )
        for each in frames
    ]
    write_index(made_up, [*frames, *wide], ("train", "val"))
    return made_up


def aim(take, boxes):
    """Puts 60 points into the first box and 30 into the second, in each scan of a take."""
    record = json.loads((take / "velodyne" / "lidar.json").read_text())
    for row in record["frames"]:
        world = [
            corners(box).mean(axis=0) + shares @ (corners(box)[[4, 2, 1]] - corners(box)[0])
            for box, count in zip(boxes, (60, 30), strict=True)
            for shares in [np.random.default_rng(count).uniform(-0.4, 0.4, (count, 3))]
        ]
        pose = np.linalg.inv(row["lidar_to_world"])
        points = np.concatenate(world) @ pose[:3, :3].T + pose[:3, 3]
        rows = np.zeros(len(points), ROW)
        rows["x"], rows["y"], rows["z"] = points.T
        rows["intensity"] = 0.5
        np.save(take / "velodyne" / "points" / f"{row['frame']:06d}.npy", rows)


def test_py123d_reads_sensors_poses_and_the_boxes_with_points(recording, read):
    frames = read_index(recording)
    take = frames[0].folder.rsplit("/", 1)[0]
    truth = boxes_of(recording, take, ("left", "right", "west", "east"))
    signs = [v for v in sorted(truth) if v // FACTOR == label("traffic_sign").id]
    aim(recording / take, [truth[value][0] for value in signs[:2]])
    write_formats(recording, frames, ["kitti360"])
    folder = recording / "kitti360" / "two"
    said = read("py123d", folder)
    names = [f"2013_05_28_drive_{n:04d}_sync" for n in (0, 1, 3, 5)]
    assert sorted(said["logs"]) == sorted(said["maps"]) == names
    table = {value: short for short, value in tables_of(folder, FIRST).items()}
    rows = said["logs"][FIRST]
    assert [len(each) for each in said["logs"].values()] == [3] * 4
    for number, row in enumerate(rows):
        labelled = [path.split("/")[3:5] for path in row["cameras"] if "semantics" in path]
        kinds = ("instance", "semantic")
        assert sorted(labelled) == [[f"image_{n:02d}", kind] for n in (0, 1) for kind in kinds]
        pictures = {path: place for path, place in row["cameras"].items() if "raw" in path}
        places = {path.split("/")[2]: place for path, place in pictures.items()}
        assert sorted(places) == [f"image_{n:02d}" for n in range(4)]
        for name, camera in zip(sorted(places), ("left", "right", "west", "east"), strict=True):
            content = json.loads((recording / take / camera / "cameras.json").read_text())
            truth_ = content["frames"][number]["camera_to_world"]
            np.testing.assert_allclose(places[name], truth_, atol=1e-6)
        # 41 points make a box visible to py123d: it keeps the first sign and drops the second.
        boxes = {int(token): box for token, box in row["boxes"].items()}
        shown = truth[signs[0]]
        assert table[signs[0]] in boxes
        assert table[signs[1]] not in boxes
        assert boxes[table[signs[0]]]["label"] == "TRAFFIC_SIGN"
        assert same_corners(boxes[table[signs[0]]]["corners"], corners(shown[0]))
        # Points come in the frame of the IMU, x ahead and z up.
        points = np.array(row["points"]) @ np.array(row["imu"])[:3, :3].T
        points += np.array(row["imu"])[:3, 3]
        middle = corners(shown[0]).mean(axis=0)
        assert np.linalg.norm(points[:60] - middle, axis=1).max() < np.linalg.norm(shown[0]["size"])
        assert set(row["intensities"]) == {127}
    assert np.diff([row["time"] for row in rows]).tolist() == [100_000, 10_000_000]
