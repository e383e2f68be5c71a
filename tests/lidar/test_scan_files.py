"""Scan files, read by NumPy and by laspy."""

import laspy
import numpy as np
import pytest

from envgen_usd.label_taxonomy import label
from envgen_usd.render.lidar.lidar_scan import LidarScan
from envgen_usd.render.lidar.scan_files import PointLabels, write_scan

FACTOR = 10_000_000
NAMES = ("road", "building", "vegetation", "pole", "terrain", "sidewalk", "bridge")
ASPRS = {"road": 11, "building": 6, "vegetation": 5, "pole": 1, "terrain": 2, "sidewalk": 2}


@pytest.fixture
def sample():
    """Points anywhere, each of its own figures."""
    rng, count = np.random.default_rng(3), 1000
    points = rng.uniform(-120.0, 120.0, (count, 3)).astype(np.float32)
    scan = LidarScan(
        points=points,
        intensities=(rng.integers(0, 256, count) / 255.0).astype(np.float32),
        rings=rng.integers(0, 128, count).astype(np.uint16),
        columns=rng.integers(0, 2048, count).astype(np.uint16),
        times=rng.uniform(-0.05, 0.05, count).astype(np.float32),
        scene_objects=np.zeros(count, np.uint32),
    )
    ids = np.array([label(name).id for name in NAMES], np.uint8)
    semantic = ids[rng.integers(0, len(ids), count)]
    numbers = rng.integers(0, 5000, count)
    labels = PointLabels(
        semantic=semantic,
        part=rng.integers(0, 200, count).astype(np.uint8),
        instance=(semantic.astype(np.int64) * FACTOR + numbers).astype(np.uint32),
        factor=FACTOR,
    )
    return scan, labels, numbers


def pose():
    angle = np.radians(33.0)
    matrix = np.eye(4)
    matrix[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    matrix[:3, 3] = 391_204.25, 5_820_117.5, 41.125
    return matrix


def test_kitti_files_are_four_floats_and_a_label(sample, tmp_path):
    """As the readers of KITTI and SemanticKITTI do: reshape(-1, 4), & 0xFFFF, >> 16."""
    scan, labels, numbers = sample
    files = {name: tmp_path / name for name in ("points", "labels")}
    write_scan(files, "kitti", scan, labels, pose())
    rows = np.fromfile(files["points"], dtype=np.float32).reshape(-1, 4)
    np.testing.assert_array_equal(rows[:, :3], scan.points)
    np.testing.assert_array_equal(rows[:, 3], scan.intensities)
    values = np.fromfile(files["labels"], dtype=np.uint32)
    np.testing.assert_array_equal(values & 0xFFFF, labels.semantic)
    np.testing.assert_array_equal(values >> 16, numbers)


def test_a_label_file_has_no_room_for_large_numbers(sample, tmp_path):
    scan, labels, _ = sample
    labels.instance[:3] = 26 * FACTOR + np.array([65_535, 65_536, 9_999_999])
    files = {name: tmp_path / name for name in ("points", "labels")}
    write_scan(files, "kitti", scan, labels, pose())
    assert (np.fromfile(files["labels"], np.uint32)[:3] >> 16).tolist() == [65_535, 0, 0]


def test_npy_files_hold_all_fields(sample, tmp_path):
    scan, labels, _ = sample
    write_scan({"points": tmp_path / "a.npy"}, "npy", scan, labels, pose())
    rows = np.load(tmp_path / "a.npy")
    for axis, name in enumerate("xyz"):
        np.testing.assert_array_equal(rows[name], scan.points[:, axis])
    expected = {
        "intensity": scan.intensities,
        "ring": scan.rings,
        "column": scan.columns,
        "time": scan.times,
        "semantic": labels.semantic,
        "part": labels.part,
        "instance": labels.instance,
    }
    assert set(rows.dtype.names) == set(expected) | set("xyz")
    for name, values in expected.items():
        np.testing.assert_array_equal(rows[name], values)


def test_las_files_are_read_by_laspy(sample, tmp_path):
    scan, labels, _ = sample
    write_scan({"points": tmp_path / "a.las"}, "las", scan, labels, pose())
    las = laspy.read(tmp_path / "a.las")
    assert (str(las.header.version), las.header.point_format.id) == ("1.4", 6)
    assert las.header.point_count == len(scan.points)
    world = scan.points.astype(np.float64) @ pose()[:3, :3].T + pose()[:3, 3]
    np.testing.assert_allclose(las.xyz, world, atol=0.0005 + 1e-6)
    np.testing.assert_allclose(las.header.mins, world.min(axis=0), atol=0.0006)
    np.testing.assert_allclose(las.header.maxs, world.max(axis=0), atol=0.0006)
    np.testing.assert_allclose(las.intensity / 65535.0, scan.intensities, atol=1e-5)
    np.testing.assert_allclose(las.gps_time, scan.times)
    np.testing.assert_array_equal(las.return_number, 1)
    np.testing.assert_array_equal(las.number_of_returns, 1)
    assert las.header.number_of_points_by_return[0] == len(scan.points)
    for name in ("semantic", "part", "instance"):
        np.testing.assert_array_equal(np.asarray(las[name]), getattr(labels, name))
    np.testing.assert_array_equal(np.asarray(las["ring"]), scan.rings)
    for name, code in ASPRS.items():
        those = labels.semantic == label(name).id
        assert set(np.asarray(las.classification)[those].tolist()) == {code}


@pytest.mark.parametrize("kind", ["kitti", "npy", "las"])
def test_a_scan_without_points_has_files(sample, tmp_path, kind):
    scan, labels, _ = sample
    none = LidarScan(**{name: values[:0] for name, values in vars(scan).items()})
    nothing = PointLabels(labels.semantic[:0], labels.part[:0], labels.instance[:0], FACTOR)
    files = {name: tmp_path / f"{name}.{kind}" for name in ("points", "labels")}
    write_scan(files, kind, none, nothing, pose())
    if kind == "las":
        assert laspy.read(files["points"]).header.point_count == 0
    elif kind == "npy":
        assert len(np.load(files["points"])) == 0
    else:
        assert files["points"].read_bytes() == files["labels"].read_bytes() == b""
