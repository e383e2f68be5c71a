"""KITTI-360's fisheyes and Velodyne: pictures, scans and calibrations."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from envgen_usd.datasets.format_files import FrameFiles, link_file
from envgen_usd.datasets.frame_scans import lidars_of
from envgen_usd.models.array_types import FloatArray
from envgen_usd.whole_files import make_folder, write_whole

_FISHEYES = (2, 3)
"""Numbers of the fisheyes."""
_VELODYNE = "velodyne_points"
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
    """Writes the scan of a take's first lidar, if it has one, in the lidar's frame."""
    lidars = lidars_of(each)
    if lidars:
        scan = lidars[0].read(each.frame.frame)
        folder = root / "data_3d_raw" / sequence / _VELODYNE / "data"
        make_folder(folder)
        rows = np.column_stack((scan.points, scan.intensities)).astype("<f4")
        write_whole(folder / f"{each.frame.frame:010d}.bin", rows.tobytes())


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
