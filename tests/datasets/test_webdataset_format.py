"""Shards of WebDataset, read by the package webdataset."""

import hashlib
import tarfile
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest

from envgen_usd.datasets.dataset_index import read_index
from envgen_usd.datasets.formats import webdataset_format
from envgen_usd.datasets.formats.dataset_formats import write_formats

KINDS = {"rgb.png": "rgb", "semantic.png": "semantic", "instance.tif": "instance"}


@pytest.fixture
def small_shards(monkeypatch):
    monkeypatch.setattr(webdataset_format, "SHARD", 5)


@pytest.mark.usefixtures("small_shards")
def test_webdataset_reads_all_frames_of_each_split(written, read):
    folder, frames = written("webdataset")
    said = read("webdataset", folder)
    assert len(list(folder.glob("train-*.tar"))) == 3
    for split in ("train", "val"):
        those = {(each.folder, each.frame): each for each in frames if each.split == split}
        rows = {(row["json"]["folder"], row["json"]["frame"]): row for row in said[split]}
        assert rows.keys() == those.keys()
        assert len({row["key"] for row in rows.values()}) == len(rows)
        for place, row in rows.items():
            each = those[place]
            assert {*row["kinds"]} - row["scan"].keys() == {*KINDS, "boxes.json", "json"}
            assert row["shape"] == [40, 60, 3]
            assert row["boxes"] > 0
            for kind, name in KINDS.items():
                stored = (folder.parent / each.file(name)).read_bytes()
                assert row["sha256"][kind] == hashlib.sha256(stored).hexdigest()
            table = asdict(each) | {"place": list(each.place)}
            assert table.items() <= row["json"].items()
            assert row["json"]["intrinsics"]["fx"] == 50.0


def test_webdataset_decodes_the_scans_of_the_first_camera(written, read):
    folder, frames = written("webdataset")
    said = read("webdataset", folder)
    cameras = {(each.folder, each.frame): each.camera for each in frames}
    for row in (row for rows in said.values() for row in rows):
        content = row["json"]
        if cameras[content["folder"], content["frame"]] == "right":
            assert not row["scan"]
            assert "lidars" not in content
            continue
        take = folder.parent / Path(content["folder"]).parent / "velodyne"
        truth = np.load(take / "points" / f"{content['frame']:06d}.npy")
        found = {kind: np.array(rows, name) for kind, (name, rows) in row["scan"].items()}
        axes = ("x", "y", "z", "intensity")
        points = np.column_stack([truth[axis] for axis in axes])
        np.testing.assert_array_equal(found.pop("velodyne.points.npy"), points)
        for name in ("semantic", "instance", "ring"):
            values = found.pop(f"velodyne.{name}.npy")
            assert values.dtype == truth[name].dtype
            np.testing.assert_array_equal(values, truth[name])
        assert not found
        # The lidar's place follows from the camera's, by the vehicle that both stand on.
        place = content["lidars"]["velodyne"]
        camera_from_lidar = np.linalg.inv(content["vehicle_from_camera"]) @ np.array(
            place["vehicle_from_lidar"]
        )
        np.testing.assert_allclose(
            content["camera_to_world"] @ camera_from_lidar, place["lidar_to_world"], atol=1e-9
        )


@pytest.mark.usefixtures("small_shards")
def test_neighbours_of_a_drive_are_in_different_places(written):
    folder, frames = written("webdataset")
    names = []
    for path in sorted(folder.glob("train-*.tar")):
        with tarfile.open(path) as archive:
            names += [name for name in archive.getnames() if name.endswith(".rgb.png")]
    assert len(names) == sum(each.split == "train" for each in frames)
    assert names != sorted(names)


@pytest.mark.usefixtures("small_shards")
def test_shards_follow_from_the_frames_alone(made_up):
    frames = read_index(made_up)

    def state():
        return {path.name: path.read_bytes() for path in (made_up / "webdataset").iterdir()}

    write_formats(made_up, frames, ["webdataset"])
    before = state()
    for path in made_up.rglob("*.png"):
        path.touch()
    write_formats(made_up, frames, ["webdataset"])
    assert state() == before
    # Shards that fewer frames do not have any more are removed.
    write_formats(made_up, frames[:4], ["webdataset"])
    assert sorted(state()) == ["train-000000.tar"]
