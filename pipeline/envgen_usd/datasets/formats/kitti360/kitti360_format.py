"""The layout of KITTI-360 (cvlibs.net/datasets/kitti-360/documentation.php)."""

import json
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import count
from pathlib import Path

import numpy as np

from envgen_usd.datasets.formats.kitti360.kitti360_boxes import Rows, separate_boxes, write_boxes
from envgen_usd.datasets.formats.kitti360.kitti360_sensors import (
    fisheyes,
    velodyne_from_camera,
    write_fisheye,
    write_fisheye_calibration,
    write_times,
    write_velodyne,
)
from envgen_usd.datasets.formats.kitti360.short_instances import (
    pixels_of,
    sequence_numbers,
    short_instances,
)
from envgen_usd.datasets.frame_files import FrameFiles, each_frame, link_file
from envgen_usd.datasets.pages.preview_sheets import painted
from envgen_usd.errors import EnvgenError
from envgen_usd.models.array_types import FloatArray
from envgen_usd.render.frames.image_files import write_png
from envgen_usd.whole_files import make_folder, write_whole

_CERTAIN = 65535
"""Confidence of exact labels."""
_SYSTEM = np.diag((1.0, -1.0, -1.0, 1.0))
"""From the axes of KITTI-360's vehicle (x ahead, y right, z down) to ours (y left, z up)."""
_CAMERAS = 2
"""Perspective cameras of KITTI-360."""
_RULED = (2, 4)
"""Sequences of KITTI-360 that py123d reads by rules of their own."""


def write_kitti360(
    frames: Sequence[FrameFiles], out: Path, progress: Callable[[int, int], None]
) -> None:
    """Writes a root of KITTI-360 for each rig: pictures, labels, scans, boxes, calibration, poses.

    A town in a weather is a sequence. The first two cameras without a lens model are image_00 and
    image_01, the first two fisheyes of the unified model image_02 and image_03; others are left
    out. The first lidar is the Velodyne. `instance` has 16 bits, and ``instance_table`` the value
    on the stage for each of its values. An object has one value in the images and the boxes of a
    sequence, unless more than 999 of its class are seen.

    Args:
        frames: Frames of the data set.
        out: Folder of the format.
        progress: Called with the frames done and their number.

    Raises:
        EnvgenError: A rig has no camera without a lens model, or a file cannot be written.
    """
    by_rig: defaultdict[str, list[FrameFiles]] = defaultdict(list)
    for each in frames:
        by_rig[each.frame.rig].append(each)
    done = 0
    for rig, those in by_rig.items():
        before = done

        def told(count: int, _total: int, before: int = before) -> None:
            progress(before + count, len(frames))

        _write_rig(those, out / rig, told)
        done += len(those)


def _write_rig(
    frames: Sequence[FrameFiles], root: Path, progress: Callable[[int, int], None]
) -> None:
    cameras, wide = _cameras(frames), fisheyes(frames)
    kept = [each for each in frames if each.frame.camera in cameras]
    beside = [each for each in frames if each.frame.camera in wide]
    free = (number for number in count() if number not in _RULED)
    sequences = {take: next(free) for take in dict.fromkeys(map(_take, kept))}
    for each in beside:
        write_fisheye(each, _sequence(sequences[_take(each)]), wide[each.frame.camera], root)
    numbers = _number_objects(kept, beside, sequences, root)

    def write(each: FrameFiles) -> tuple[str, dict[int, int]]:
        number = sequences[_take(each)]
        return _write_frame(each, _sequence(number), cameras, numbers[number], root)

    tables = each_frame(kept, write, progress)
    _write_lists(kept, sequences, cameras, root)
    _write_instances(kept, sequences, tables, numbers, root)
    _write_calibration(frames, cameras, wide, root)
    _write_poses(kept, sequences, cameras, root)
    for take, number in sequences.items():
        of_take = next(each for each in kept if _take(each) == take)
        write_times(of_take, _sequence(number), (cameras | wide).values(), root)


def _number_objects(
    kept: Sequence[FrameFiles],
    beside: Sequence[FrameFiles],
    sequences: Mapping[str, int],
    root: Path,
) -> dict[int, dict[int, int]]:
    """Writes the boxes of each sequence; returns the numbers of its objects by their values."""

    def look(each: FrameFiles) -> tuple[dict[int, int], Rows]:
        boxes = separate_boxes(each)
        if each in labelled:
            return pixels_of(each.instance), boxes
        return {row["instance"]: row["pixels"] for row in boxes}, boxes

    labelled = set(kept)
    everything = [*kept, *beside]
    found: defaultdict[int, list[tuple[int, dict[int, int], Rows]]] = defaultdict(list)
    looks = each_frame(everything, look, lambda *_: None)
    for each, (pixels, boxes) in zip(everything, looks, strict=True):
        found[sequences[_take(each)]].append((each.frame.frame, pixels, boxes))
    numbers = {}
    for number, rows in found.items():
        numbers[number] = sequence_numbers(pixels for _, pixels, _ in rows)
        shown = ((frame, boxes) for frame, _, boxes in rows)
        write_boxes(shown, numbers[number], _sequence(number), root)
    return numbers


def _write_frame(
    each: FrameFiles,
    sequence: str,
    cameras: Mapping[str, int],
    numbers: Mapping[int, int],
    root: Path,
) -> tuple[str, dict[int, int]]:
    """Writes picture, labels and scan; returns the name and the table of its instance values."""
    if cameras[each.frame.camera] == 0:
        write_velodyne(each, sequence, root)
    image, name = f"image_{cameras[each.frame.camera]:02d}", f"{each.frame.frame:010d}"
    link_file(each.rgb, root / "data_2d_raw" / sequence / image / "data_rect" / f"{name}.png")
    folder = root / "data_2d_semantics" / "train" / sequence / image
    for kind in ("semantic", "semantic_rgb", "instance", "confidence", "instance_table"):
        make_folder(folder / kind)
    semantic, short = each.semantic, short_instances(each.instance, numbers)
    write_png(folder / "semantic" / f"{name}.png", semantic)
    write_png(folder / "semantic_rgb" / f"{name}.png", painted(semantic))
    write_png(folder / "instance" / f"{name}.png", short.image)
    sure = np.full(semantic.shape, _CERTAIN, np.uint16)
    write_png(folder / "confidence" / f"{name}.png", sure)
    write_whole(folder / "instance_table" / f"{name}.json", json.dumps(short.table) + "\n")
    return f"{name}.png", short.table


def _cameras(frames: Sequence[FrameFiles]) -> dict[str, int]:
    """Number of each camera that KITTI-360 has a place for."""
    names = dict.fromkeys(each.frame.camera for each in frames)
    first = {each.frame.camera: each for each in reversed(frames)}
    plain = [name for name in names if not first[name].has_lens]
    if not plain:
        fault = "no camera without a lens model, as image_00 needs it"
        raise EnvgenError(f"kitti360: rig {frames[0].frame.rig} has {fault}")
    return {name: number for number, name in enumerate(plain[:_CAMERAS])}


def _take(each: FrameFiles) -> str:
    """Town and weather of a frame."""
    return "/".join(each.frame.folder.split("/")[:3])


def _sequence(number: int) -> str:
    return f"2013_05_28_drive_{number:04d}_sync"


def _write_lists(
    frames: Sequence[FrameFiles], sequences: dict[str, int], cameras: dict[str, int], root: Path
) -> None:
    """Writes the pairs of picture and labels of each split."""
    rows: defaultdict[str, list[str]] = defaultdict(list)
    for each in frames:
        sequence = _sequence(sequences[_take(each)])
        image, name = f"image_{cameras[each.frame.camera]:02d}", f"{each.frame.frame:010d}.png"
        picture = f"data_2d_raw/{sequence}/{image}/data_rect/{name}"
        semantic = f"data_2d_semantics/train/{sequence}/{image}/semantic/{name}"
        rows[each.frame.split].append(f"{picture} {semantic}\n")
    for split, lines in rows.items():
        path = root / "data_2d_semantics" / "train" / f"2013_05_28_drive_{split}_frames.txt"
        write_whole(path, "".join(lines))


def _write_instances(
    frames: Sequence[FrameFiles],
    sequences: dict[str, int],
    tables: Sequence[tuple[str, dict[int, int]]],
    numbers: Mapping[int, Mapping[int, int]],
    root: Path,
) -> None:
    """Writes which frames show an object, for each sequence; of those with a number there."""
    shown: dict[int, defaultdict[int, list[str]]] = {
        number: defaultdict(list) for number in sequences.values()
    }
    for each, (name, table) in zip(frames, tables, strict=True):
        number = sequences[_take(each)]
        for value, stage_value in table.items():
            if stage_value in numbers[number] and name not in shown[number][value]:
                shown[number][value].append(name)
    for number, values in shown.items():
        path = root / "data_2d_semantics" / "train" / _sequence(number) / "instanceDict.json"
        write_whole(path, json.dumps({str(v): values[v] for v in sorted(values)}) + "\n")


def _write_calibration(
    frames: Sequence[FrameFiles], cameras: dict[str, int], wide: dict[str, int], root: Path
) -> None:
    """Writes intrinsics, and the place of the cameras on the vehicle.

    The readers of KITTI-360 want four cameras: those that the rig does not have stand where
    image_00 does.
    """
    first = {each.frame.camera: each for each in reversed(frames)}
    places = {n: _system_from_camera(first[name]) for name, n in (cameras | wide).items()}
    rows = [f"image_{n:02d}: {_numbers(places.get(n, places[0])[:3])}" for n in range(4)]
    make_folder(root / "calibration")
    write_whole(root / "calibration" / "calib_cam_to_pose.txt", "\n".join(rows) + "\n")
    for name, number in wide.items():
        write_fisheye_calibration(first[name], number, root)
    lead = next(first[name] for name, number in cameras.items() if number == 0)
    velodyne = velodyne_from_camera(lead)
    if velodyne is not None:
        text = _numbers(velodyne[:3]) + "\n"
        write_whole(root / "calibration" / "calib_cam_to_velo.txt", text)
    lines = []
    for name, number in cameras.items():
        camera = first[name].cameras["camera"]
        fx, fy, cx, cy = (float(camera[key]) for key in ("fx", "fy", "cx", "cy"))
        aside = float((np.linalg.inv(places[0]) @ places[number])[0, 3])
        projection = np.array([(fx, 0, cx, -fx * aside), (0, fy, cy, 0), (0, 0, 1, 0)])
        size = np.array((float(camera["width"]), float(camera["height"])))
        lines += [
            f"S_rect_{number:02d}: {_numbers(size)}",
            f"R_rect_{number:02d}: {_numbers(np.eye(3))}",
            f"P_rect_{number:02d}: {_numbers(projection)}",
        ]
    write_whole(root / "calibration" / "perspective.txt", "\n".join(lines) + "\n")


def _write_poses(
    frames: Sequence[FrameFiles], sequences: dict[str, int], cameras: dict[str, int], root: Path
) -> None:
    """Writes poses of the vehicle and of image_00, metres."""
    lead = next(name for name, number in cameras.items() if number == 0)
    for take, number in sequences.items():
        of_lead = [e for e in frames if _take(e) == take and e.frame.camera == lead]
        folder = root / "data_poses" / _sequence(number)
        make_folder(folder)
        poses, world = [], []
        for index, matrix in _matrices(of_lead):
            system = matrix @ np.linalg.inv(_system_from_camera(of_lead[0]))
            poses.append(f"{index} {_numbers(system[:3])}\n")
            world.append(f"{index} {_numbers(matrix)}\n")
        write_whole(folder / "poses.txt", "".join(poses))
        write_whole(folder / "cam0_to_world.txt", "".join(world))


def _matrices(frames: Sequence[FrameFiles]) -> Iterator[tuple[int, FloatArray]]:
    """Number and pose (4 x 4, camera to world) of each frame."""
    for each in frames:
        yield each.frame.frame, np.array(each.pose_row["camera_to_world"], np.float64)


def _system_from_camera(each: FrameFiles) -> FloatArray:
    place: FloatArray = _SYSTEM @ np.array(each.cameras["vehicle_from_camera"], np.float64)
    return place


def _numbers(values: FloatArray) -> str:
    return " ".join(repr(float(value)) for value in values.reshape(-1))
