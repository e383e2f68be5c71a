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
    for kind in LanduseClass:
        assert np.any(np.all(sheet == COLOURS[kind], axis=2)), kind


def test_a_legend_is_no_wider_than_the_pictures():
    picture = Image.new("RGB", (510, 400), "red")
    sheet = np.array(draw_sheet([("a", picture), ("b", picture)]))
    painted = np.flatnonzero((sheet < 255).any(axis=(0, 2)))
    assert sheet.shape[1] < 1.1 * 2 * 510
    assert painted.max() > 0.95 * sheet.shape[1]
    for kind in LanduseClass:
        assert np.sum(np.all(sheet == COLOURS[kind], axis=2)) >= 24 * 24, kind
