"""A small data set with made-up labels."""

import json

import numpy as np
import pytest

from envgen_usd.datasets.dataset_index import IndexedFrame, write_index
from envgen_usd.label_taxonomy import label
from envgen_usd.render.frames.image_files import write_instances, write_png

FACTOR = 10_000_000
SIZE = (40, 60)
CAMERA = {"width": 60, "height": 40, "fx": 50.0, "fy": 51.0, "cx": 29.5, "cy": 19.5}
BACKGROUND = ("road", "sidewalk", "terrain", "sky", "fence", "wall")
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
        for camera, y in (("left", 0.3), ("right", -0.3)):
            folder = f"frames/{town}/{take}/{camera}"
            for kind in ("rgb", "semantic", "instance"):
                (root / folder / kind).mkdir(parents=True)
            place = np.array([(0, 0, 1, 1.5), (-1, 0, 0, y), (0, -1, 0, 1.6), (0, 0, 0, 1.0)])
            rows = []
            for frame in range(3):
                values = _labels(10 * seed + frame + (5 if y < 0 else 0))
                write_instances(root / folder / "instance" / f"{frame:06d}.tif", values)
                semantic = (values // FACTOR).astype(np.uint8)
                write_png(root / folder / "semantic" / f"{frame:06d}.png", semantic)
                rgb = np.random.default_rng(frame).integers(0, 255, (*SIZE, 3)).astype(np.uint8)
                write_png(root / folder / "rgb" / f"{frame:06d}.png", rgb)
                turn, move = 0.4 * frame, np.eye(4)
                move[:2, :2] = [(np.cos(turn), -np.sin(turn)), (np.sin(turn), np.cos(turn))]
                move[:3, 3] = (10.0 * frame, 5.0, 0.5)
                rows.append({"frame": frame, "camera_to_world": (move @ place).tolist()})
                split = "val" if road == "b" else "train"
                weather = take.split("_")[0]
                shown = road, "1", country, area, int(number), weather, "two", camera
                frames.append(IndexedFrame(split, folder, frame, *shown, (0.0, 0.0, 0.0)))
            content = {"camera": CAMERA, "vehicle_from_camera": place.tolist(), "frames": rows}
            (root / folder / "cameras.json").write_text(json.dumps(content))
    write_index(root, frames, ("train", "val"))
    return root
