"""The layout of YOLO: pictures, boxes in text files, and data.yaml (docs.ultralytics.com)."""

from collections.abc import Callable, Sequence
from pathlib import Path

from envgen_usd.datasets.formats.coco_format import segments
from envgen_usd.datasets.frame_files import FrameFiles, each_frame, link_file
from envgen_usd.label_taxonomy import labels
from envgen_usd.render.frames.label_images import INSTANCE_FACTOR
from envgen_usd.whole_files import make_folder, write_whole


def write_yolo(
    frames: Sequence[FrameFiles], out: Path, progress: Callable[[int, int], None]
) -> None:
    """Writes ``images/<split>``, ``labels/<split>`` and ``data.yaml``, for detection.

    A line of a label file is the class, from 0, then the middle, width and height of the box of
    what is visible, as shares of the image.

    Args:
        frames: Frames of the data set.
        out: Folder of the format.
        progress: Called with the frames done and their number.

    Raises:
        EnvgenError: A file cannot be written.
    """
    kinds = [entry for entry in labels() if entry.has_instances]
    numbers = {entry.id: number for number, entry in enumerate(kinds)}

    def write(each: FrameFiles) -> None:
        split, values = each.frame.split, each.instance
        link_file(each.rgb, out / "images" / split / f"{each.name}.png")
        height, width = values.shape
        lines = []
        for segment in segments(values):
            kind, number = divmod(segment.value, INSTANCE_FACTOR)
            if number:
                left, top, wide, high = segment.box
                middle = f"{(left + wide / 2) / width:.6f} {(top + high / 2) / height:.6f}"
                lines.append(f"{numbers[kind]} {middle} {wide / width:.6f} {high / height:.6f}\n")
        make_folder(out / "labels" / split)
        write_whole(out / "labels" / split / f"{each.name}.txt", "".join(lines))

    each_frame(frames, write, progress)
    splits = dict.fromkeys(each.frame.split for each in frames)
    # Without `path`, readers take the folder of the file; a relative one is that of their settings.
    rows = [f"{split}: images/{split}" for split in splits]
    names = [f"  {number}: {entry.cityscapes}" for number, entry in enumerate(kinds)]
    write_whole(out / "data.yaml", "\n".join([*rows, "names:", *names]) + "\n")
