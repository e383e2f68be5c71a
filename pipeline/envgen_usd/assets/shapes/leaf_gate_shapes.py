"""Gates in garden fences and across driveways: leaves between two posts, along y.

They face the street at +x and are closed. The posts belong to the gate.
"""

from collections.abc import Callable
from itertools import pairwise

import numpy as np

from envgen_usd.assets.asset_design import Model, Part
from envgen_usd.assets.polygon_mesh import Mesh, merge
from envgen_usd.assets.shapes.fence_shapes import (
    depth_of,
    fence_parts,
    plank,
    pointed,
    sheet,
    upright,
)
from envgen_usd.assets.shapes.simple_solids import box, tube

_Leaf = Callable[[float, float], list[Mesh]]
"""Makes the leaf between two heights of y, metres."""


def garden_gates() -> dict[str, Model]:
    """Gates of one leaf, 1.2 m wide and 1 m high, default first."""
    return _gates(1.2, leaves=1)


def drive_gates() -> dict[str, Model]:
    """Gates of two leaves, 3.2 m wide and 1 m high, default first."""
    return _gates(3.2, leaves=2)


def yard_gate() -> Model:
    """A sliding gate of 7 m on a beam, 1.8 m high, as before warehouses."""
    half = 3.5
    middles = np.linspace(-half + 0.2, half - 0.2, 48)
    bars = [box((-0.012, y - 0.012, 0.2), (0.012, y + 0.012, 1.72)) for y in middles.tolist()]
    frame = [
        box((-0.05, -half + 0.08, 0.06), (0.05, half - 0.08, 0.2)),
        box((-0.03, -half + 0.08, 1.7), (0.03, half - 0.08, 1.76)),
        *(box((-0.03, y - 0.03, 0.2), (0.03, y + 0.03, 1.7)) for y in (-half + 0.12, half - 0.12)),
    ]
    posts = [mesh for y in (-half + 0.06, half - 0.06) for mesh in upright(y, 0.118, 1.8)]
    strips = np.linspace(-half + 0.4, half - 0.4, 10)
    far = [sheet(y - 0.06, y + 0.06, 0.2, 1.72) for y in strips.tolist()]
    far += [sheet(-half, half, 0.06, 0.2, 0.01), sheet(-half, half, 1.7, 1.76, 0.01)]
    far += [sheet(y - 0.06, y + 0.06, 0.0, 1.8, 0.02) for y in (-half + 0.06, half - 0.06)]
    return Model(
        fence_parts("Iron", [*bars, *frame, *posts], far, "metal_galvanised"), (0.118, 7.0, 1.8)
    )


def _gates(width: float, leaves: int) -> dict[str, Model]:
    """The three designs in a width; what is wood has posts of wood."""
    timber = {"picket": _picket_leaf, "boards": _board_leaf}
    found = {
        name: _gate(width, leaves, leaf, ("Timber", "wood", 0.1)) for name, leaf in timber.items()
    }
    return {**found, "railing": _gate(width, leaves, _iron_leaf, ("Iron", "paint_black", 0.07))}


def _gate(width: float, leaves: int, leaf: _Leaf, look: tuple[str, str, float]) -> Model:
    """Leaves between posts, with hinges and a latch; `look` is part, material, post's width."""
    name, material, post = look
    half = width / 2
    edges = np.linspace(-half + post + 0.015, half - post - 0.015, leaves + 1)
    near: list[Mesh] = []
    fittings: list[Mesh] = []
    far = [
        sheet(y - post / 2, y + post / 2, 0.0, 1.0, 0.01)
        for y in (-half + post / 2, half - post / 2)
    ]
    for number, (left, right) in enumerate(pairwise(edges.tolist())):
        # Leaves of a pair leave a slit of 2 cm in the middle.
        near += leaf(left + 0.01 * (number > 0), right - 0.01 * (number < leaves - 1))
        hinge = (left, left + 0.28) if number == 0 else (right - 0.28, right)
        fittings += [
            box((0.03, hinge[0] - 0.02, z), (0.046, hinge[1], z + 0.035)) for z in (0.2, 0.72)
        ]
        count = max(round((right - left) / 0.5), 2)
        share = 0.16 if name == "Iron" else 0.7
        for y in (left + (np.arange(count) + 0.5) / count * (right - left)).tolist():
            wide = share * (right - left) / count / 2
            far.append(sheet(y - wide, y + wide, 0.08, 0.92))
        far += [sheet(left, right, z, z + 0.06, 0.004) for z in (0.18, 0.74)]
    for y in (-half + post / 2, half - post / 2):
        near += upright(y, post, 0.98, 0.012)
    latch = edges[1] if leaves == 2 else edges[1] - 0.05
    fittings.append(box((0.04, latch - 0.09, 0.52), (0.075, latch + 0.05, 0.55)))
    metal = Part("Fittings", merge(fittings), "metal_dark", "fence")
    parts = (*fence_parts(name, near, far, material), metal)
    return Model(parts, (depth_of([*near, *fittings]), width, 1.0))


def _braced(left: float, right: float) -> list[Mesh]:
    """Two ledges and a brace behind the boards of a wooden leaf."""
    ledges = [box((-0.012, left, z), (0.02, right, z + 0.08)) for z in (0.18, 0.74)]
    brace = [(left, 0.26), (left + 0.1, 0.26), (right, 0.74), (right - 0.1, 0.74)]
    return [*ledges, plank(brace, -0.008, 0.018)]


def _picket_leaf(left: float, right: float) -> list[Mesh]:
    count = max(round((right - left) / 0.12), 4)
    middles = left + (np.arange(count) + 0.5) / count * (right - left)
    pickets = [plank(pointed(y - 0.036, y + 0.036, 0.07, 0.97), 0.02, 0.04) for y in middles]
    return [*_braced(left, right), *pickets]


def _board_leaf(left: float, right: float) -> list[Mesh]:
    count = max(round((right - left) / 0.14), 4)
    edges = np.linspace(left, right, count + 1)
    boards = [
        box((0.02, low + 0.002, 0.06), (0.04, high - 0.002, 0.96))
        for low, high in pairwise(edges.tolist())
    ]
    return [*_braced(left, right), *boards]


def _iron_leaf(left: float, right: float) -> list[Mesh]:
    """A frame with bars whose spear heads stand above it, and a scroll plate at mid-height."""
    count = max(round((right - left) / 0.12), 4)
    middles = left + (np.arange(count) + 0.5) / count * (right - left)
    bars = []
    for y in middles.tolist():
        path = np.array([[0.0, y, 0.1], [0.0, y, 0.86], [0.0, y, 0.9], [0.0, y, 0.98]])
        bars.append(tube(path, np.array([0.008, 0.008, 0.02, 0.001]), 4, caps=False))
    frame = [box((-0.016, left, z), (0.016, right, z + 0.03)) for z in (0.08, 0.5, 0.8)]
    frame += [box((-0.015, y - 0.015, 0.06), (0.015, y + 0.015, 0.86))
              for y in (left + 0.015, right - 0.015)]  # fmt: skip
    return [*bars, *frame]
