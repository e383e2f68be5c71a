"""KITTI-360's fisheyes and Velodyne: pictures, scans and calibrations."""

from collections.abc import Iterable, Mapping, Sequence
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np

from envgen_usd.datasets.frame_files import FrameFiles, link_file
from envgen_usd.datasets.frame_scans import lidars_of
from envgen_usd.models.array_types import FloatArray
from envgen_usd.render.lidar.scan_files import KITTI
from envgen_usd.whole_files import make_folder, write_whole

_FISHEYES = (2, 3)
"""Numbers of the fisheyes."""
_VELODYNE = "velodyne_points"
_BEGIN = np.datetime64("2013-05-28T08:00:00", "ns")
"""Time of the first scan of a sequence; the names of KITTI-360's sequences have this day."""
_BETWEEN_DRIVES = 10.0
"""Seconds from the last frame of a drive to the first of the next."""
_TURN = 0.1
"""Seconds between frames without times: a turn of KITTI-360's Velodyne."""
_OPENCV = "%YAML:1.0\n---\n"


def fisheyes(frames: Sequence[FrameFiles]) -> dict[str, int]:
    """Number of each camera with the lens of a fisheye of KITTI-360; others have no place."""
    first = {each.frame.camera: each for each in reversed(frames)}
    names = dict.fromkeys(each.frame.camera for each in frames)
    those = [name for name in names if _lens(first[name]).get("model") == "mei"]
    return dict(zip(those, _FISHEYES, strict=False))


def write_fisheye(each: FrameFiles, sequence: str, number: int, root: Path) -> None:
    """Links a picture of a fisheye; KITTI-360 has no labels of them."""
    folder = root / "data_2d_raw" / sequence / f"image_{number:02d}" / "data_rgb"
    link_file(each.rgb, folder / f"{each.frame.frame:010d}.png")


def write_fisheye_calibration(each: FrameFiles, number: int, root: Path) -> None:
    """Writes ``image_02.yaml`` or ``image_03.yaml`` as OpenCV's files are."""
    camera, lens = each.cameras["camera"], _lens(each)
    tables = {
        "mirror_parameters": {"xi": lens["xi"]},
        "distortion_parameters": {key: lens.get(key, 0.0) for key in ("k1", "k2", "p1", "p2")},
        "projection_parameters": {
            "gamma1": camera["fx"],
            "gamma2": camera["fy"],
            "u0": camera["cx"],
            "v0": camera["cy"],
        },
    }
    lines = ["model_type: MEI", f"camera_name: image_{number:02d}"]
    lines += [f"image_width: {camera['width']}", f"image_height: {camera['height']}"]
    for name, figures in tables.items():
        lines.append(f"{name}:")
        lines += [f"   {key}: {float(value)!r}" for key, value in figures.items()]
    make_folder(root / "calibration")
    text = _OPENCV + "\n".join(lines) + "\n"
    write_whole(root / "calibration" / f"image_{number:02d}.yaml", text)


def write_velodyne(each: FrameFiles, sequence: str, root: Path) -> None:
    """Writes the scan of a take's first lidar, if it has one, in the lidar's frame.

    A .bin file of KITTI gets a second name, as pictures do.
    """
    lidars = lidars_of(each)
    if not lidars:
        return
    lidar, number = lidars[0], each.frame.frame
    path = root / "data_3d_raw" / sequence / _VELODYNE / "data" / f"{number:010d}.bin"
    if lidar.format == KITTI:
        link_file(lidar.file(number), path)
    else:
        make_folder(path.parent)
        write_whole(path, lidar.read(number).points.astype("<f4").tobytes())


def write_times(each: FrameFiles, sequence: str, cameras: Iterable[int], root: Path) -> None:
    """Writes the time of each frame of a take for its sensors, a line for each number from 0.

    All sensors look at the same time. Drives follow each other ten seconds apart. Frames of no
    drive have no times of their own.

    Args:
        each: Any frame of the take.
        sequence: Name of its sequence.
        cameras: Numbers of the rig's cameras.
        root: Folder of the rig.
    """
    times = frame_times(each.cameras["frames"])
    # datetime64 counts whole nanoseconds, as KITTI-360 writes them.
    stamps = _BEGIN + np.round(times * 1e9).astype("timedelta64[ns]")
    text = "".join(f"{stamp}\n".replace("T", " ") for stamp in stamps)
    raw = root / "data_2d_raw" / sequence
    folders = [raw / f"image_{number:02d}" for number in cameras]
    if lidars_of(each):
        folders.append(root / "data_3d_raw" / sequence / _VELODYNE)
    for folder in folders:
        make_folder(folder)
        write_whole(folder / "timestamps.txt", text)


def frame_times(rows: Sequence[Mapping[str, Any]]) -> FloatArray:
    """Seconds of the frames of a take from its first; each is later than the one before.

    Args:
        rows: Frames as in ``cameras.json``, with the time since the start of their drive.
    """
    times: list[float] = []
    for _, group in groupby(rows, lambda row: (row["route"], row.get("turn", 0))):
        own = [row.get("time") for row in group]
        begin = times[-1] + _BETWEEN_DRIVES if times else 0.0
        first = own[0] or 0.0
        times += [
            begin + (number * _TURN if time is None else time - first)
            for number, time in enumerate(own)
        ]
    return np.array(times)


def velodyne_from_camera(each: FrameFiles) -> FloatArray | None:
    """4 x 4, from a camera to the frame of its take's first lidar; `None` without one."""
    lidars = lidars_of(each)
    if not lidars:
        return None
    from_camera = np.array(each.cameras["vehicle_from_camera"], np.float64)
    place: FloatArray = np.linalg.inv(lidars[0].vehicle_from_lidar) @ from_camera
    return place


def _lens(each: FrameFiles) -> Mapping[str, Any]:
    lens: Mapping[str, Any] = each.cameras["camera"].get("lens", {})
    return lens
