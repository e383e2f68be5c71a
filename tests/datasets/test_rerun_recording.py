"""Recordings for the Rerun viewer, read back by rerun's own reader of files."""

import json
import sys

import numpy as np
import pytest
from PIL import Image
from typer.testing import CliRunner

from envgen_usd.commands.command_line import app
from envgen_usd.datasets.dataset_index import read_index
from envgen_usd.label_taxonomy import label


def read_back(path):
    """Rows of the recording: (entity, number of the frame or None) to components by name."""
    chunk = pytest.importorskip("rerun.chunk")
    rows = {}
    for each in chunk.RrdReader(path).stream().to_chunks():
        batch = each.to_record_batch()
        wanted = [name for name in batch.schema.names if ":" in name or name == "frame"]
        columns = {name: batch.column(name).to_pylist() for name in wanted}
        for number in range(batch.num_rows):
            frame = None if each.is_static else columns["frame"][number]
            known = rows.setdefault((each.entity_path, frame), {})
            known |= {
                name.rpartition(":")[2]: values[number]
                for name, values in columns.items()
                if ":" in name and values[number] is not None
            }
    return rows


@pytest.fixture
def recorded(made_up, tmp_path):
    """The rows of a recording of the made-up data set, and its folder."""
    pytest.importorskip("rerun")
    path = tmp_path / "set.rrd"
    result = CliRunner().invoke(app, ["dataset", "convert", str(made_up), "--rerun", str(path)])
    assert result.exit_code == 0, result.output
    assert result.stdout.splitlines()[-1] == str(path)
    return read_back(path), made_up


def test_the_cameras_and_their_images_are_those_of_the_frames(recorded):
    rows, root = recorded
    moments = {}
    for each in read_index(root):
        moment = moments.setdefault((each.folder.rsplit("/", 1)[0], each.frame), len(moments))
        entity = f"/{each.town}/two/{each.camera}"
        place = rows[entity, moment]
        pose = json.loads((root / each.folder / "cameras.json").read_text())["frames"][each.frame]
        matrix = np.array(pose["camera_to_world"])
        np.testing.assert_allclose(place["translation"][0], matrix[:3, 3], atol=1e-5)
        turn = np.reshape(place["mat3x3"][0], (3, 3)).T
        np.testing.assert_allclose(turn, matrix[:3, :3], atol=1e-6)
        lens = np.reshape(place["image_from_camera"][0], (3, 3)).T
        np.testing.assert_allclose(lens, [(50, 0, 30), (0, 51, 20), (0, 0, 1)])
        content = bytes(rows[f"{entity}/rgb", moment]["blob"][0])
        assert content == (root / each.file("rgb")).read_bytes()
        shown = np.array(rows[f"{entity}/labels", moment]["buffer"][0], np.uint8)
        semantic = np.asarray(Image.open(root / each.file("semantic")))
        np.testing.assert_array_equal(shown.reshape(semantic.shape), semantic)
        boxes = json.loads((root / each.file("boxes")).read_text())
        found = rows[f"{entity}/visible", moment]
        assert found["class_ids"] == [label(row["class"]).id for row in boxes]
        middles = [[(b[0] + b[2]) / 2, (b[1] + b[3]) / 2] for b in (r["visible"] for r in boxes)]
        np.testing.assert_allclose(found["centers"], middles)
    assert len(moments) == 12


def test_the_boxes_of_all_cameras_are_in_the_world_once(recorded):
    rows, root = recorded
    frames = [each for each in read_index(root) if each.frame == 0][:2]
    truth = {}
    for each in frames:
        for row in json.loads((root / each.file("boxes")).read_text()):
            truth[row["instance"]] = row["box_3d"]
    found = rows[f"/{frames[0].town}/two/objects", 0]
    assert found["labels"] == [str(value) for value in sorted(truth)]
    for number, value in enumerate(sorted(truth)):
        box = truth[value]
        np.testing.assert_allclose(found["centers"][number], box["centre"], atol=1e-5)
        np.testing.assert_allclose(found["half_sizes"][number], np.array(box["size"]) / 2)
        x, y, z, w = found["quaternions"][number]
        assert (x, y) == (0.0, 0.0)
        assert 2 * np.arctan2(z, w) == pytest.approx(box["yaw"], abs=1e-6)


def test_the_points_of_lidars_are_in_the_colours_of_their_classes(recorded):
    rows, root = recorded
    each = read_index(root)[0]
    take = root / each.folder.rsplit("/", 1)[0] / "velodyne"
    for number in range(3):
        truth = np.load(take / "points" / f"{number:06d}.npy")
        found = rows[f"/{each.town}/two/velodyne", number]
        points = np.column_stack([truth[axis] for axis in "xyz"])
        np.testing.assert_allclose(found["positions"], points, atol=1e-6)
        assert found["class_ids"] == truth["semantic"].tolist()
        pose = json.loads((take / "lidar.json").read_text())["frames"][number]["lidar_to_world"]
        np.testing.assert_allclose(found["translation"][0], np.array(pose)[:3, 3], atol=1e-5)


def test_the_roads_of_each_town_are_in_the_world(recorded):
    rows, root = recorded
    for town in {each.town for each in read_index(root)}:
        areas = {}
        for name in ("road", "sidewalk"):
            mesh = rows[f"/{town}/roads/{name}", None]
            points = np.array(mesh["vertex_positions"])[np.array(mesh["triangle_indices"])]
            sides = points[:, 1:, :2] - points[:, :1, :2]
            areas[name] = np.abs(np.linalg.det(sides)).sum() / 2.0
        assert areas == pytest.approx({"road": 45.35 * 6.0, "sidewalk": 45.35 * 2.0}, rel=1e-5)
        assert (f"/{town}/roads/parking", None) not in rows


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--rerun", "gone/set.rrd"], "expected an .rrd file in a folder that exists"),
        (["--rerun", "set.mcap"], "expected an .rrd file"),
        ([], "name a layout, or a file with --rerun"),
    ],
)
def test_what_cannot_be_recorded_is_said_first(made_up, arguments, said):
    if arguments:
        pytest.importorskip("rerun")
    result = CliRunner().invoke(app, ["dataset", "convert", str(made_up), *arguments])
    assert said in str(result.exception)


def test_a_missing_package_is_named(made_up, monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "rerun", None)
    monkeypatch.setattr("importlib.util.find_spec", lambda _name: None)
    arguments = ["dataset", "convert", str(made_up), "coco", "--rerun", str(tmp_path / "a.rrd")]
    result = CliRunner().invoke(app, arguments)
    assert "pip install 'envgen-usd[rerun]'" in str(result.exception)
    assert not (made_up / "coco").exists()
