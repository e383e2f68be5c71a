"""Images of a training run: sample sheets and curves."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from envgen_usd.models.array_types import ByteArray
from envgen_usd.whole_files import whole_file


def write_sheet(rows: Sequence[Sequence[ByteArray]], path: Path) -> None:
    """Writes images (H x W x 3, of equal size; row 0 is the south) as a table, north up."""
    height, width = rows[0][0].shape[:2]
    sheet = Image.new("RGB", ((width + 4) * len(rows[0]), (height + 4) * len(rows)), "white")
    for line, row in enumerate(rows):
        for place, pixels in enumerate(row):
            picture = Image.fromarray(np.ascontiguousarray(pixels[::-1]))
            sheet.paste(picture, ((width + 4) * place, (height + 4) * line))
    with whole_file(path) as part:
        sheet.save(part)


def write_curves(curves: Mapping[str, Sequence[float]], path: Path) -> None:
    """Writes curves over the steps, each in a separate plot from 0 to its largest value."""
    width, height = 640, 120
    image = Image.new("RGB", (width, height * max(1, len(curves))), "white")
    draw = ImageDraw.Draw(image)
    for line, (name, values) in enumerate(curves.items()):
        top, largest = line * height, max(values, default=0.0) or 1.0
        x = np.linspace(0, width - 1, len(values))
        y = top + height - 4 - (height - 24) * np.asarray(values) / largest
        draw.text((4, top), f"{name}: last {values[-1]:.3f}, largest {largest:.3f}", fill="black")
        draw.line(list(zip(x.tolist(), y.tolist(), strict=True)), fill=(40, 70, 160))
        draw.line((0, top + height - 1, width, top + height - 1), fill=(200, 200, 200))
    with whole_file(path) as part:
        image.save(part)
