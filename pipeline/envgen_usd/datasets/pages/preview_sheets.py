"""Contact sheets of a data set: pictures beside their labels."""

from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from envgen_usd.datasets.dataset_index import IndexedFrame
from envgen_usd.datasets.frame_files import read_image
from envgen_usd.errors import EnvgenError
from envgen_usd.label_taxonomy import labels
from envgen_usd.models.array_types import ByteArray
from envgen_usd.whole_files import make_folder, whole_file

FOLDER = "preview"
"""Folder of the sheets."""
FRAMES = 12
"""Frames of a sheet; a larger value shows more and makes larger files."""
_WIDTH = 352
"""Width of a picture, pixels."""
_PAIRS = 2
"""Frames side by side."""
_TEXT, _FONT = 16, 11
"""Height of the line below a frame and of its letters, pixels."""
_QUALITY = 88
"""Quality of JPEG, 0 to 95; a larger value makes larger files."""


@dataclass(frozen=True)
class Sheet:
    """A contact sheet.

    Attributes:
        file: Path relative to the data set.
        title: What it shows.
        frames: The frames in reading order.
    """

    file: str
    title: str
    frames: tuple[IndexedFrame, ...]


def draw_previews(
    folder: Path,
    frames: Sequence[IndexedFrame],
    count: int = FRAMES,
    progress: Callable[[str, int, int], None] = lambda *_: None,
) -> tuple[Sheet, ...]:
    """Draws a sheet for each town and camera: frames of all weathers, evenly spread.

    Args:
        folder: Folder of the data set.
        frames: Its frames.
        count: Frames of a sheet.
        progress: Called with the step's name, the parts done and the total.

    Raises:
        EnvgenError: An image is missing or damaged, or a file cannot be written.
    """
    groups: defaultdict[str, list[IndexedFrame]] = defaultdict(list)
    for each in frames:
        groups[f"{each.town}_{each.rig}_{each.camera}"].append(each)
    make_folder(folder / FOLDER)
    sheets = []
    for number, (name, those) in enumerate(groups.items()):
        progress("draw sheets", number, len(groups))
        steps = np.linspace(0, len(those) - 1, min(count, len(those))).round().astype(int)
        shown = tuple(those[index] for index in steps.tolist())
        sheet = Sheet(f"{FOLDER}/{name}.jpg", name, shown)
        drawn = _drawn(folder, shown)
        with whole_file(folder / sheet.file) as part:
            drawn.save(part, "JPEG", quality=_QUALITY)
        sheets.append(sheet)
    progress("draw sheets", len(groups), max(len(groups), 1))
    return tuple(sheets)


def _drawn(folder: Path, frames: Sequence[IndexedFrame]) -> Image.Image:
    pairs = [_pair(folder, each) for each in frames]
    width, height = pairs[0].width, pairs[0].height + _TEXT
    rows = -(-len(pairs) // _PAIRS)
    sheet = Image.new("RGB", (min(_PAIRS, len(pairs)) * width, rows * height), "white")
    draw, font = ImageDraw.Draw(sheet), ImageFont.load_default(_FONT)
    for number, (each, pair) in enumerate(zip(frames, pairs, strict=True)):
        x, y = number % _PAIRS * width, number // _PAIRS * height
        sheet.paste(pair, (x, y))
        text = f"{each.frame:06d}  {each.split}  street {each.street or '-'}  {each.weather}"
        draw.text((x + 3, y + pair.height + 1), text, "black", font)
    return sheet


def _pair(folder: Path, frame: IndexedFrame) -> Image.Image:
    """A picture, and its labels to the right; a kind that is no output stays out."""
    parts: list[Image.Image] = []
    if (folder / frame.file("rgb")).is_file():
        parts.append(Image.fromarray(read_image(folder / frame.file("rgb"))))
    if (folder / frame.file("semantic")).is_file():
        labelled = read_image(folder / frame.file("semantic"))
        parts.append(Image.fromarray(painted(labelled)))
    if not parts:
        raise EnvgenError(f"{folder / frame.folder}: sheets need the outputs rgb or semantic")
    height = max(round(_WIDTH * parts[0].height / parts[0].width), 1)
    pair = Image.new("RGB", (_WIDTH * len(parts), height))
    for number, part in enumerate(parts):
        way = Image.Resampling.NEAREST if number else Image.Resampling.LANCZOS
        pair.paste(part.resize((_WIDTH, height), way), (number * _WIDTH, 0))
    return pair


def painted(semantic: ByteArray) -> ByteArray:
    """Class ids (H x W) in the colours of the classes, H x W x 3."""
    colours = np.zeros((256, 3), np.uint8)
    for entry in labels():
        colours[entry.id] = entry.colour
    return colours[semantic]
