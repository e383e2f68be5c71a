"""What moves in the layouts of other data sets: a box for each frame, tracks, states."""

from xml.etree import ElementTree

import numpy as np
import pytest

from envgen_usd.datasets.formats.kitti360.kitti360_boxes import write_boxes
from envgen_usd.datasets.formats.nuscenes.nuscenes_tables import (
    CATEGORIES,
    attribute_tokens,
    category_of,
    fixed_tables,
)
from envgen_usd.label_taxonomy import labels

FACTOR = 10_000_000
CAR, POLE = 26 * FACTOR + 1, 17 * FACTOR + 4


def row(name, instance, centre, yaw=0.0, velocity=None):
    box = {"centre": centre, "size": (4.0, 2.0, 1.5), "yaw": yaw}
    moves = {} if velocity is None else {"velocity": velocity}
    return {"class": name, "instance": instance, "pixels": 9, "box_3d": box, **moves}


def test_a_moving_object_has_a_box_for_each_frame(tmp_path):
    """KITTI-360: timestamp -1 is static; else the box is that of the frame (annotation.py)."""
    frames = [
        (3, [row("car", CAR, (1.0, 2.0, 0.7), 0.0, (5.0, 0.0, 0.0)), row("pole", POLE, (9, 9, 1))]),
        (4, [row("car", CAR, (1.5, 2.0, 0.7), 0.1, (5.0, 0.0, 0.0)), row("pole", POLE, (9, 9, 1))]),
        (7, [row("car", CAR, (3.0, 2.0, 0.7), 0.4, (0.0, 0.0, 0.0))]),
    ]
    write_boxes(frames, {CAR: 1, POLE: 4}, "drive", tmp_path)
    root = ElementTree.parse(tmp_path / "data_3d_bboxes" / "train" / "drive.xml").getroot()
    said = [
        {key.tag: key.text for key in each if key.text and key.text.strip()}
        | {"matrix": np.fromstring(each.findtext("transform/data"), sep=" ").reshape(4, 4)}
        for each in root
    ]
    assert [int(each["index"]) for each in said] == [1, 2, 3, 4]
    pole = [each for each in said if each["label"] == "bigPole"]
    assert [(each["timestamp"], each["dynamic"]) for each in pole] == [("-1", "0")]
    cars = [each for each in said if each["label"] == "car"]
    assert [each["timestamp"] for each in cars] == ["3", "4", "7"]
    for each, (_, rows) in zip(cars, frames, strict=True):
        assert (each["dynamic"], each["instanceId"], each["semanticId"]) == ("1", "1", "13")
        assert (each["start_frame"], each["end_frame"]) == ("3", "7")
        box = rows[0]["box_3d"]
        np.testing.assert_allclose(each["matrix"][:3, 3], box["centre"])
        ahead = (4.0 * np.cos(box["yaw"]), 4.0 * np.sin(box["yaw"]), 0.0)
        np.testing.assert_allclose(each["matrix"][:3, 0], ahead, atol=1e-9)


@pytest.mark.parametrize(
    ("name", "velocity", "state"),
    [
        ("car", (3.0, 0.0, 0.0), "vehicle.moving"),
        ("car", (0.0, 0.1, 0.0), "vehicle.stopped"),
        ("car", None, "vehicle.parked"),
        ("bus", (0.0, -2.0, 0.0), "vehicle.moving"),
        ("person", (0.9, 0.9, 0.0), "pedestrian.moving"),
        ("person", None, "pedestrian.standing"),
        ("bicycle", (3.0, 0.0, 0.0), "cycle.with_rider"),
        ("motorcycle", None, "cycle.without_rider"),
        ("pole", None, None),
    ],
)
def test_nuscenes_has_our_class_and_its_own_state(name, velocity, state):
    named = {each["token"]: each["name"] for each in fixed_tables()["attribute"]}
    said = [named[token] for token in attribute_tokens(row(name, 1, (0, 0, 0), 0.0, velocity))]
    assert said == [f"class.{name}", *([state] if state else [])]


def test_road_users_have_categories_of_vehicles_and_people():
    kinds = {entry.name: category_of(entry.name) for entry in labels()}
    assert kinds["car"] == "vehicle.car"
    assert kinds["person"].startswith("human.pedestrian")
    assert kinds["building"] == "static.manmade"
    assert set(kinds.values()) <= set(CATEGORIES)
