"""The layout of nuScenes (Caesar et al., CVPR 2020; nuscenes-devkit, schema_nuscenes.md)."""

import json
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeAlias

from envgen_usd.datasets.formats.nuscenes.box_points import points_in_boxes
from envgen_usd.datasets.formats.nuscenes.nuscenes_maps import write_maps
from envgen_usd.datasets.formats.nuscenes.nuscenes_scenes import Sample, Scene, scenes_of, take_of
from envgen_usd.datasets.formats.nuscenes.nuscenes_sensors import (
    LIDARSEG,
    SensorData,
    lidarseg_rows,
    remove_stale,
    sample_data_rows,
    sensor_data,
    sensor_rows,
    write_data,
)
from envgen_usd.datasets.formats.nuscenes.nuscenes_tables import (
    attribute_tokens,
    box_record,
    category_of,
    fixed_tables,
    linked,
    token,
    visibility_token,
    write_table,
)
from envgen_usd.datasets.frame_files import FrameFiles, each_frame
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
    annotations, and count the points in their boxes. Lidars have the axes of nuScenes' (x right,
    y ahead), and ``lidarseg`` the classes of their points. Cameras with a lens model are left out.
    The origin of a town's map is the corner of its stage, rounded down to metres; ``map.json`` has
    it as `stage_origin`.

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
    data = {scene.token: sensor_data(scene) for scene in scenes}
    everything = [each for rows in data.values() for each in rows]

    def write(each: SensorData) -> tuple[Boxes, Mapping[int, int]]:
        scan = write_data(each, out, VERSION)
        if scan is None:
            return each.image.boxes if each.image else (), {}
        boxes = {row["instance"]: row["box_3d"] for e in each.sample.frames for row in e.boxes}
        counts = points_in_boxes(scan.world, list(boxes.values())).tolist()
        return (), dict(zip(boxes, counts, strict=True))

    shown = each_frame(everything, write, progress)
    seen = {each.token: found for each, found in zip(everything, shown, strict=True)}
    fixed = fixed_tables() | sensor_rows(everything)
    for name, rows in fixed.items():
        write_table(tables, name, rows)
    _write_logs(scenes, tables)
    images = (row for scene in scenes for row in sample_data_rows(data[scene.token]))
    write_table(tables, "sample_data", images)
    poses = (e.ego_pose(origins[e.sample.lead.frame.town]) for e in everything)
    write_table(tables, "ego_pose", poses)
    write_table(tables, "sample", _samples(scenes))
    _write_annotations(scenes, data, seen, origins, tables)
    classes = lidarseg_rows(everything, VERSION)
    remove_stale(classes, out, VERSION)
    if classes:
        write_table(tables, LIDARSEG, classes)
    _write_splits(scenes, tables)


def _write_splits(scenes: Sequence[Scene], tables: Path) -> None:
    splits: defaultdict[str, list[str]] = defaultdict(list)
    for scene in scenes:
        splits[SPLIT_PREFIX + scene.first.frame.split].append(scene.name)
    write_whole(tables / "splits.json", json.dumps(splits, indent=1) + "\n")


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


def _write_annotations(
    scenes: Sequence[Scene],
    data: Mapping[str, Sequence[SensorData]],
    found: Mapping[str, tuple[Boxes, Mapping[int, int]]],
    origins: Mapping[str, FloatArray],
    tables: Path,
) -> None:
    """Writes instances and their annotations; an instance is an object in a scene."""
    instances: list[dict[str, Any]] = []
    annotations: list[dict[str, Any]] = []
    for scene in scenes:
        tracks: defaultdict[int, list[dict[str, Any]]] = defaultdict(list)
        names: dict[int, str] = {}
        of_sample: defaultdict[str, list[str]] = defaultdict(list)
        for each in data[scene.token]:
            of_sample[each.sample.token].append(each.token)
        for sample in scene.samples:
            known = [found[mark] for mark in of_sample[sample.token]]
            shown = [row for boxes, _ in known for row in boxes]
            origin = origins[sample.lead.frame.town]
            for value, seen in _by_instance(shown).items():
                names[value] = seen[0]["class"]
                points = sum(counts.get(value, 0) for _, counts in known)
                tracks[value].append(_annotation(scene, sample, value, seen, origin, points))
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


def _annotation(  # noqa: PLR0913, PLR0917 - what an annotation follows from
    scene: Scene,
    sample: Sample,
    value: int,
    rows: Sequence[Mapping[str, Any]],
    origin: FloatArray,
    points: int,
) -> dict[str, Any]:
    """The annotation of an object in a sample.

    Args:
        scene: The scene.
        sample: The sample.
        value: Instance value of the object.
        rows: Its boxes in all cameras.
        origin: x and y of the map's origin on the stage, metres.
        points: Number of points of the sample's scans in its box.
    """
    seen = sum(row["pixels"] for row in rows)
    whole = sum(row["pixels"] / max(1.0 - row["occlusion"], 1e-6) for row in rows)
    return {
        "token": token("sample_annotation", sample.token, value),
        "sample_token": sample.token,
        "instance_token": token("instance", scene.token, value),
        "visibility_token": visibility_token(seen / whole),
        "attribute_tokens": attribute_tokens(rows[0]),
        **box_record(rows[0]["box_3d"], origin),
        "num_lidar_pts": points,
        "num_radar_pts": 0,
    }
