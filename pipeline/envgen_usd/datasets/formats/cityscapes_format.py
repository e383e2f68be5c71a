"""The layout of Cityscapes: leftImg8bit, gtFine, camera (cityscapesScripts, README)."""

import json
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from envgen_usd.datasets.frame_files import FrameFiles, each_frame, link_file
from envgen_usd.datasets.pages.preview_sheets import painted
from envgen_usd.label_taxonomy import labels
from envgen_usd.models.array_types import ByteArray
from envgen_usd.render.frames.image_files import write_png
from envgen_usd.whole_files import make_folder, write_whole


def write_cityscapes(
    frames: Sequence[FrameFiles], out: Path, progress: Callable[[int, int], None]
) -> None:
    """Writes ``{leftImg8bit,gtFine,camera}/<split>/<city>/<city>_<seq>_<frame>_....``.

    A city is a town, without underscores; a sequence is a weather with a camera. Cityscapes
    separates no instances of our classes, so `instanceIds` are the plain ids.

    Args:
        frames: Frames of the data set.
        out: Folder of the format.
        progress: Called with the frames done and their number.

    Raises:
        EnvgenError: A file cannot be written.
    """
    sequences: dict[str, dict[str, int]] = {}
    for each in frames:
        known = sequences.setdefault(_city(each), {})
        known.setdefault(each.frame.folder, len(known))
    trained = np.full(256, 255, np.uint8)
    for entry in labels():
        trained[entry.id] = entry.cityscapes_train_id
    train_ids: ByteArray = trained

    def write(each: FrameFiles) -> None:
        city = _city(each)
        name = f"{city}_{sequences[city][each.frame.folder]:06d}_{each.frame.frame:06d}"
        place = Path(each.frame.split) / city
        link_file(each.rgb, out / "leftImg8bit" / place / f"{name}_leftImg8bit.png")
        labelled = out / "gtFine" / place
        make_folder(labelled)
        semantic = each.semantic
        write_png(labelled / f"{name}_gtFine_labelIds.png", semantic)
        write_png(labelled / f"{name}_gtFine_instanceIds.png", semantic.astype(np.uint16))
        write_png(labelled / f"{name}_gtFine_labelTrainIds.png", train_ids[semantic])
        write_png(labelled / f"{name}_gtFine_color.png", painted(semantic))
        make_folder(out / "camera" / place)
        write_whole(out / "camera" / place / f"{name}_camera.json", _camera(each))

    each_frame(frames, write, progress)


def _city(each: FrameFiles) -> str:
    """Name of the town; underscores separate the parts of Cityscapes' names."""
    frame = each.frame
    text = f"{frame.road}-{frame.country}-{frame.area}-{frame.seed}"
    return "".join(c if c.isalnum() or c == "-" else "-" for c in text)


def _camera(each: FrameFiles) -> str:
    """Intrinsics in pixels, and the place of the camera on the vehicle (x ahead, z up), metres."""
    camera = each.cameras["camera"]
    place = np.array(each.cameras["vehicle_from_camera"])
    ahead, right = place[:3, 2], place[:3, 0]
    angles = {
        "pitch": float(np.arcsin(-ahead[2])),
        "roll": float(np.arcsin(-right[2])),
        "yaw": float(np.arctan2(ahead[1], ahead[0])),
    }
    x, y, z = place[:3, 3].tolist()
    content = {
        "extrinsic": {"baseline": 0.0, **angles, "x": x, "y": y, "z": z},
        "intrinsic": {
            "fx": camera["fx"],
            "fy": camera["fy"],
            "u0": camera["cx"],
            "v0": camera["cy"],
        },
    }
    return json.dumps(content, indent=1) + "\n"
