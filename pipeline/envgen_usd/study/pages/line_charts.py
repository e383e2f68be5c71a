"""Line charts as SVG."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

COLOURS = ("#1f6fb4", "#e07b00", "#2a9d4a", "#b5179e", "#7a5c00", "#555555")
"""Colours of the lines, in their order; further lines begin again."""
_WIDTH, _HEIGHT = 640, 360
_LEFT, _RIGHT, _TOP, _BOTTOM = 60, 150, 20, 45
_TICKS = 5


@dataclass(frozen=True)
class Line:
    """A line with a band around it.

    Attributes:
        name: Name in the legend.
        points: x, y, and the ends of the band at each point.
        joined: Draw a line between the points; otherwise only dots.
    """

    name: str
    points: tuple[tuple[float, float, float, float], ...]
    joined: bool = True


def line_chart(lines: Sequence[Line], x_name: str, y_name: str, *, log_x: bool = False) -> str:
    """Draws lines with bands, axes and a legend; an SVG element.

    Args:
        lines: The lines; those without points are left out.
        x_name: Name of the horizontal axis.
        y_name: Name of the vertical axis.
        log_x: Logarithmic horizontal axis, of x + 1.
    """
    lines = [line for line in lines if line.points]
    if not lines:
        return "<p>No points.</p>"
    xs = [_moved(p[0], log_x) for line in lines for p in line.points]
    ys = [v for line in lines for p in line.points for v in p[1:]]
    frame = _Frame((min(xs), max(xs)), (min(ys), max(ys)), log_x)
    body = [_axes(frame, x_name, y_name)]
    for number, line in enumerate(lines):
        body.append(_drawn(frame, line, COLOURS[number % len(COLOURS)]))
        y = _TOP + 16 + 18 * number
        x = _WIDTH - _RIGHT + 12
        body.append(
            f'<circle cx="{x}" cy="{y - 4}" r="4" fill="{COLOURS[number % len(COLOURS)]}"/>'
            f'<text x="{x + 9}" y="{y}">{escape(line.name)}</text>'
        )
    size = f'viewBox="0 0 {_WIDTH} {_HEIGHT}" width="{_WIDTH}" height="{_HEIGHT}"'
    start = f'<svg xmlns="http://www.w3.org/2000/svg" {size} font-size="12" '
    return start + 'font-family="sans-serif">' + "".join(body) + "</svg>"


@dataclass(frozen=True)
class _Frame:
    """Where values are in the picture."""

    x_range: tuple[float, float]
    y_range: tuple[float, float]
    log_x: bool

    def x(self, value: float) -> float:
        """Place of a value on the horizontal axis, pixels."""
        return _LEFT + _share(_moved(value, self.log_x), self.x_range) * (_WIDTH - _LEFT - _RIGHT)

    def y(self, value: float) -> float:
        """Place of a value on the vertical axis, pixels."""
        return _HEIGHT - _BOTTOM - _share(value, self.y_range) * (_HEIGHT - _TOP - _BOTTOM)


def _drawn(frame: _Frame, line: Line, colour: str) -> str:
    points = sorted(line.points)
    upper = [f"{frame.x(x):.1f},{frame.y(high):.1f}" for x, _, _, high in points]
    lower = [f"{frame.x(x):.1f},{frame.y(low):.1f}" for x, _, low, _ in points]
    middle = " ".join(f"{frame.x(x):.1f},{frame.y(y):.1f}" for x, y, _, _ in points)
    dots = "".join(
        f'<circle cx="{frame.x(x):.1f}" cy="{frame.y(y):.1f}" r="3" fill="{colour}"/>'
        for x, y, _, _ in points
    )
    if not line.joined:
        return dots
    band = " ".join((*upper, *reversed(lower)))
    return (
        f'<polygon points="{band}" fill="{colour}" opacity="0.15"/>'
        f'<polyline points="{middle}" fill="none" stroke="{colour}" stroke-width="1.5"/>{dots}'
    )


def _axes(frame: _Frame, x_name: str, y_name: str) -> str:
    right, bottom = _WIDTH - _RIGHT, _HEIGHT - _BOTTOM
    parts = [
        f'<path d="M{_LEFT} {_TOP}V{bottom}H{right}" fill="none" stroke="#888"/>',
        f'<text x="{(_LEFT + right) / 2}" y="{_HEIGHT - 8}" text-anchor="middle">'
        f"{escape(x_name)}</text>",
        f'<text transform="translate(14 {(_TOP + bottom) / 2}) rotate(-90)" '
        f'text-anchor="middle">{escape(y_name)}</text>',
    ]
    for n in range(_TICKS):
        share = n / (_TICKS - 1)
        y = frame.y_range[0] + share * (frame.y_range[1] - frame.y_range[0])
        moved = frame.x_range[0] + share * (frame.x_range[1] - frame.x_range[0])
        x = math.expm1(moved) if frame.log_x else moved
        parts.append(
            f'<text x="{_LEFT - 6}" y="{frame.y(y) + 4:.1f}" text-anchor="end">{y:.3g}</text>'
            f'<text x="{frame.x(x):.1f}" y="{bottom + 16}" text-anchor="middle">{x:.3g}</text>'
        )
    return "".join(parts)


def _moved(value: float, log: bool) -> float:
    return math.log1p(value) if log else value


def _share(value: float, limits: tuple[float, float]) -> float:
    low, high = limits
    return (value - low) / (high - low) if high > low else 0.5
