"""Draws a map of a network as SVG or PNG."""

from collections.abc import Sequence
from html import escape
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from envgen_usd.errors import EnvgenError
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.road import RoadNetwork
from envgen_usd.models.road_marks import RMS_MARKS, MarkRules
from envgen_usd.opendrive.inspect.map_shapes import (
    LANE_COLOURS,
    SEVERITY_COLOURS,
    Shape,
    map_shapes,
)
from envgen_usd.whole_files import whole_file, write_whole

SIDE = 2400
"""Pixels of the map's longer side; a larger value shows more detail."""
BACKGROUND = "#f4f7ef"
_MARGIN, _LEGEND_WIDTH = 40, 230
_DOT, _PIN = 3.0, 9.0
_LEAST_HEIGHT = 440
"""Least height of the map in pixels, for the legend."""
_SMOOTH = 2
"""Supersampling factor of a PNG in x and y; a larger value gives smoother edges."""
_LEGEND = ("driving", "sidewalk", "shoulder", "parking", "biking", "median", "border", "none")


def write_map(network: RoadNetwork, path: Path, rules: MarkRules = RMS_MARKS) -> None:
    """Draws lanes by type, marks, objects, signals, and issues as pins.

    Args:
        network: The road network.
        path: A .svg or .png file; its folder has to exist.
        rules: Sizes of marks that the file leaves open.

    Raises:
        EnvgenError: The path has another suffix, or the file cannot be written.
    """
    shapes = map_shapes(network, rules)
    view = _View(shapes)
    if path.suffix.lower() == ".svg":
        write_whole(path, _svg(shapes, view))
    elif path.suffix.lower() == ".png":
        with whole_file(path) as part:
            _png(shapes, view).save(part)
    else:
        raise EnvgenError(f"{path}: maps are .svg or .png files. Give a path with such a suffix.")


class _View:
    """Transformation from metres to pixels, y downwards.

    Attributes:
        scale: Pixels per metre.
        size: Width and height in pixels.
    """

    def __init__(self, shapes: Sequence[Shape]) -> None:
        points = np.concatenate([shape.points for shape in shapes]) if shapes else np.zeros((1, 2))
        low, high = points.min(axis=0), points.max(axis=0)
        extent = np.maximum(high - low, 1.0)
        self.scale = float((SIDE - 2 * _MARGIN) / extent.max())
        width, height = np.ceil(extent * self.scale) + 2 * _MARGIN
        self.size = int(width) + _LEGEND_WIDTH, max(int(height), _LEAST_HEIGHT)
        self._low, self._high = low, high

    def pixels(self, points: FloatArray) -> FloatArray:
        x = (points[:, 0] - self._low[0]) * self.scale + _MARGIN + _LEGEND_WIDTH
        y = (self._high[1] - points[:, 1]) * self.scale + _MARGIN
        return np.column_stack([x, y])

    def bar(self) -> tuple[float, float]:
        """Returns the length of a scale bar: a round number of metres, and pixels."""
        wanted = SIDE / 8 / self.scale
        power = 10.0 ** np.floor(np.log10(wanted))
        metres = float(max(step * power for step in (1, 2, 5) if step * power <= wanted))
        return metres, metres * self.scale


def _svg(shapes: Sequence[Shape], view: _View) -> str:
    width, height = view.size
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}"'
        f' font-family="sans-serif" font-size="22">',
        f'<rect width="{width}" height="{height}" fill="{BACKGROUND}"/>',
        *(_svg_shape(shape, view) for shape in shapes),
        *_svg_legend(view),
        "</svg>\n",
    ]
    return "\n".join(lines)


def _svg_shape(shape: Shape, view: _View) -> str:
    points = view.pixels(shape.points)
    title = f"<title>{escape(shape.title)}</title>"
    x, y = points[0]
    if shape.kind == "dot":
        return (
            f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{_DOT}" fill="{shape.colour}">{title}</circle>'
        )
    if shape.kind == "pin":
        d = f"M{x:.1f} {y:.1f}l{-_PIN / 2} {-_PIN}h{_PIN}z"
        return f'<path d="{d}" fill="{shape.colour}" stroke="#fff">{title}</path>'
    text = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
    if shape.kind == "area":
        return f'<polygon points="{text}" fill="{shape.colour}">{title}</polygon>'
    if shape.kind == "paint":
        look = f'fill="{shape.colour}" stroke="{shape.colour}" stroke-width="0.5"'
        return f'<polygon points="{text}" {look}>{title}</polygon>'
    width = max(shape.width * view.scale, 0.5)
    look = f'fill="none" stroke="{shape.colour}" stroke-width="{width:.2f}"'
    return f'<polyline points="{text}" {look}>{title}</polyline>'


def _svg_legend(view: _View) -> list[str]:
    lines = []
    for number, (name, colour) in enumerate(_legend()):
        y = 20 + 30 * number
        lines.append(f'<rect x="20" y="{y}" width="30" height="20" fill="{colour}"/>')
        lines.append(f'<text x="60" y="{y + 18}">{escape(name)}</text>')
    metres, pixels = view.bar()
    y = view.size[1] - 20
    lines.append(f'<path d="M20 {y}h{pixels:.1f}" stroke="#000" stroke-width="3"/>')
    lines.append(f'<text x="20" y="{y - 8}">{metres:g} m</text>')
    return lines


def _legend() -> list[tuple[str, str]]:
    lanes = [(name, LANE_COLOURS[name]) for name in _LEGEND]
    issues = [(f"issue: {each.value}", colour) for each, colour in SEVERITY_COLOURS.items()]
    return [*lanes, *issues]


def _png(shapes: Sequence[Shape], view: _View) -> Image.Image:
    width, height = view.size
    image = Image.new("RGB", (width * _SMOOTH, height * _SMOOTH), BACKGROUND)
    pen = ImageDraw.Draw(image)
    for shape in shapes:
        _draw(pen, shape, view)
    image = image.resize((width, height), Image.Resampling.LANCZOS)
    pen = ImageDraw.Draw(image)
    for number, (name, colour) in enumerate(_legend()):
        y = 20 + 30 * number
        pen.rectangle((20, y, 50, y + 20), fill=colour)
        pen.text((60, y), name, fill="#000000", font_size=22)
    metres, pixels = view.bar()
    pen.line((20, height - 20, 20 + pixels, height - 20), fill="#000000", width=3)
    pen.text((20, height - 48), f"{metres:g} m", fill="#000000", font_size=22)
    return image


def _draw(pen: ImageDraw.ImageDraw, shape: Shape, view: _View) -> None:
    points = view.pixels(shape.points) * _SMOOTH
    x, y = points[0].tolist()
    if shape.kind == "dot":
        r = _DOT * _SMOOTH
        pen.ellipse((x - r, y - r, x + r, y + r), fill=shape.colour)
    elif shape.kind == "pin":
        r = _PIN * _SMOOTH
        corners = [(x, y), (x - r / 2, y - r), (x + r / 2, y - r)]
        pen.polygon(corners, fill=shape.colour, outline="#ffffff")
    elif shape.kind in {"area", "paint"}:
        outline = shape.colour if shape.kind == "paint" else None
        pen.polygon([tuple(point) for point in points.tolist()], shape.colour, outline)
    else:
        width = max(round(shape.width * view.scale * _SMOOTH), 1)
        pen.line([tuple(point) for point in points.tolist()], fill=shape.colour, width=width)
