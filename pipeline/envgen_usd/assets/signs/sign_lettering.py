"""Letters as areas, from the middles of their strokes."""

import re
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import shapely
from shapely import affinity

from envgen_usd.models.array_types import FloatArray

_STEP = 15.0
"""Degrees between the points of an arc; a larger value gives coarser letters."""


@dataclass(frozen=True)
class Lettering:
    """Letters; lengths are shares of the height of a capital.

    Attributes:
        stroke: Width of the strokes.
        gap: Free space between the boxes of two letters' strokes.
        space: Width of the space between words.
        glyphs: Strokes of each letter, as `signs/lettering.toml` says.
    """

    stroke: float
    gap: float
    space: float
    glyphs: Mapping[str, str]


def lettered(
    text: str, lettering: Lettering, height: float, widest: float
) -> shapely.geometry.base.BaseGeometry:
    """Returns the area of a line of text, centred at the origin.

    Args:
        text: The text; letters that the lettering lacks stay blank.
        lettering: Its letters.
        height: Height of a capital, metres.
        widest: Largest width, metres; a longer text becomes narrower.
    """
    pieces, x = [], 0.0
    for letter in text:
        strokes = _strokes(lettering.glyphs.get(letter, ""))
        if not strokes:
            x += lettering.space
            continue
        inset = lettering.stroke / 2
        points = [line * (1.0, 1.0 - lettering.stroke) + (x + inset, inset) for line in strokes]
        pieces += [_stroked(line, lettering.stroke) for line in points]
        x = max(float(line[:, 0].max()) for line in points) + inset + lettering.gap
    if not pieces:
        return shapely.Polygon()
    area = shapely.union_all(pieces)
    left, _, right, _ = area.bounds
    narrow = min(1.0, widest / max((right - left) * height, 1e-9))
    centred = affinity.translate(area, -(left + right) / 2, -0.5)
    return affinity.scale(centred, height * narrow, height, origin=(0.0, 0.0))


def _stroked(line: FloatArray, width: float) -> shapely.geometry.base.BaseGeometry:
    return shapely.buffer(
        shapely.LineString(line), width / 2, quad_segs=4, cap_style="square", join_style="round"
    )


def _strokes(glyph: str) -> list[FloatArray]:
    """The strokes of a letter as polylines, each N x 2."""
    strokes = []
    for stroke in glyph.split("/"):
        points: list[tuple[float, float]] = []
        for token in stroke.split():
            numbers = [float(number) for number in re.findall(r"-?[\d.]+", token)]
            points += [(numbers[0], numbers[1])] if len(numbers) == 2 else _arc(*numbers)
        if points:
            strokes.append(np.array(points))
    return strokes


def _arc(  # noqa: PLR0913, PLR0917 - the six figures of an arc
    x: float, y: float, rx: float, ry: float, start: float, end: float
) -> list[tuple[float, float]]:
    count = max(int(abs(end - start) / _STEP), 2) + 1
    angle = np.radians(np.linspace(start, end, count))
    return list(zip(x + rx * np.cos(angle), y + ry * np.sin(angle), strict=True))
