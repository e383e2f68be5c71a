"""Balconies over the street: a slab with a rail on three sides, before a wall at x = 0.

They face +x; their width lies along y, and the underside of the slab is z = 0.
"""

import numpy as np

from envgen_usd.assets.asset_design import Model, Part
from envgen_usd.assets.polygon_mesh import Mesh, merge
from envgen_usd.assets.shapes.fence_shapes import sheet
from envgen_usd.assets.shapes.simple_solids import box, flat, tube

_DEPTH, _HALF, _SLAB, _TOP = 1.1, 1.2, 0.16, 1.2
"""Depth, half width, thickness of the slab and height, metres."""
_OUT = _DEPTH - 0.05
"""Distance of the front rail from the wall, metres."""
_SIDE = _HALF - 0.05


def balconies() -> dict[str, Model]:
    """All designs, default first."""
    return {
        "bars": _model(_bars(), []),
        "panels": _model(_posts(), _filling(0.24, 1.08, 0.012), fill="paint_white"),
        "glass": _model(_posts(), _filling(0.26, 1.1, 0.008), fill="glass"),
    }


def _model(rail: list[Mesh], filling: list[Mesh], fill: str = "") -> Model:
    slab = [
        box((0.0, -_HALF, 0.03), (_DEPTH, _HALF, _SLAB)),
        box((0.0, -_HALF + 0.06, 0.0), (_DEPTH - 0.06, _HALF - 0.06, 0.03)),
    ]
    parts = [
        Part("Slab", merge(slab), "concrete", "floor"),
        Part("Rail", merge([*rail, *_handrail()]), "paint_black", "railing"),
        Part("RailProxy", merge(_far_rail(bars=not filling)), "paint_black", "railing",
             double_sided=True, proxy_of="Rail"),
    ]  # fmt: skip
    if filling:
        part = "pane" if fill == "glass" else "railing"
        parts.append(Part("Filling", merge(filling), fill, part))
    return Model(tuple(parts), (_DEPTH, 2 * _HALF, _TOP))


def _handrail() -> list[Mesh]:
    """A rail on three sides."""
    low, high = _TOP - 0.045, _TOP
    return [
        box((_OUT - 0.03, -_SIDE - 0.03, low), (_OUT + 0.03, _SIDE + 0.03, high)),
        *(box((0.0, y - 0.03, low), (_OUT - 0.03, y + 0.03, high)) for y in (-_SIDE, _SIDE)),
    ]


def _uprights(half: float) -> list[Mesh]:
    """Posts at the corners, at the wall and along the front."""
    places = [(_OUT, y) for y in np.linspace(-_SIDE, _SIDE, 4).tolist()]
    places += [(0.03, y) for y in (-_SIDE, _SIDE)]
    return [
        box((x - half, y - half, _SLAB - 0.01), (x + half, y + half, _TOP - 0.04))
        for x, y in places
    ]


def _posts() -> list[Mesh]:
    """Posts and a lower rail that hold a filling."""
    low = [box((_OUT - 0.015, -_SIDE, 0.215), (_OUT + 0.015, _SIDE, 0.24))]
    low += [box((0.03, y - 0.015, 0.215), (_OUT, y + 0.015, 0.24)) for y in (-_SIDE, _SIDE)]
    return [*_uprights(0.02), *low]


def _bars() -> list[Mesh]:
    """Upright bars on a lower rail."""
    front = np.linspace(-_SIDE, _SIDE, 23)[1:-1].tolist()
    sides = np.linspace(0.03, _OUT, 10)[1:-1].tolist()
    places = [(_OUT, y) for y in front] + [(x, y) for x in sides for y in (-_SIDE, _SIDE)]
    bars = [
        tube(np.array([[x, y, 0.23], [x, y, _TOP - 0.03]]), np.full(2, 0.009), 4, caps=False)
        for x, y in places
    ]
    return [*bars, *_posts()]


def _filling(low: float, high: float, half: float) -> list[Mesh]:
    """Sheets between the posts on three sides."""
    edges = np.linspace(-_SIDE, _SIDE, 4)
    front = [
        box((_OUT - half, left + 0.03, low), (_OUT + half, right - 0.03, high))
        for left, right in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True)
    ]
    sides = [box((0.06, y - half, low), (_OUT - 0.03, y + half, high)) for y in (-_SIDE, _SIDE)]
    return [*front, *sides]


def _across(y: float, low: float, high: float, from_x: float, to_x: float) -> Mesh:
    """A rectangle across y."""
    ring = np.array([[from_x, y, low], [to_x, y, low], [to_x, y, high], [from_x, y, high]])
    return flat(ring, np.array([4]), np.arange(4))


def _far_rail(*, bars: bool) -> list[Mesh]:
    """Sheets in place of the rails, and few wide ones in place of the bars."""
    levels = [(0.2, 0.24), (_TOP - 0.06, _TOP)]
    far = [sheet(-_SIDE, _SIDE, low, high, _OUT) for low, high in levels]
    far += [_across(y, low, high, 0.0, _OUT) for low, high in levels for y in (-_SIDE, _SIDE)]
    if bars:
        middles = np.linspace(-_SIDE, _SIDE, 7)[1:-1].tolist()
        far += [sheet(y - 0.035, y + 0.035, 0.24, _TOP - 0.06, _OUT) for y in middles]
    return far
