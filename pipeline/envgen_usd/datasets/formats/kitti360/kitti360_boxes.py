"""KITTI-360's boxes: ``data_3d_bboxes/train/<sequence>.xml``.

Source: kitti360Scripts, helpers/annotation.py and labels.py; the annotators' tool of KITTI-360
(kitti360LabelTool, utils.js), which wrote the boxes as OpenCV's matrices.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from envgen_usd.datasets.formats.kitti360.short_instances import separate_ids
from envgen_usd.datasets.frame_files import FrameFiles
from envgen_usd.label_taxonomy import label
from envgen_usd.models.array_types import FloatArray
from envgen_usd.whole_files import make_folder, write_whole

_KINDS = {
    "building": ("building", 11),
    "pole": ("bigPole", 21),
    "traffic_light": ("trafficLight", 23),
    "traffic_sign": ("trafficSign", 24),
    "person": ("pedestrian", 19),
    "rider": ("rider", 20),
    "car": ("car", 13),
    "truck": ("truck", 14),
    "bus": ("bus", 34),
    "train": ("train", 33),
    "motorcycle": ("motorcycle", 17),
    "bicycle": ("bicycle", 18),
}
"""Label and ``kittiId`` of the classes that KITTI-360 separates; boxes do not have its `id`."""
_CUBE = np.array(
    [
        (0.5, 0.5, 0.5),
        (0.5, 0.5, -0.5),
        (0.5, -0.5, 0.5),
        (0.5, -0.5, -0.5),
        (-0.5, 0.5, -0.5),
        (-0.5, 0.5, 0.5),
        (-0.5, -0.5, -0.5),
        (-0.5, -0.5, 0.5),
    ]
)
"""Vertices of every box; readers take the sides from their order."""
_FACES = "0 2 1 2 3 1 4 6 5 6 7 5 4 5 1 5 0 1 7 6 2 6 3 2 5 7 0 7 2 0 1 3 4 3 6 4"  # 12 triangles
_STATIC = -1
"""Time stamp of a box that does not move."""

Rows = Sequence[Mapping[str, Any]]
"""Records of `boxes`."""


@dataclass(frozen=True)
class _Object:
    """Records of an object in a sequence, by frame."""

    rows: dict[int, Mapping[str, Any]]

    @property
    def moves(self) -> bool:
        """True for what moves on the stage; its box is that of a frame."""
        return any("velocity" in row for row in self.rows.values())


def separate_boxes(each: FrameFiles) -> Rows:
    """The boxes of a frame's objects that KITTI-360 separates; empty without the output."""
    if not (each.root / each.frame.file("boxes")).is_file():
        return ()
    kinds = set(separate_ids())
    return [row for row in each.boxes if label(row["class"]).id in kinds]


def write_boxes(
    shown: Iterable[tuple[int, Rows]], numbers: Mapping[int, int], sequence: str, root: Path
) -> None:
    """Writes the boxes of a sequence; nothing if the data set has none.

    A box is the unit cube with a transform: rotation and size, and the centre in the world, metres.
    `start_frame` and `end_frame` are the first and the last frame that show the object. What moves
    on the stage is `dynamic`: it has a box for each frame that shows it, whose `timestamp` is the
    number of the frame.

    Args:
        shown: Number of a frame and its boxes, for each frame.
        numbers: n of each object; objects without one are left out.
        sequence: Name of the sequence.
        root: Folder of the rig.
    """
    objects: dict[int, _Object] = {}
    for frame, rows in shown:
        for row in rows:
            objects.setdefault(row["instance"], _Object({})).rows.setdefault(frame, row)
    if not objects:
        return
    kept = [value for value in sorted(objects) if value in numbers]
    boxes = [(value, frame) for value in kept for frame in _frames(objects[value])]
    parts = [
        _element(n, objects[value], frame, numbers[value])
        for n, (value, frame) in enumerate(boxes, 1)
    ]
    folder = root / "data_3d_bboxes" / "train"
    make_folder(folder)
    text = "".join(('<?xml version="1.0"?>\n<opencv_storage>\n', *parts, "</opencv_storage>\n"))
    write_whole(folder / f"{sequence}.xml", text)


def box_transform(box: Mapping[str, Any]) -> FloatArray:
    """4 x 4, from the unit cube to the world.

    Args:
        box: `box_3d` of a record of `boxes`.
    """
    cos, sin = np.cos(box["yaw"]), np.sin(box["yaw"])
    transform = np.eye(4)
    transform[:3, :3] = np.array([(cos, -sin, 0), (sin, cos, 0), (0, 0, 1)]) * box["size"]
    transform[:3, 3] = box["centre"]
    return transform


def _frames(each: _Object) -> list[int]:
    """Frames whose boxes are written: all of what moves, the first of what does not."""
    frames = sorted(each.rows)
    return frames if each.moves else frames[:1]


def _element(index: int, each: _Object, frame: int, number: int) -> str:
    row = each.rows[frame]
    name, kind = _KINDS[row["class"]]
    fields = {
        "index": index,
        "label": name,
        "semanticId_orig": kind,
        "semanticId": kind,
        "instanceId": number,
        "category": "instance",
        "timestamp": frame if each.moves else _STATIC,
        "dynamic": int(each.moves),
        "start_frame": min(each.rows),
        "end_frame": max(each.rows),
    }
    lines = [f"  <{key}>{value}</{key}>" for key, value in fields.items()]
    lines += [
        _matrix("transform", "f", 4, _text(box_transform(row["box_3d"]))),
        _matrix("vertices", "f", 3, _text(_CUBE)),
        _matrix("faces", "u", 3, _FACES),
    ]
    return "\n".join((f"<object{index}>", *lines, f"</object{index}>\n"))


def _matrix(name: str, kind: str, columns: int, data: str) -> str:
    """A matrix as OpenCV's files have it."""
    rows = len(data.split()) // columns
    size = f"<rows>{rows}</rows><cols>{columns}</cols><dt>{kind}</dt>"
    return f'  <{name} type_id="opencv-matrix">{size}<data>{data}</data></{name}>'


def _text(values: FloatArray) -> str:
    return " ".join(repr(float(value)) for value in values.reshape(-1))
