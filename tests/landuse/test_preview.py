import numpy as np
from PIL import Image

from envgen_usd.chunks import Chunk
from envgen_usd.landuse.landuse_preview import COLOURS, draw_landuse, draw_sheet
from envgen_usd.models.landuse import LanduseClass, LanduseMap


def test_north_is_up_and_colours_are_those_of_the_classes():
    classes = np.full((255, 255), LanduseClass.GRASS, dtype=np.uint8)
    classes[200:, :100] = LanduseClass.WOOD
    plots = np.zeros((255, 255), dtype=np.int64)
    maps = {
        Chunk(0, 0): LanduseMap(Chunk(0, 0), classes, plots),
        Chunk(1, 1): LanduseMap(Chunk(1, 1), classes, plots),
    }
    picture = draw_landuse(maps)
    assert picture.size == (510, 510)
    # Row 0 is the north edge of the northern chunk; (1, 1) lies in the upper right.
    assert picture.getpixel((10, 255 + 10)) == COLOURS[LanduseClass.WOOD]
    assert picture.getpixel((10, 500)) == COLOURS[LanduseClass.GRASS]
    assert picture.getpixel((10, 10)) == COLOURS[LanduseClass.UNKNOWN]
    assert picture.getpixel((500, 10)) == COLOURS[LanduseClass.GRASS]


def test_a_sheet_holds_every_picture_and_the_legend():
    red, blue = Image.new("RGB", (40, 30), "red"), Image.new("RGB", (40, 30), "blue")
    sheet = np.array(draw_sheet([("a", red), ("b", blue), ("c", red)]))
    assert np.sum(np.all(sheet == (255, 0, 0), axis=2)) == 2 * 40 * 30
    assert np.sum(np.all(sheet == (0, 0, 255), axis=2)) == 40 * 30
    assert np.any(np.all(sheet == COLOURS[LanduseClass.RUBBLE], axis=2))
