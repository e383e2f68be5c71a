"""Scans of a data set, read for a training."""

import json

import numpy as np
import pytest

from envgen_usd.datasets import read_scans
from envgen_usd.datasets.dataset_index import read_index
from envgen_usd.errors import EnvgenError
from envgen_usd.label_taxonomy import label


def test_the_scans_of_a_split_are_read_once_for_all_cameras(made_up):
    scans = read_scans(made_up, "train")
    frames = [each for each in read_index(made_up) if each.split == "train"]
    assert len(scans) == len({(each.weather, each.frame) for each in frames}) == 6
    assert len(read_scans(made_up)) == 12
    for scan in scans[1:4]:
        assert "a_road_1_residential_0" in scan.folder.parts
        rows = np.load(scan.folder / "points" / f"{scan.number:06d}.npy")
        np.testing.assert_array_equal(scan.points[:, :3], np.stack([rows[a] for a in "xyz"], 1))
        np.testing.assert_array_equal(scan.points[:, 3], rows["intensity"])
        pole = label("pole").id * 10_000_000
        assert scan.objects == {pole + 3: "/World/pole_3", pole + 250: "/World/pole_250"}
        assert np.count_nonzero(scan.instances == pole + 3) == 20
        pose = json.loads((scan.folder / "lidar.json").read_text())["frames"][scan.number]
        np.testing.assert_array_equal(scan.lidar_to_world, pose["lidar_to_world"])
        ahead = np.linalg.inv(scan.lidar_to_world)[:3]
        back = scan.world @ ahead[:, :3].T + ahead[:, 3]
        np.testing.assert_allclose(back, scan.points[:, :3], atol=1e-5)


def test_classes_have_the_ids_that_are_asked_for(made_up):
    plain, trained = (read_scans(made_up, ids=ids)[0] for ids in ("id", "cityscapes_train_id"))
    for name, train_id in (("road", 0), ("pole", 5), ("terrain", 9), ("sky", 10)):
        known = trained.classes[plain.classes == label(name).id]
        assert len(known)
        assert set(known.tolist()) == {train_id}  # labels.py of cityscapesScripts


def test_a_loader_of_pytorch_takes_them(made_up):
    data = pytest.importorskip("torch.utils.data")
    loader = data.DataLoader(read_scans(made_up, "val"), 4, collate_fn=list)
    assert [len(batch) for batch in loader] == [4, 2]


def test_what_holds_no_scans_is_named(made_up):
    with pytest.raises(EnvgenError, match="unknown split test; known: train, val"):
        read_scans(made_up, "test")
    with pytest.raises(EnvgenError, match="unknown ids train_id; known: "):
        read_scans(made_up, ids="train_id")
    folder = read_scans(made_up)[0].folder
    with pytest.raises(EnvgenError, match=r"only a data set \(index.jsonl\) has splits"):
        read_scans(folder, "train")
    (folder / "points" / "000001.npy").unlink()
    assert [scan.number for scan in read_scans(folder)] == [0, 2]
    (folder / "lidar.json").write_text("{")
    with pytest.raises(EnvgenError, match=r"lidar.json: cannot be read"):
        read_scans(folder)
    with pytest.raises(EnvgenError, match=r"holds neither lidar.json nor index.jsonl"):
        read_scans(made_up / "towns")
    for path in list(made_up.rglob("lidar.json")):
        path.unlink()
    with pytest.raises(EnvgenError, match="holds no scans; add lidar to the outputs"):
        read_scans(made_up)
