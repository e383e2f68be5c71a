"""The layout of nuScenes (Caesar et al., CVPR 2020; nuscenes-devkit, schema_nuscenes.md)."""

import json
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from envgen_usd.datasets.format_files import FrameFiles, each_frame, link_file
from envgen_usd.datasets.nuscenes_maps import write_maps
from envgen_usd.datasets.nuscenes_scenes import Sample, Scene, channel_of, scenes_of, take_of
from envgen_usd.datasets.nuscenes_tables import (
    attribute_token,
    box_record,
    category_of,
    fixed_tables,
    linked,
    pose_record,
    token,
    visibility_token,
    write_table,
)
from envgen_usd.errors import EnvgenError
from envgen_usd.models.array_types import FloatArray
from envgen_usd.whole_files import make_folder, write_whole

VERSION = "v1.0-trainval"
"""Folder of the tables; the readers of others know this name."""
SPLIT_PREFIX = "envgen_"
"""Begin of the names of splits: `train` and `val` are lists of nuScenes' own scenes."""
_DATE = "2020-09-13"
"""Date of the first sample of each take."""
Boxes: TypeAlias = Sequence[Mapping[str, Any]]
"""Records of the objects that an image shows."""


def write_nuscenes(
    frames: Sequence[FrameFiles], out: Path, progress: Callable[[int, int], None]
) -> None:
    """Writes ``v1.0-trainval/*.json``, ``samples/<channel>`` and ``maps``.

    A take is a log. Its consecutive frames of a route and a split are a scene, so frames of no
    drive are scenes of one sample. All frames are key frames. The objects of `boxes` are the
    annotations. Cameras with a lens model are left out. The origin of a town's map is the corner of
    its stage, rounded down to metres; ``map.json`` has it as `stage_origin`.

    Args:
        frames: Frames of the data set.
        out: Folder of the format.
        progress: Called with the frames done and their number.

    Raises:
        EnvgenError: No camera is without a lens model, a town is missing, or a file cannot be
            written.
    """
    kept = [each for each in frames if not each.has_lens]
    if not kept:
        raise EnvgenError("nuscenes: no rig has a camera without a lens model, as nuScenes has")
    scenes = scenes_of(kept)
    tables = out / VERSION
    make_folder(tables)
    origins = write_maps(scenes, out, tables)
    data = _sample_data(scenes)

    def write(image: tuple[FrameFiles, dict[str, Any]]) -> Boxes:
        each, row = image
        link_file(each.rgb, out / row["filename"])
        return each.boxes

    shown = each_frame(data, write, progress)
    boxes = {row["token"]: found for (_, row), found in zip(data, shown, strict=True)}
    for name, rows in fixed_tables().items():
        write_table(tables, name, rows)
    _write_sensors(kept, tables)
    _write_logs(scenes, tables)
    write_table(tables, "sample_data", (row for _, row in data))
    poses = (_ego_pose(each, row, origins[each.frame.town]) for each, row in data)
    write_table(tables, "ego_pose", poses)
    write_table(tables, "sample", _samples(scenes))
    _write_annotations(scenes, boxes, origins, tables)
    splits: defaultdict[str, list[str]] = defaultdict(list)
    for scene in scenes:
        splits[SPLIT_PREFIX + scene.first.frame.split].append(scene.name)
    write_whole(tables / "splits.json", json.dumps(splits, indent=1) + "\n")


def _write_sensors(frames: Sequence[FrameFiles], tables: Path) -> None:
    """Writes the channels, and the calibration of each camera of a take."""
    first = {(take_of(each), channel_of(each)): each for each in reversed(frames)}
    channels = sorted({channel for _, channel in first})
    sensors = [
        {"token": token("sensor", channel), "channel": channel, "modality": "camera"}
        for channel in channels
    ]
    write_table(tables, "sensor", sensors)
    rows = []
    for (take, channel), each in sorted(first.items()):
        camera = each.cameras["camera"]
        fx, fy, cx, cy = (float(camera[key]) for key in ("fx", "fy", "cx", "cy"))
        rows.append(
            {
                "token": token("calibrated_sensor", take, channel),
                "sensor_token": token("sensor", channel),
                **pose_record(np.array(each.cameras["vehicle_from_camera"])),
                "camera_intrinsic": [[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]],
            }
        )
    write_table(tables, "calibrated_sensor", rows)


def _write_logs(scenes: Sequence[Scene], tables: Path) -> None:
    """Writes a log for each take, and the scenes."""
    firsts = {take_of(scene.first): scene.first for scene in reversed(scenes)}
    logs = [
        {
            "token": token("log", take),
            "logfile": take.replace("/", "_"),
            "vehicle": each.frame.rig,
            "date_captured": _DATE,
            "location": each.frame.town,
        }
        for take, each in sorted(firsts.items())
    ]
    write_table(tables, "log", logs)
    rows = [
        {
            "token": scene.token,
            "log_token": token("log", take_of(scene.first)),
            "nbr_samples": len(scene.samples),
            "first_sample_token": scene.samples[0].token,
            "last_sample_token": scene.samples[-1].token,
            "name": scene.name,
            "description": _described(scene.first),
        }
        for scene in scenes
    ]
    write_table(tables, "scene", rows)


def _described(each: FrameFiles) -> str:
    frame = each.frame
    return f"{frame.road}, {frame.country} {frame.area}, {frame.weather or 'light of the stage'}"


def _samples(scenes: Sequence[Scene]) -> Iterator[dict[str, Any]]:
    for scene in scenes:
        rows: list[dict[str, Any]] = [
            {"token": each.token, "timestamp": each.time, "scene_token": scene.token}
            for each in scene.samples
        ]
        linked(rows)
        yield from rows


def _sample_data(
    scenes: Sequence[Scene],
) -> list[tuple[FrameFiles, dict[str, Any]]]:
    """The images with their records, scene by scene and channel by channel."""
    found: list[tuple[FrameFiles, dict[str, Any]]] = []
    for scene in scenes:
        of_channel: defaultdict[str, list[tuple[FrameFiles, dict[str, Any]]]] = defaultdict(list)
        for sample in scene.samples:
            for each in sample.frames:
                of_channel[channel_of(each)].append((each, _image_record(sample, each)))
        for rows in of_channel.values():
            linked([row for _, row in rows])
            found += rows
    return found


def _image_record(sample: Sample, each: FrameFiles) -> dict[str, Any]:
    take, channel = take_of(each), channel_of(each)
    mark = _image_token(each)
    camera = each.cameras["camera"]
    return {
        "token": mark,
        "sample_token": sample.token,
        "ego_pose_token": mark,
        "calibrated_sensor_token": token("calibrated_sensor", take, channel),
        "timestamp": sample.time,
        "fileformat": each.rgb.suffix[1:],
        "is_key_frame": True,
        "height": camera["height"],
        "width": camera["width"],
        "filename": f"samples/{channel}/{take.replace('/', '_')}__{channel}__{sample.time}.png",
    }


def _image_token(each: FrameFiles) -> str:
    return token("sample_data", take_of(each), channel_of(each), each.frame.frame)


def _ego_pose(each: FrameFiles, row: Mapping[str, Any], origin: FloatArray) -> dict[str, Any]:
    camera = np.array(each.pose_row["camera_to_world"], np.float64)
    vehicle = camera @ np.linalg.inv(np.array(each.cameras["vehicle_from_camera"]))
    vehicle[:2, 3] -= origin
    return {
        "token": row["ego_pose_token"],
        "timestamp": row["timestamp"],
        **pose_record(vehicle),
    }


def _write_annotations(
    scenes: Sequence[Scene],
    boxes: Mapping[str, Boxes],
    origins: Mapping[str, FloatArray],
    tables: Path,
) -> None:
    """Writes instances and their annotations; an instance is an object in a scene."""
    instances: list[dict[str, Any]] = []
    annotations: list[dict[str, Any]] = []
    for scene in scenes:
        tracks: defaultdict[int, list[dict[str, Any]]] = defaultdict(list)
        names: dict[int, str] = {}
        for sample in scene.samples:
            shown = [row for each in sample.frames for row in boxes[_image_token(each)]]
            origin = origins[sample.lead.frame.town]
            for value, seen in _by_instance(shown).items():
                names[value] = seen[0]["class"]
                tracks[value].append(_annotation(scene, sample, value, seen, origin))
        for value, rows in sorted(tracks.items()):
            linked(rows)
            annotations += rows
            instances.append(
                {
                    "token": token("instance", scene.token, value),
                    "category_token": token("category", category_of(names[value])),
                    "nbr_annotations": len(rows),
                    "first_annotation_token": rows[0]["token"],
                    "last_annotation_token": rows[-1]["token"],
                }
            )
    write_table(tables, "instance", instances)
    write_table(tables, "sample_annotation", annotations)


def _by_instance(rows: Sequence[Mapping[str, Any]]) -> dict[int, list[Mapping[str, Any]]]:
    found: defaultdict[int, list[Mapping[str, Any]]] = defaultdict(list)
    for row in rows:
        found[row["instance"]].append(row)
    return dict(sorted(found.items()))


def _annotation(
    scene: Scene,
    sample: Sample,
    value: int,
    rows: Sequence[Mapping[str, Any]],
    origin: FloatArray,
) -> dict[str, Any]:
    """The annotation of an object in a sample; `rows` are its boxes in all cameras."""
    seen = sum(row["pixels"] for row in rows)
    whole = sum(row["pixels"] / max(1.0 - row["occlusion"], 1e-6) for row in rows)
    return {
        "token": token("sample_annotation", sample.token, value),
        "sample_token": sample.token,
        "instance_token": token("instance", scene.token, value),
        "visibility_token": visibility_token(seen / whole),
        "attribute_tokens": [attribute_token(rows[0]["class"])],
        **box_record(rows[0]["box_3d"], origin),
        "num_lidar_pts": 0,
        "num_radar_pts": 0,
    }
