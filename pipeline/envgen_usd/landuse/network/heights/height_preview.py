"""Greyscale sheets of heights along random roads."""

from collections.abc import Mapping, Sequence

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from envgen_usd.geometry.road_outline import Outline
from envgen_usd.landuse.network.data.height_sample import HEIGHT_CELL
from envgen_usd.landuse.network.data.landuse_scenes import TILES
from envgen_usd.landuse.network.heights.height_scenes import (
    make_height_sample,
    make_height_scene,
    on_grid,
    square_centres,
)
from envgen_usd.landuse.network.heights.network_land import GridLand, HeightNetwork
from envgen_usd.landuse.network.training.training_run import Progress
from envgen_usd.models.array_types import BoolArray, ByteArray, FloatArray
from envgen_usd.models.ground import Heights

TITLE = 20
"""Font size of titles, pixels; a larger value makes larger titles."""
CONTOUR = 1.0
"""Interval of contour lines, metres; a larger value draws fewer lines."""
ROAD = np.array([70, 90, 150], dtype=np.uint8)
"""Colour of the road."""


def height_sheet(
    network: HeightNetwork,
    samples: int,
    seed: int,
    progress: Progress = lambda *_: None,
) -> Image.Image:
    """Draws maps of 2 x 2 chunks: from the road alone, by the network, and the truth.

    Args:
        network: Trained network.
        samples: Number of maps, each a row of the sheet.
        seed: Random seed of land, roads and style.
        progress: Called with the progress of each step.
    """
    rows = []
    axis = np.concatenate([tile.cell_centres()[0] for tile in TILES[:2]])
    for number in range(samples):
        scene = make_height_scene("unseen", number, seed)
        told = make_height_sample(scene).reference.astype(np.float64)
        alone = GridLand(told, np.rint(square_centres()[[0, 0]] / HEIGHT_CELL - 0.5).astype(int))
        lands: dict[str, Heights] = {
            "road alone": alone,
            "network": network.land(scene.surface, TILES, seed),
            "truth": scene.land.bare,
        }
        road = Outline.of(scene.surface).encloses_grid(axis, axis)
        maps = {name: on_grid(land, axis, axis) for name, land in lands.items()}
        rows.append((scene.kind, road, maps))
        progress("maps", len(rows), samples)
    return _sheet(rows)


def draw_heights(heights: FloatArray, road: BoolArray, low: float, high: float) -> Image.Image:
    """Draws heights, black at the lowest and white at the highest, with contours; north up."""
    grey = np.clip(255 * (heights - low) / max(high - low, CONTOUR), 0, 255).astype(np.uint8)
    pixels: ByteArray = np.repeat(grey[..., None], 3, axis=-1)
    level = np.floor(heights / CONTOUR)
    line = np.zeros(road.shape, dtype=np.bool_)
    line[1:] |= level[1:] != level[:-1]
    line[:, 1:] |= level[:, 1:] != level[:, :-1]
    pixels[line] = (pixels[line] * 0.75).astype(np.uint8)
    pixels[road] = ROAD
    return Image.fromarray(np.ascontiguousarray(pixels[::-1]))


def _sheet(rows: Sequence[tuple[str, BoolArray, Mapping[str, FloatArray]]]) -> Image.Image:
    font = ImageFont.load_default(TITLE)
    height, width = (side + TITLE for side in rows[0][1].shape)
    sheet = Image.new("RGB", (width * len(rows[0][2]), (height + TITLE) * len(rows)), "white")
    pen = ImageDraw.Draw(sheet)
    for line, (kind, road, maps) in enumerate(rows):
        low, high = float(maps["truth"].min()), float(maps["truth"].max())
        top = line * (height + TITLE)
        for place, (name, heights) in enumerate(maps.items()):
            title = f"{kind}: {name}, black {low:.1f} m, white {high:.1f} m"
            pen.text((place * width, top), title, "black", font)
            picture = draw_heights(heights, road, low, high)
            sheet.paste(picture, (place * width, top + TITLE + TITLE // 2))
    return sheet
