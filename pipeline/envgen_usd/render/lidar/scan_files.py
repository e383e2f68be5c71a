"""Files of scans: KITTI's, NumPy's and LAS."""

from collections.abc import Mapping
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from envgen_usd.models.array_types import ByteArray, FloatArray
from envgen_usd.render.lidar.las_file import las_bytes
from envgen_usd.render.lidar.lidar_scan import LidarScan
from envgen_usd.whole_files import write_whole

KITTI, NPY, LAS = "kitti", "npy", "las"
SCAN_SUFFIXES: Mapping[str, Mapping[str, str]] = {
    KITTI: {"points": "bin", "labels": "label"},
    NPY: {"points": "npy"},
    LAS: {"points": "las"},
}
"""Folders and file suffixes of each format."""
ROW = np.dtype(
    [
        ("x", "<f4"),
        ("y", "<f4"),
        ("z", "<f4"),
        ("intensity", "<f4"),
        ("ring", "<u2"),
        ("column", "<u2"),
        ("time", "<f4"),
        ("semantic", "u1"),
        ("part", "u1"),
        ("instance", "<u4"),
    ]
)
"""Row of a point in .npy files."""
MOST_INSTANCES = 65535
"""Largest number of an instance in .label files, which have 16 bits for it."""


@dataclass(frozen=True)
class PointLabels:
    """Labels of the points of a scan.

    Attributes:
        semantic: N, class ids.
        part: N, part ids.
        instance: N, values as in instance images: class id * `factor` + n.
        factor: Factor of the class id in `instance`.
    """

    semantic: ByteArray
    part: ByteArray
    instance: NDArray[np.uint32]
    factor: int


def write_scan(
    files: Mapping[str, Path], kind: str, scan: LidarScan, labels: PointLabels, pose: FloatArray
) -> None:
    """Writes the files of a scan, each whole or not at all.

    Args:
        files: Path of each file, by the names in `SCAN_SUFFIXES`.
        kind: Name of the format.
        scan: Points.
        labels: Their labels.
        pose: 4 x 4, from the lidar's frame to the world; LAS holds the points in the world.

    Raises:
        EnvgenError: A file cannot be written.
    """
    if kind == KITTI:
        # Labels first: points without labels would look like a finished scan.
        write_whole(files["labels"], kitti_labels(labels).tobytes())
        rows = np.column_stack((scan.points, scan.intensities)).astype("<f4")
        write_whole(files["points"], rows.tobytes())
    elif kind == NPY:
        content = BytesIO()
        np.save(content, point_rows(scan, labels))
        write_whole(files["points"], content.getvalue())
    else:
        world = scan.points.astype(np.float64) @ pose[:3, :3].T + pose[:3, 3]
        write_whole(files["points"], las_bytes(world, point_rows(scan, labels)))


def kitti_labels(labels: PointLabels) -> NDArray[np.uint32]:
    """Values of .label files: the class id in the lower 16 bits, n of the instance in the upper.

    n is 0 for classes without instances, and for objects beyond `MOST_INSTANCES` of a class.
    """
    numbers = labels.instance % np.uint32(labels.factor)
    numbers = np.where(numbers > MOST_INSTANCES, np.uint32(0), numbers)
    values: NDArray[np.uint32] = (numbers << np.uint32(16)) | labels.semantic
    return values.astype("<u4")


def point_rows(scan: LidarScan, labels: PointLabels) -> NDArray[np.void]:
    """The points as rows of `ROW`."""
    rows = np.empty(len(scan.points), ROW)
    for axis, name in enumerate("xyz"):
        rows[name] = scan.points[:, axis]
    rows["intensity"] = scan.intensities
    rows["ring"], rows["column"], rows["time"] = scan.rings, scan.columns, scan.times
    rows["semantic"], rows["part"], rows["instance"] = (
        labels.semantic,
        labels.part,
        labels.instance,
    )
    return rows
