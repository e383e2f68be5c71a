"""A small data set with made-up labels, and the readers of other people."""

import json
import os
import subprocess
from pathlib import Path

import numpy as np
import pytest
from tests.render.conftest import new_author

from envgen_usd.datasets.dataset_index import IndexedFrame, read_index, write_index
from envgen_usd.datasets.formats.dataset_formats import write_formats
from envgen_usd.label_taxonomy import label, labels
from envgen_usd.render.frames.image_files import write_instances, write_png
from envgen_usd.render.lidar.scan_files import ROW

FACTOR = 10_000_000
SIZE = (40, 60)
CAMERA = {"width": 60, "height": 40, "fx": 50.0, "fy": 51.0, "cx": 29.5, "cy": 19.5}
BACKGROUND = ("road", "sidewalk", "terrain", "sky", "fence", "wall")
ROOT = Path(__file__).resolve().parents[2]
HOMES = {"ultralytics": ".venv-ultralytics", "py123d": ".venv-py123d"}
"""Environments of readers that do not go with the others."""
OBJECTS = ("building", "vegetation", "pole", "traffic_sign", "static")


def _labels(seed):
    """Instance values of a frame: bands of classes, and objects that hide one another."""
    rng = np.random.default_rng(seed)
    height, width = SIZE
    values = np.zeros(SIZE, np.uint32)
    borders = np.sort(rng.choice(np.arange(1, height), len(BACKGROUND) - 1, replace=False))
    for name, rows in zip(BACKGROUND, np.split(np.arange(height), borders), strict=True):
        values[rows] = label(name).id * FACTOR
    for _ in range(25):
        name = OBJECTS[rng.integers(len(OBJECTS))]
        number = int(rng.choice((3, 17, 250, 999, 1002, 1016, 52_345)))
        top, left = rng.integers(height), rng.integers(width)
        high, wide = rng.integers(1, 18, 2)
        values[top : top + high, left : left + wide] = label(name).id * FACTOR + number
    values[0, :2] = 0  # void
    return values


def _boxes(values):
    """Records of `boxes`; an object has the same place in all frames."""
    names = {entry.id: entry.name for entry in labels()}
    rows = []
    for value, pixels in zip(*np.unique(values, return_counts=True), strict=True):
        if value % FACTOR:
            rng = np.random.default_rng(int(value))
            box = {
                "centre": rng.uniform((20, -10, 0), (60, 20, 8)).round(3).tolist(),
                "size": [*np.sort(rng.uniform(0.2, 6.0, 2))[::-1].round(3).tolist(), 3.0],
                "yaw": round(float(rng.uniform(-1.5, 1.5)), 5),
            }
            y, x = np.nonzero(values == value)
            visible = [int(v) for v in (x.min(), y.min(), x.max() + 1, y.max() + 1)]
            rows.append(
                {
                    "class": names[value // FACTOR],
                    "instance": int(value),
                    "pixels": int(pixels),
                    "visible": visible,
                    "full": [float(side) for side in visible],
                    "occlusion": round(float(rng.uniform(0.0, 0.99)), 4),
                    "box_3d": box,
                }
            )
    return rows


LIDAR = np.array([(0, 0, 1, 0.9), (0, 1, 0, 0.1), (-1, 0, 0, 1.8), (0, 0, 0, 1.0)])
"""Place of the lidar on the vehicle: it is tilted by 90 degrees."""
ELEVATIONS = [80.0, 70.0, 2.0, 0.0, -0.4, -0.7, -5.0, -24.0]
"""Elevations of its lasers, degrees; the cameras see the first two."""


def _scans(take, moves):
    """Scans of a lidar of 8 lasers, in .npy files: points of two poles, and others anywhere."""
    (take / "velodyne" / "points").mkdir(parents=True)
    (take / "velodyne" / "objects").mkdir()
    frames = []
    for number, move in enumerate(moves):
        rng = np.random.default_rng(number)
        rows = np.zeros(300, ROW)
        rows["intensity"], rows["ring"] = rng.integers(0, 256, 300) / 255, rng.integers(0, 8, 300)
        up, around = np.radians(ELEVATIONS)[rows["ring"]], rng.uniform(-np.pi, np.pi, 300)
        far = rng.uniform(2.0, 60.0, 300)
        rows["x"], rows["y"] = far * np.cos(up) * np.cos(around), far * np.cos(up) * np.sin(around)
        rows["z"] = far * np.sin(up)
        rows["semantic"] = [label(rng.choice(BACKGROUND)).id for _ in range(300)]
        rows["instance"] = rows["semantic"].astype(np.uint32) * FACTOR
        rows["semantic"][:40] = label("pole").id
        rows["instance"][:40] = label("pole").id * FACTOR + np.repeat((3, 250), 20)
        np.save(take / "velodyne" / "points" / f"{number:06d}.npy", rows)
        named = {str(label("pole").id * FACTOR + n): f"/World/pole_{n}" for n in (3, 250)}
        (take / "velodyne" / "objects" / f"{number:06d}.json").write_text(json.dumps(named))
        frames.append({"frame": number, "lidar_to_world": (move @ LIDAR).tolist()})
    record = {"name": "velodyne", "format": "npy", "model": {"elevations": ELEVATIONS}}
    record |= {"vehicle_from_lidar": LIDAR.tolist(), "frames": frames}
    (take / "velodyne" / "lidar.json").write_text(json.dumps(record))


def as_kitti(root):
    """Writes the scans of a data set as KITTI's files, by KITTI's and SemanticKITTI's words."""
    for path in root.rglob("lidar.json"):
        content = json.loads(path.read_text()) | {"format": "kitti"}
        path.write_text(json.dumps(content))
        (path.parent / "labels").mkdir()
        for scan in sorted(path.parent.rglob("*.npy")):
            rows = np.load(scan)
            values = np.column_stack([rows[name] for name in ("x", "y", "z", "intensity")])
            scan.with_suffix(".bin").write_bytes(values.astype("<f4").tobytes())
            words = ((rows["instance"] % FACTOR) << 16) | rows["semantic"]
            target = path.parent / "labels" / f"{scan.stem}.label"
            target.write_bytes(words.astype("<u4").tobytes())
            scan.unlink()


def _stage(path):
    """A road from (-5.35, 2) to (40, 8) and a sidewalk up to y = 10, on ground from -20.3."""
    path.parent.mkdir(parents=True)
    write = new_author(path)
    for name, low, high in (
        ("terrain", (-20.3, -30.7), (60, 2)),
        ("road", (-5.35, 2), (40, 8)),
        ("sidewalk", (-5.35, 8), (40, 10)),
    ):
        (x0, y0), (x1, y1) = low, high
        points = [(x0, y0, 0), (x1, y0, 0), (x1, y1, 0), (x0, y1, 0)]
        write.mesh(f"/World/{name}", points, [(0, 1, 2, 3)], label=name)
    write.stage.Save()


def _move(frame):
    """Pose of the vehicle."""
    turn, move = 0.4 * frame, np.eye(4)
    move[:2, :2] = [(np.cos(turn), -np.sin(turn)), (np.sin(turn), np.cos(turn))]
    move[:3, 3] = (10.0 * frame, 5.0, 0.5)
    return move


@pytest.fixture
def made_up(tmp_path):
    """Folder of a data set with two splits, two towns, and a rig of two cameras."""
    root, frames = tmp_path / "set", []
    for seed, (town, take) in enumerate(
        (t, w)
        for t in ("a_road_1_residential_0", "b_2_industrial_3")
        for w in ("clear_two", "fog_two")
    ):
        road, country, area, number = town.rsplit("_", 3)
        if take == "clear_two":
            _stage(root / "towns" / town / "stage.usda")
        moves = [_move(frame) for frame in range(3)]
        _scans(root / "frames" / town / take, moves)
        for camera, y in (("left", 0.3), ("right", -0.3)):
            folder = f"frames/{town}/{take}/{camera}"
            for kind in ("rgb", "semantic", "instance", "boxes"):
                (root / folder / kind).mkdir(parents=True)
            place = np.array([(0, 0, 1, 1.5), (-1, 0, 0, y), (0, -1, 0, 1.6), (0, 0, 0, 1.0)])
            rows = []
            for frame in range(3):
                values = _labels(10 * seed + frame + (5 if y < 0 else 0))
                write_instances(root / folder / "instance" / f"{frame:06d}.tif", values)
                text = json.dumps(_boxes(values))
                (root / folder / "boxes" / f"{frame:06d}.json").write_text(text)
                semantic = (values // FACTOR).astype(np.uint8)
                write_png(root / folder / "semantic" / f"{frame:06d}.png", semantic)
                rgb = np.random.default_rng(frame).integers(0, 255, (*SIZE, 3)).astype(np.uint8)
                write_png(root / folder / "rgb" / f"{frame:06d}.png", rgb)
                move = moves[frame]
                drive = {"frame": frame, "route": frame // 2}
                if take == "fog_two":
                    drive["time"] = 0.75 * (frame % 2)
                rows.append(drive | {"camera_to_world": (move @ place).tolist()})
                split = "val" if road == "b" else "train"
                weather = take.split("_")[0]
                shown = road, "1", country, area, int(number), weather, "two", camera
                eye = tuple((move @ place)[:3, 3].tolist())
                frames.append(IndexedFrame(split, folder, frame, *shown, eye))
            content = {"camera": CAMERA, "vehicle_from_camera": place.tolist(), "frames": rows}
            (root / folder / "cameras.json").write_text(json.dumps(content))
    write_index(root, frames, ("train", "val"))
    return root


@pytest.fixture
def written(made_up):
    """Writes a format; returns its folder and the frames."""

    def write(name):
        frames = read_index(made_up)
        write_formats(made_up, frames, [name])
        return made_up / name, frames

    return write


@pytest.fixture
def read():
    """Reads a format with the library of its makers."""

    def answer(name, folder):
        home = HOMES.get(name, ".venv-formats")
        python = Path(os.environ.get("ENVGEN_FORMATS", ROOT)) / home / "bin" / "python"
        if not python.is_file():
            pytest.skip("the readers of other people are not installed (make formats)")
        script = Path(__file__).with_name("format_readers.py")
        command = [str(python), str(script), name, str(folder)]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout.splitlines()[-1])

    return answer
