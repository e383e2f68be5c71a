"""Harbour cranes on rails: level-luffing cranes on portals, and a gantry for containers.

They stand between their rails, which run along y; the jib points along +x, to the water.
"""

from itertools import pairwise
from typing import TypeAlias

import numpy as np

from envgen_usd.assets.asset_design import Model, Part
from envgen_usd.assets.polygon_mesh import Mesh, merge
from envgen_usd.assets.shapes.simple_solids import box, lathe, tube
from envgen_usd.models.array_types import FloatArray

_SQUARE = 4
"""Sides of beams: corners, no curve."""
_STAY = 0.05
"""Radius of stays and ropes, metres."""


def portal_crane(*, large: bool) -> Model:
    """A slewing crane on a portal with a lattice jib: gauge 6 m, 24 m high; or 10.5 m, 38 m."""
    gauge, base, portal, tower, reach, tip = (
        (10.5, 9.0, 9.0, 19.0, 30.0, 38.0) if large else (6.0, 5.5, 6.0, 12.5, 19.0, 24.0)
    )
    head = portal + 0.9
    ring = lathe(np.array([[1.5, head - 0.1], [1.5, head + 0.5], [0.0, head + 0.5]]), 20)
    deck = tower - 3.2
    column = box((-1.1, -1.1, head + 0.4), (1.1, 1.1, deck))
    house = box((-5.2, -1.9, deck), (1.6, 1.9, tower))
    weight = box((-6.6, -1.7, deck + 0.2), (-5.2, 1.7, deck + 2.0))
    apex = np.array([-1.2, 0.0, tower + 0.28 * (tip - tower)])
    frame = [
        _beam((x, y, tower - 0.05), _beside(apex, 0.2 * np.sign(y)), 0.16)
        for x, y in ((1.2, 1.5), (1.2, -1.5), (-4.6, 1.2), (-4.6, -1.2))
    ]
    foot, end = np.array([1.9, 0.0, deck + 0.5]), np.array([reach, 0.0, tip])
    jib = _lattice(foot, end, (1.5, 0.5), 0.09)
    hook = np.array([reach, 0.0, portal + 4.0])
    ropes = [_beam(apex, end, _STAY), _beam(_beside(apex, 0.25), end, _STAY)]
    ropes += [_beam(_beside(end, y, up=-0.2), _beside(hook, y), _STAY) for y in (-0.2, 0.2)]
    block = box(_beside(hook, -0.3, -0.25, -0.9), _beside(hook, 0.3, 0.25))
    cab, pane = _cab(np.array([1.6, 1.0, deck + 0.2]))
    parts = (
        Part("Frame", merge([*_portal(gauge, base, portal), ring, column, *frame, *jib]),
             "paint_blue", "body"),
        Part("House", merge([house, cab]), "paint_grey", "body"),
        Part("Glass", pane, "glass", "body"),
        Part("Ropes", merge([*ropes, block, weight, *_bogies(gauge, base)]), "metal_dark", "body"),
        Part("FrameProxy", merge([*_portal(gauge, base, portal), column,
                                  _beam(foot, end, 0.5)]), "paint_blue", "body", proxy_of="Frame"),
        Part("HouseProxy", house, "paint_grey", "body", proxy_of="House"),
        Part("RopesProxy", merge([_beam(apex, end, 2 * _STAY), weight]), "metal_dark", "body",
             proxy_of="Ropes"),
    )  # fmt: skip
    return Model(parts)


def gantry_crane() -> Model:
    """A crane for containers: gauge 15 m, a boom at 25 m that reaches 30 m over the water."""
    gauge, base, boom, top = 15.0, 13.0, 25.0, 42.0
    half, side = gauge / 2, base / 2
    legs = [
        box((x - 0.6, y - 0.6, 1.6), (x + 0.6, y + 0.6, boom))
        for x in (-half, half)
        for y in (-side, side)
    ]
    sills = [box((x - 0.6, -side + 0.6, 1.6), (x + 0.6, side - 0.6, 2.8)) for x in (-half, half)]
    ties = [box((x - 0.5, -side + 0.6, boom - 1.4), (x + 0.5, side - 0.6, boom)) for x in
            (-half, half)]  # fmt: skip
    sides = [
        box((-half + 0.6, y - 0.45, 10.0), (half - 0.6, y + 0.45, 11.4)) for y in (-side, side)
    ]
    braces = [_beam((-half, y, 11.0), (half, y, boom - 0.8), 0.3) for y in (-side, side)]
    girders = [box((-18.0, y - 0.5, boom), (half + 30.0, y + 0.5, boom + 1.8)) for y in (-3.2, 3.2)]
    across = [
        box((x - 0.3, -2.7, boom + 0.3), (x + 0.3, 2.7, boom + 1.3))
        for x in (-17.5, -half, half, half + 15.0, half + 29.5)
    ]
    mast, stays = _stayed_mast(half, boom + 1.7, np.array([half - 1.5, 0.0, top]))
    house = box((-16.0, -2.5, boom + 1.7), (-7.0, 2.5, boom + 5.2))
    trolley = box((half + 9.0, -2.9, boom - 0.6), (half + 13.0, 2.9, boom + 0.4))
    ropes, spreader = _spreader(np.array([half + 11.0, 0.0, 15.0]))
    cab, pane = _cab(np.array([half + 13.0, 1.6, boom - 2.6]))
    frame = [*legs, *sills, *ties, *sides, *braces, *girders, *across, *mast]
    parts = (
        Part("Frame", merge(frame), "paint_blue", "body"),
        Part("House", merge([house, cab]), "paint_grey", "body"),
        Part("Glass", pane, "glass", "body"),
        Part("Ropes", merge([*stays, *ropes, trolley, spreader, *_bogies(gauge, base)]),
             "metal_dark", "body"),
        Part("FrameProxy", merge([*legs, *girders, *mast]), "paint_blue", "body",
             proxy_of="Frame"),
        Part("HouseProxy", house, "paint_grey", "body", proxy_of="House"),
        Part("RopesProxy", merge([*stays, spreader]), "metal_dark", "body", proxy_of="Ropes"),
    )  # fmt: skip
    return Model(parts)


_Place: TypeAlias = FloatArray | tuple[float, ...]


def _beam(start: _Place, end: _Place, radius: float) -> Mesh:
    return tube(np.array([start, end], dtype=np.float64), np.full(2, radius), _SQUARE)


def _beside(place: FloatArray, left: float, ahead: float = 0.0, up: float = 0.0) -> FloatArray:
    """A place to the left of, ahead of and above another, metres."""
    moved: FloatArray = place + np.array([ahead, left, up])
    return moved


def _stayed_mast(half: float, foot: float, apex: FloatArray) -> tuple[list[Mesh], list[Mesh]]:
    """The mast of a gantry whose rails are twice a half apart, and the stays of its boom."""
    mast = [_beam((half, y, foot), _beside(apex, 0.25 * y), 0.4) for y in (-3.2, 3.2)] + [
        _beam((-half, y, foot), _beside(apex, 0.25 * y), 0.3) for y in (-3.2, 3.2)
    ]
    stays = [
        _beam(_beside(apex, 0.25 * y), (x, y, foot), 0.14)
        for x in (half + 13.0, half + 28.0, -17.0)
        for y in (-3.2, 3.2)
    ]
    return mast, stays


def _spreader(place: FloatArray) -> tuple[list[Mesh], Mesh]:
    """The ropes that hold a frame for containers at a place, and the frame."""
    ropes = [
        _beam(_beside(place, y, x, 0.4), _beside(place, y, x, 9.5), _STAY)
        for x in (-0.9, 0.9)
        for y in (-2.0, 2.0)
    ]
    return ropes, box(_beside(place, -3.0, -1.2), _beside(place, 3.0, 1.2, 0.5))


def _lattice(
    foot: FloatArray, end: FloatArray, widths: tuple[float, float], radius: float
) -> list[Mesh]:
    """Four chords that narrow from foot to end, with diagonals on all sides."""
    along = (end - foot) / np.linalg.norm(end - foot)
    up = np.array([-along[2], 0.0, along[0]])
    corners = [np.array([0.0, y, 0.0]) + z * up for y, z in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    first, last = (w / 2.0 for w in widths)
    chords = [(foot + first * corner, end + last * corner) for corner in corners]
    count = round(float(np.linalg.norm(end - foot)) / 2.1)
    shares = np.linspace(0.0, 1.0, count + 1)
    beams = [_beam(*chord, radius) for chord in chords]
    for number, (near, far) in enumerate(pairwise(shares.tolist())):
        for side in range(4):
            (a, b), (c, d) = chords[side], chords[(side + 1) % 4]
            ends = (a + near * (b - a), c + far * (d - c))
            if number % 2:
                ends = (c + near * (d - c), a + far * (b - a))
            beams.append(_beam(*ends, 0.5 * radius))
    return beams


def _portal(gauge: float, base: float, height: float) -> list[Mesh]:
    """Four legs that lean together, with beams along and across the rails."""
    half, side, high = gauge / 2, base / 2, 0.62
    legs = [
        _beam((x, y, 1.3), (high * x, high * y, height + 0.2), 0.42)
        for x in (-half, half)
        for y in (-side, side)
    ]
    sills = [box((x - 0.35, -side, 1.1), (x + 0.35, side, 1.8)) for x in (-half, half)]
    reach = (high * half + 0.45, high * side + 0.45)
    table = box((-reach[0], -reach[1], height), (reach[0], reach[1], height + 0.9))
    return [*legs, *sills, table]


def _bogies(gauge: float, base: float) -> list[Mesh]:
    """Pairs of wheels in their frames, at the four feet."""
    boxes = []
    for x in (-gauge / 2, gauge / 2):
        for y in (-base / 2, base / 2):
            boxes.append(box((x - 0.3, y - 1.1, 0.45), (x + 0.3, y + 1.1, 1.15)))
            boxes += [
                box((x - 0.12, y + at - 0.32, 0.0), (x + 0.12, y + at + 0.32, 0.5))
                for at in (-0.65, 0.65)
            ]
    return boxes


def _cab(corner: FloatArray) -> tuple[Mesh, Mesh]:
    """A cab with its lower, rear corner at a place, and its front pane."""
    x, y, z = corner.tolist()
    body = box((x - 0.4, y, z), (x + 1.6, y + 1.8, z + 2.3))
    pane = box((x + 1.55, y + 0.15, z + 0.5), (x + 1.64, y + 1.65, z + 2.05))
    return body, pane
