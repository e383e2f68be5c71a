"""Images of landuse."""

from collections.abc import Mapping, Sequence

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from envgen_usd.chunks import LANDUSE_CELLS, Chunk
from envgen_usd.models.array_types import ByteArray
from envgen_usd.models.landuse import LanduseClass, LanduseMap

COLOURS: Mapping[LanduseClass, tuple[int, int, int]] = {
    LanduseClass.UNKNOWN: (0, 0, 0),
    LanduseClass.ROAD: (70, 70, 75),
    LanduseClass.GRASS: (126, 170, 92),
    LanduseClass.VERGE: (160, 190, 110),
    LanduseClass.LAWN: (190, 225, 130),
    LanduseClass.RUBBLE: (190, 175, 155),
    LanduseClass.ACCESS: (215, 205, 200),
    LanduseClass.WOOD: (50, 110, 60),
    LanduseClass.PARK: (95, 190, 110),
    LanduseClass.PARKING: (180, 180, 190),
    LanduseClass.ALLOTMENT: (170, 150, 90),
    LanduseClass.FIELD: (225, 215, 140),
    LanduseClass.WATER: (110, 160, 205),
    LanduseClass.RAIL: (120, 90, 110),
    LanduseClass.SCHOOL: (205, 215, 170),
    LanduseClass.SHOP: (200, 170, 185),
    LanduseClass.GARAGES: (160, 165, 180),
    LanduseClass.CROP: (205, 220, 110),
    LanduseClass.ORCHARD: (115, 165, 70),
    LanduseClass.SQUARE: (225, 205, 185),
    LanduseClass.QUAY: (175, 180, 190),
    LanduseClass.ROAD_END: (150, 150, 155),
}
"""RGB of each class, in images and in the colour table of files."""
TITLE = 24
"""Font size on a sheet, pixels; a larger value makes larger titles."""
EDGE = 0.72
"""Brightness factor of cells at the edge of their plot; a larger value fades the edges."""


def draw_landuse(maps: Mapping[Chunk, LanduseMap]) -> Image.Image:
    """Draws a plan of chunks, north up, a pixel for each cell, with plot borders.

    Args:
        maps: Landuse of the chunks, not empty; gaps between chunks are black.
    """
    x = [chunk.x for chunk in maps]
    y = [chunk.y for chunk in maps]
    rows, columns = max(y) - min(y) + 1, max(x) - min(x) + 1
    classes = np.zeros((rows * LANDUSE_CELLS, columns * LANDUSE_CELLS), dtype=np.uint8)
    plots = np.zeros(classes.shape, dtype=np.int64)
    for chunk, landuse in maps.items():
        row, column = (chunk.y - min(y)) * LANDUSE_CELLS, (chunk.x - min(x)) * LANDUSE_CELLS
        window = np.s_[row : row + LANDUSE_CELLS, column : column + LANDUSE_CELLS]
        classes[window], plots[window] = landuse.classes, landuse.plots
    return Image.fromarray(_shade(classes, plots)[::-1])


def draw_sheet(pictures: Sequence[tuple[str, Image.Image]], columns: int = 2) -> Image.Image:
    """Arranges titled images in a grid above a legend of the classes.

    Args:
        pictures: Title and image of each map, not empty.
        columns: Images per row.
    """
    font = ImageFont.load_default(TITLE)
    width = max(picture.width for _, picture in pictures) + TITLE
    height = max(picture.height for _, picture in pictures) + 2 * TITLE
    rows = -(-len(pictures) // columns)
    legend = _draw_legend(font, min(len(pictures), columns) * width)
    size = (legend.width, rows * height + legend.height)
    sheet = Image.new("RGB", size, "white")
    pen = ImageDraw.Draw(sheet)
    for number, (title, picture) in enumerate(pictures):
        x, y = number % columns * width, number // columns * height
        pen.text((x + TITLE // 2, y), title, "black", font)
        sheet.paste(picture, (x + TITLE // 2, y + TITLE + TITLE // 2))
    sheet.paste(legend, (0, rows * height))
    return sheet


def _draw_legend(font: ImageFont.FreeTypeFont | ImageFont.ImageFont, width: int) -> Image.Image:
    """Legend in as many columns as the width takes; at least as wide as the longest entry."""
    names = {kind.name.lower(): colour for kind, colour in COLOURS.items()}
    entry = 3 * TITLE + int(max(map(font.getlength, names)))
    columns = max(width // entry, 1)
    rows = -(-len(names) // columns)
    step = TITLE + TITLE // 2
    legend = Image.new("RGB", (max(width, entry), rows * step + TITLE // 2), "white")
    pen = ImageDraw.Draw(legend)
    for number, (name, colour) in enumerate(names.items()):
        x, y = number // rows * entry + TITLE, number % rows * step
        pen.rectangle((x - TITLE // 2, y, x + TITLE // 2, y + TITLE), colour)
        pen.text((x + TITLE, y), name, "black", font)
    return legend


def _shade(classes: ByteArray, plots: np.ndarray) -> ByteArray:
    palette = np.array([COLOURS[kind] for kind in LanduseClass], dtype=np.float64)
    colours = palette[classes]
    edge = np.zeros(classes.shape, dtype=np.bool_)
    edge[:, 1:] |= plots[:, 1:] != plots[:, :-1]
    edge[1:] |= plots[1:] != plots[:-1]
    colours[edge & (classes != LanduseClass.ACCESS)] *= EDGE
    shaded: ByteArray = colours.astype(np.uint8)
    return shaded
