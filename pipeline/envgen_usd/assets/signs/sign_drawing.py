"""Draws the faces of signs: coloured areas on a plate, from lines of operations.

An operation is a colour, a word and figures in metres from the middle of the plate, y up:

    red plate 0.07                     the plate, inset by 0.07
    black fill 0,0 1,0 0,1             a polygon
    black line 0.05 0,0 1,0 1,1        a stroke 0.05 wide
    black arrow 0.05 0,0 1,0           a stroke that ends in a head
    black disc 0,0 0.1                 a disc of radius 0.1
    black ring 0,0 0.1 0.02            a ring of radius 0.1 and width 0.02
    black box 0,0 1,1                  a rectangle between two corners
    black text 0.2 0,0 Some words      text 0.2 high about a point
    black number 0.2 0,0 120           a number that stays inside a round border
    black symbol walker 0.4 0,0        a symbol of `signs/symbols.toml`, 0.4 high
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import shapely
from shapely import affinity

from envgen_usd.assets.signs.sign_lettering import Lettering, lettered
from envgen_usd.assets.signs.sign_sheets import PlateShape, SignFace
from envgen_usd.errors import EnvgenError
from envgen_usd.models.array_types import FloatArray
from envgen_usd.toml_files import read_toml

Area: TypeAlias = Any
"""An area in the plane: shapely is not typed."""
_CORNER = 0.04
"""Radius of the corners of triangles and rectangles, as a share of the shorter side."""
_HEAD = 2.6
"""Width of the head of an arrow, in widths of its stroke."""
_ROUND = 8
"""Segments of a quarter of a circle; a larger value gives rounder plates."""


@dataclass(frozen=True)
class DrawingKit:
    """What faces are drawn with: letters, symbols, and colours as linear reflectance."""

    lettering: Lettering
    symbols: Mapping[str, str]
    colours: Mapping[str, tuple[float, ...]]


@dataclass(frozen=True)
class _Symbols:
    symbols: Mapping[str, str]


@dataclass(frozen=True)
class _Colours:
    colours: Mapping[str, tuple[float, ...]]


def read_drawing_kit(library: Path) -> DrawingKit:
    """Reads the letters, symbols and colours of a library's signs.

    Raises:
        EnvgenError: A file is missing or does not match.
    """
    folder = library / "signs"
    return DrawingKit(
        read_toml(folder / "lettering.toml", Lettering),
        read_toml(folder / "symbols.toml", _Symbols).symbols,
        read_toml(folder / "colours.toml", _Colours).colours,
    )


def draw(face: SignFace, kit: DrawingKit) -> list[tuple[str, Area]]:
    """Returns the coloured areas of a face, the lowest first; they lie inside its plate.

    Raises:
        EnvgenError: The drawing holds an unknown colour, operation or symbol.
    """
    plate = plate_area(face.plate, face.width, face.height)
    areas = []
    for line in filter(None, map(str.strip, face.drawing.splitlines())):
        colour, operation = line.split(maxsplit=1)
        if colour not in kit.colours:
            raise EnvgenError(f"sign {face.name}: '{line}': unknown colour '{colour}'")
        areas.append((colour, shapely.intersection(_area(operation, plate, kit, face.name), plate)))
    return areas


def plate_area(shape: PlateShape, width: float, height: float) -> Area:
    """Returns the outline of a plate as an area about the middle of its box, metres."""
    if shape == "round":
        unit = shapely.Point(0.0, 0.0).buffer(0.5, quad_segs=_ROUND)
        return affinity.scale(unit, width, height)
    if shape == "cross":
        bars = [
            shapely.LineString([(-1, -s), (1, s)]).buffer(0.22, cap_style="flat") for s in (1, -1)
        ]
        unit = shapely.union_all(bars)
        left, low, right, high = unit.bounds
        return affinity.scale(unit, width / (right - left), height / (high - low), origin=(0, 0))
    corners = _CORNERS[shape] * (width, height)
    radius = _CORNER * min(width, height) * (1.0 if shape != "octagon" else 0.2)
    inner = shapely.Polygon(corners).buffer(-radius, join_style="mitre", mitre_limit=10)
    outer = inner.buffer(radius, quad_segs=3)
    left, low, right, high = outer.bounds
    centred = affinity.translate(outer, -(left + right) / 2, -(low + high) / 2)
    return affinity.scale(centred, width / (right - left), height / (high - low), origin=(0, 0))


def _ring(corners: int, start: float) -> FloatArray:
    """A regular polygon in the unit square about the origin, N x 2."""
    angle = np.radians(start) + np.arange(corners) * 2 * np.pi / corners
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    low, high = ring.min(axis=0), ring.max(axis=0)
    unit: FloatArray = (ring - (low + high) / 2) / (high - low)
    return unit


_CORNERS: Mapping[str, FloatArray] = {
    "triangle": _ring(3, 90.0),
    "inverted_triangle": _ring(3, -90.0),
    "octagon": _ring(8, 22.5),
    "diamond": _ring(4, 0.0),
    "square": _ring(4, 45.0),
    "rectangle": _ring(4, 45.0),
    "pentagon": np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.1], [0.0, 0.5], [-0.5, 0.1]]),
    "arrow_right": np.array([[-0.5, -0.5], [0.4, -0.5], [0.5, 0.0], [0.4, 0.5], [-0.5, 0.5]]),
    "arrow_left": np.array([[0.5, 0.5], [-0.4, 0.5], [-0.5, 0.0], [-0.4, -0.5], [0.5, -0.5]]),
}


def _area(line: str, plate: Area, kit: DrawingKit, where: str) -> Area:
    """The area of an operation without its colour."""
    operation, *rest = line.split()
    try:
        if operation == "plate":
            inset = float(rest[0]) if rest else 0.0
            return plate.buffer(-inset, join_style="mitre") if inset else plate
        if operation in {"text", "number"}:
            height, (at,), words = float(rest[0]), _points(rest[1:2]), " ".join(rest[2:])
            left, _, right, _ = plate.bounds
            widest = (right - left) * (0.88 if operation == "text" else 0.66)
            return affinity.translate(lettered(words, kit.lettering, height, widest), *at)
        if operation == "symbol":
            name, size, (at,) = rest[0], float(rest[1]), _points(rest[2:])
            symbol = _symbol(kit.symbols[name], plate, kit, where)
            return affinity.translate(affinity.scale(symbol, size, size, origin=(0, 0)), *at)
        return _SHAPES[operation](rest)
    except (KeyError, ValueError, IndexError) as error:
        raise EnvgenError(f"sign {where}: '{line}' cannot be drawn: {error}") from error


def _symbol(drawing: str, plate: Area, kit: DrawingKit, where: str) -> Area:
    symbol: Area = shapely.Polygon()
    for line in filter(None, map(str.strip, drawing.splitlines())):
        cut = line.startswith("cut ")
        area = _area(line.removeprefix("cut "), plate, kit, where)
        symbol = shapely.difference(symbol, area) if cut else shapely.union(symbol, area)
    return symbol


def _points(tokens: list[str]) -> FloatArray:
    if not tokens:
        raise ValueError("expected points x,y")
    return np.array([[float(value) for value in token.split(",")] for token in tokens])


def _line(rest: list[str]) -> Area:
    line = shapely.LineString(_points(rest[1:]))
    return line.buffer(float(rest[0]) / 2, quad_segs=4, cap_style="flat", join_style="round")


def _arrow(rest: list[str]) -> Area:
    width, points = float(rest[0]), _points(rest[1:])
    ahead = (points[-1] - points[-2]) / np.hypot(*(points[-1] - points[-2]))
    across = np.array([-ahead[1], ahead[0]]) * width * _HEAD / 2
    neck = points[-1] - ahead * width * _HEAD * 0.75
    head = shapely.Polygon([points[-1], neck + across, neck - across])
    shaft = shapely.LineString([*points[:-1], neck + ahead * width * 0.1])
    return shapely.union(head, shaft.buffer(width / 2, cap_style="flat", join_style="round"))


def _disc(rest: list[str]) -> Area:
    return shapely.Point(_points(rest[:1])[0]).buffer(float(rest[1]), quad_segs=_ROUND)


def _hoop(rest: list[str]) -> Area:
    circle = shapely.Point(_points(rest[:1])[0]).buffer(float(rest[1]), quad_segs=_ROUND)
    return circle.boundary.buffer(float(rest[2]) / 2, quad_segs=4)


_SHAPES: Mapping[str, Callable[[list[str]], Area]] = {
    "fill": lambda rest: shapely.Polygon(_points(rest)),
    "line": _line,
    "arrow": _arrow,
    "disc": _disc,
    "ring": _hoop,
    "box": lambda rest: shapely.box(*_points(rest).ravel()),
}
