"""Textures of sign faces: all faces of a sheet in a square atlas."""

import math

import numpy as np
import shapely
from PIL import Image, ImageDraw

from envgen_usd.assets.signs.sign_drawing import Area, DrawingKit, draw
from envgen_usd.assets.signs.sign_sheets import SignSheet, faces
from envgen_usd.models.array_types import FloatArray

CELL = 256
"""Pixels of a side of a face in the atlas; a larger value gives sharper signs and larger files."""
MARGIN = 6
"""Pixels around a face, in the colour of its border, so that no neighbour shows in the distance."""
_FINE = 4
"""Samples along each side of a pixel."""


def atlas_side(count: int) -> int:
    """Cells along a side of the atlas of so many faces."""
    return math.ceil(math.sqrt(count))


def cell_box(number: int, count: int) -> FloatArray:
    """Texture coordinates of a face without its margin: 2 x 2, lower left and upper right."""
    side = atlas_side(count)
    low = np.array([number % side, number // side], dtype=np.float64) + MARGIN / CELL
    return np.stack([low, low + 1 - 2 * MARGIN / CELL]) / side


def atlas(sheet: SignSheet, kit: DrawingKit) -> FloatArray:
    """Draws all faces of a sheet: S x S x 3, linear reflectance; row 0 is the lower edge.

    Raises:
        EnvgenError: A drawing cannot be drawn.
    """
    all_faces = list(faces(sheet))
    side = atlas_side(len(all_faces))
    pixels = np.full((side * CELL, side * CELL, 3), kit.colours["grey"])
    for number, face in enumerate(all_faces):
        row, column = divmod(number, side)
        areas = draw(face, kit)
        cell = _rastered(areas, (face.width, face.height), kit)
        pixels[row * CELL : (row + 1) * CELL, column * CELL : (column + 1) * CELL] = cell
    return pixels


def _rastered(
    areas: list[tuple[str, Area]], size: tuple[float, float], kit: DrawingKit
) -> FloatArray:
    """A cell of the atlas; what lies outside the plate has the colour of its border."""
    colours = list(kit.colours)
    canvas = Image.new("L", (CELL * _FINE,) * 2, colours.index(areas[0][0]))
    scale = (CELL - 2 * MARGIN) * _FINE / np.array(size)
    middle = CELL * _FINE / 2
    for colour, area in areas:
        for polygon in getattr(area, "geoms", [area]):
            if polygon.geom_type == "Polygon" and not polygon.is_empty:
                rings = [
                    list(map(tuple, shapely.get_coordinates(ring) * scale + middle))
                    for ring in (polygon.exterior, *polygon.interiors)
                ]
                _fill(canvas, rings, colours.index(colour))
    table = np.array([kit.colours[name] for name in colours])
    fine = np.asarray(canvas).reshape(CELL, _FINE, CELL, _FINE).swapaxes(1, 2)
    samples = fine.reshape(CELL, CELL, _FINE**2)
    cell: FloatArray = table[samples[..., 0]]
    mixed = (samples != samples[..., :1]).any(axis=2)
    cell[mixed] = table[samples[mixed]].mean(axis=1)
    return cell


def _fill(canvas: Image.Image, rings: list[list[tuple[float, ...]]], value: int) -> None:
    """Fills a polygon, the first of the rings; its holes keep what lies below."""
    outer, *holes = rings
    if not holes:
        ImageDraw.Draw(canvas).polygon(outer, fill=value)
        return
    mask = Image.new("1", canvas.size, 0)
    cutter = ImageDraw.Draw(mask)
    cutter.polygon(outer, fill=1)
    for hole in holes:
        cutter.polygon(hole, fill=0)
    canvas.paste(value, mask=mask)
