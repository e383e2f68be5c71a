"""Gates and garage doors in a unit box: x along the width, z up, y out of the wall in metres.

Their scale is (width, 1, height); they cover the plain panel that closes the opening.
"""

from itertools import pairwise

import numpy as np

from envgen_usd.assets.asset_design import Model, Part
from envgen_usd.assets.polygon_mesh import Mesh, merge
from envgen_usd.assets.shapes.simple_solids import box, flat, raised
from envgen_usd.assets.shapes.window_shapes import LAP, pane


def _frame(side: float, end: float, depth: float) -> list[Mesh]:
    """Four bars around the unit square; `side` and `end` are shares of its width and height."""
    return [
        box((0.0, 0.0, 0.0), (side, depth, 1.0)),
        box((1 - side, 0.0, 0.0), (1.0, depth, 1.0)),
        box((side - LAP, 0.0, 0.0), (1 - side + LAP, depth - LAP, end)),
        box((side - LAP, 0.0, 1 - end), (1 - side + LAP, depth - LAP, 1.0)),
    ]


def gate() -> Model:
    """A sectional gate: five sections, a row of small lights, a frame."""
    frame = merge([bar for i, bar in enumerate(_frame(0.025, 0.03, 0.08)) if i != 2])
    edges = np.linspace(0.0, 0.97, 6)
    sections = [
        box((0.025, 0.0, low + 0.004), (0.975, 0.045, high - 0.004))
        for low, high in pairwise(edges)
    ]
    low, high = edges[2] + 0.05, edges[3] - 0.05
    lights = merge([pane((x, low), (x + 0.14, high), 0.048) for x in (0.08, 0.31, 0.55, 0.78)])
    parts = (
        Part("Frame", frame, "metal_dark", "door_frame"),
        Part("Leaf", merge(sections), "paint_grey", "door_leaf"),
        Part("Pane", lights, "glass", "door_pane"),
    )
    return Model(parts, (1.0, 0.08, 1.0))


def barn_gate() -> Model:
    """A gate of two leaves of vertical boards with rails and braces, on long hinges."""
    boards, bands = [], []
    for start, end in ((0.012, 0.4975), (0.5025, 0.988)):
        edges = np.linspace(start, end, 9)
        boards += [
            box((left, 0.0, 0.012), (right - 0.002, 0.04, 0.985)) for left, right in pairwise(edges)
        ]
        boards += [
            box((start + LAP, 0.03, low), (end - LAP, 0.07, low + 0.055))
            for low in (0.06, 0.48, 0.90)
        ]
        for low in (0.115, 0.535):
            boards.append(_brace((start + 0.01, low), (end - 0.01, low + 0.365), 0.03))
        left = start < 0.25
        for low in (0.075, 0.915):
            inner = (start, start + 0.3) if left else (end - 0.3, end)
            bands.append(box((inner[0], 0.068, low), (inner[1], 0.078, low + 0.018)))
    bands.append(box((0.47, 0.068, 0.50), (0.53, 0.085, 0.515)))
    frame = merge(
        [
            box((-0.02, 0.0, 0.0), (0.012, 0.09, 1.0)),
            box((0.988, 0.0, 0.0), (1.02, 0.09, 1.0)),
            box((-0.02, 0.0, 0.985), (1.02, 0.10, 1.03)),
        ]
    )
    parts = (
        Part("Frame", frame, "wood", "door_frame"),
        Part("Leaf", merge(boards), "wood", "door_leaf"),
        Part("Handle", merge(bands), "metal_dark", "door_handle"),
    )
    return Model(parts, (1.0, 0.1, 1.0))


def _brace(low: tuple[float, float], high: tuple[float, float], wide: float) -> Mesh:
    """A slanting board from one corner (x, z) to another one, in shares of the gate."""
    (x0, z0), (x1, z1) = low, high
    foot = np.array([[x0, z0], [x0 + wide, z0], [x1, z1], [x1 - wide, z1]])
    points = np.concatenate(
        [np.c_[foot[:, 0], np.full(4, depth), foot[:, 1]] for depth in (0.065, 0.03)]
    )
    faces = [[3, 2, 1, 0], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]
    return flat(points, np.full(6, 4), np.array(faces).reshape(-1))


def sectional_garage() -> Model:
    """A garage door of four sections with pressed panels, a handle, and a frame."""
    leaf = []
    for low, high in pairwise(np.linspace(0.0, 0.96, 5)):
        leaf.append(box((0.03, 0.0, low + 0.003), (0.97, 0.035, high - 0.003)))
        for left in (0.055, 0.285, 0.515, 0.745):
            foot, face = (left, 0.033, low + 0.04), (left + 0.2, 0.049, high - 0.04)
            leaf.append(raised(foot, face, (0.02, 0.025)))
    handle = box((0.46, 0.035, 0.20), (0.54, 0.065, 0.215))
    return _garage(leaf, handle)


def wooden_garage() -> Model:
    """A garage gate of two leaves of vertical boards, with bands, hinges and a handle."""
    leaf = []
    for start, end in ((0.03, 0.4985), (0.5015, 0.97)):
        edges = np.linspace(start, end, 7)
        leaf += [
            box((left, 0.0, 0.01), (right - 0.003, 0.035, 0.96)) for left, right in pairwise(edges)
        ]
        leaf += [
            box((start + LAP, 0.0, low), (end - LAP, 0.05, low + 0.06)) for low in (0.14, 0.76)
        ]
    handle = merge(
        [
            box((0.52, 0.05, 0.44), (0.535, 0.08, 0.53)),
            *(
                box((left, 0.05, low + 0.02), (left + 0.16, 0.058, low + 0.04))
                for left in (0.035, 0.805)
                for low in (0.14, 0.76)
            ),
        ]
    )
    return _garage(leaf, handle)


def _garage(leaf: list[Mesh], fittings: Mesh) -> Model:
    frame = merge([bar for i, bar in enumerate(_frame(0.03, 0.04, 0.07)) if i != 2])
    parts = (
        Part("Frame", frame, "paint_white", "door_frame"),
        Part("Leaf", merge(leaf), "paint_white", "door_leaf"),
        Part("Handle", fittings, "metal_dark", "door_handle"),
    )
    return Model(parts, (1.0, 0.08, 1.0))
