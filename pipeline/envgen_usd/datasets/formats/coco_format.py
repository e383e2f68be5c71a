"""The layout of COCO: instances with masks, panoptic segments (cocodataset.org, format-data)."""

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from envgen_usd.datasets.frame_files import FrameFiles, each_frame, link_file
from envgen_usd.errors import EnvgenError
from envgen_usd.label_taxonomy import labels
from envgen_usd.models.array_types import IntArray
from envgen_usd.render.frames.image_files import write_png
from envgen_usd.render.frames.label_images import INSTANCE_FACTOR
from envgen_usd.whole_files import make_folder, write_whole

_FACTOR = 100_000
"""Factor of the class id in panoptic ids, which have 24 bits; a larger factor has room for more
objects of a class and for fewer classes."""


@dataclass(frozen=True)
class Segment:
    """Pixels of an instance, or of a class without instances.

    Attributes:
        value: Instance value.
        size: Height and width of the image, pixels.
        runs: Lengths of the runs outside and inside, column by column, as COCO's RLE has them.
        area: Number of pixels.
        box: Left, top, width and height, pixels.
    """

    value: int
    size: tuple[int, int]
    runs: tuple[int, ...]
    area: int
    box: tuple[int, int, int, int]


def write_coco(
    frames: Sequence[FrameFiles], out: Path, progress: Callable[[int, int], None]
) -> None:
    """Writes ``<split>/*.png``, ``panoptic_<split>/*.png`` and both kinds of annotations.

    Categories have the class ids. Masks are uncompressed RLE, which keeps holes. An annotation's
    `instance` is its value on the stage, the same in all frames of a town.

    Args:
        frames: Frames of the data set.
        out: Folder of the format.
        progress: Called with the frames done and their number.

    Raises:
        EnvgenError: A class has too many objects, or a file cannot be written.
    """

    def write(each: FrameFiles) -> tuple[tuple[int, int], list[Segment]]:
        split = each.frame.split
        link_file(each.rgb, out / split / f"{each.name}.png")
        values = each.instance
        make_folder(out / f"panoptic_{split}")
        ids = panoptic_ids(values)
        split_ids = np.stack([(ids >> shift) & 255 for shift in (0, 8, 16)], axis=-1)
        write_png(out / f"panoptic_{split}" / f"{each.name}.png", split_ids.astype(np.uint8))
        return values.shape, segments(values)

    found = each_frame(frames, write, progress)
    make_folder(out / "annotations")
    for split in dict.fromkeys(each.frame.split for each in frames):
        those = [
            (number, each, *shown)
            for number, (each, shown) in enumerate(zip(frames, found, strict=True), 1)
            if each.frame.split == split
        ]
        images = [_image(number, each, shape) for number, each, shape, _ in those]
        head = {"info": {"description": "envgen-usd"}, "images": images}
        instances = _instances([(number, shown) for number, _, _, shown in those])
        whole = [_panoptic(number, each, shown) for number, each, _, shown in those]
        folder = out / "annotations"
        things = [row for row in _categories() if row["isthing"]]
        _write(folder / f"instances_{split}.json", head, instances, things)
        _write(folder / f"panoptic_{split}.json", head, whole, _categories())


def segments(values: NDArray[np.uint32]) -> list[Segment]:
    """The segments of a frame (H x W instance values), by value."""
    height, width = values.shape
    flat = values.T.reshape(-1)  # COCO counts down the columns
    starts = np.concatenate(([0], np.flatnonzero(flat[1:] != flat[:-1]) + 1))
    ends = np.append(starts[1:], len(flat))
    owner = flat[starts]
    order = np.argsort(owner, kind="stable")
    found = []
    for those in np.split(order, np.flatnonzero(np.diff(owner[order])) + 1):
        low, high = starts[those], ends[those]
        rows = np.concatenate((low % height, (high - 1) % height))
        whole = (high - 1) // height > low // height  # a run over the end of a column
        top, bottom = (0, height - 1) if whole.any() else (int(rows.min()), int(rows.max()))
        left, right = int(low[0] // height), int((high[-1] - 1) // height)
        found.append(
            Segment(
                value=int(owner[those[0]]),
                size=(height, width),
                runs=tuple(_runs(low, high, height * width)),
                area=int((high - low).sum()),
                box=(left, top, right - left + 1, bottom - top + 1),
            )
        )
    return found


def _runs(low: IntArray, high: IntArray, total: int) -> list[int]:
    """Lengths outside, inside, outside, ... of ascending intervals."""
    borders = np.stack((low, high), axis=1).reshape(-1)
    lengths: list[int] = np.diff(np.concatenate(([0], borders, [total]))).tolist()
    return lengths


def panoptic_ids(values: NDArray[np.uint32]) -> NDArray[np.uint32]:
    """Panoptic ids of 24 bits for instance values of 32 bits.

    Raises:
        EnvgenError: A number does not fit.
    """
    ids, numbers = np.divmod(values, np.uint32(INSTANCE_FACTOR))
    if numbers.max(initial=0) >= _FACTOR:
        fault = f"panoptic images of 24 bits hold {_FACTOR - 1:,} objects of a class"
        raise EnvgenError(f"coco: {fault}, and a stage has more; choose another format")
    return (ids * np.uint32(_FACTOR) + numbers).astype(np.uint32)


def _image(number: int, each: FrameFiles, shape: tuple[int, int]) -> dict[str, Any]:
    return {
        "id": number,
        "file_name": f"{each.name}.png",
        "height": shape[0],
        "width": shape[1],
    }


def _instances(frames: Sequence[tuple[int, list[Segment]]]) -> list[dict[str, Any]]:
    rows: list[dict[str, Any]] = []
    for number, shown in frames:
        for each in shown:
            if each.value % INSTANCE_FACTOR:
                rows.append({"id": len(rows) + 1, "image_id": number, **_annotation(each)})
    return rows


def _annotation(each: Segment) -> dict[str, Any]:
    return {
        "category_id": each.value // INSTANCE_FACTOR,
        "instance": each.value,
        "bbox": list(each.box),
        "area": each.area,
        "iscrowd": 0,
        "segmentation": {"counts": list(each.runs), "size": list(each.size)},
    }


def _panoptic(number: int, each: FrameFiles, shown: Sequence[Segment]) -> dict[str, Any]:
    ids = panoptic_ids(np.array([segment.value for segment in shown], np.uint32)).tolist()
    rows = [
        {
            "id": id_,
            "category_id": segment.value // INSTANCE_FACTOR,
            "instance": segment.value,
            "bbox": list(segment.box),
            "area": segment.area,
            "iscrowd": 0,
        }
        for id_, segment in zip(ids, shown, strict=True)
        if segment.value >= INSTANCE_FACTOR  # void has no segment
    ]
    return {"image_id": number, "file_name": f"{each.name}.png", "segments_info": rows}


def _categories() -> list[dict[str, Any]]:
    return [
        {
            "id": entry.id,
            "name": entry.cityscapes,
            "supercategory": entry.cityscapes,
            "isthing": int(entry.has_instances),
            "color": list(entry.colour),
        }
        for entry in labels()
        if entry.id
    ]


def _write(
    path: Path,
    head: dict[str, Any],
    annotations: Sequence[dict[str, Any]],
    categories: Sequence[dict[str, Any]],
) -> None:
    content = {**head, "annotations": annotations, "categories": categories}
    write_whole(path, json.dumps(content) + "\n")
