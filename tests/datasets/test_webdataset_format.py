"""Shards of WebDataset, read by the package webdataset."""

import hashlib
import tarfile
from dataclasses import asdict

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
            assert {*row["kinds"]} == {*KINDS, "boxes.json", "json"}
            assert row["shape"] == [40, 60, 3]
            assert row["boxes"] > 0
            for kind, name in KINDS.items():
                stored = (folder.parent / each.file(name)).read_bytes()
                assert row["sha256"][kind] == hashlib.sha256(stored).hexdigest()
            table = asdict(each) | {"place": list(each.place)}
            assert table.items() <= row["json"].items()
            assert row["json"]["intrinsics"]["fx"] == 50.0


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
