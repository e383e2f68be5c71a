"""Panels of garden fences: 2.5 m along y and 1 m high, with a post at each end.

The post at +y is a little slimmer, so that it vanishes in the first post of the next panel.
"""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from envgen_usd.assets.asset_design import Model, Part
from envgen_usd.assets.polygon_mesh import Mesh, merge
from envgen_usd.assets.shapes.simple_solids import box, flat, tube

_LENGTH, _HEIGHT = 2.5, 1.0
"""Nominal length, between the middles of its posts, and height of a panel, metres."""
_HALF = _LENGTH / 2
_FOOT = -0.02
"""Height of a post's foot, metres; a lower foot covers more unevenness of the ground."""
_SLIM = 0.9
"""Share of a post's width that the post at +y has."""


def fence_panels() -> dict[str, Model]:
    """All designs of fences, default first."""
    return {
        "picket": _picket(),
        "boards": _boards(),
        "rails": _rails(),
        "railing": _railing(),
        "mesh": _mesh(),
    }


def plank(outline: Sequence[tuple[float, float]], low: float, high: float) -> Mesh:
    """A flat board across x, from `low` to `high`; its outline (y, z) runs left about +x."""
    ring = np.array(outline)
    count = len(ring)
    points = np.concatenate([np.c_[np.full(count, x), ring] for x in (low, high)])
    side = np.arange(count)
    beside = (side + 1) % count
    quads = np.stack([side, beside, beside + count, side + count], axis=1)
    sizes = np.array([*[4] * count, count, count])
    return flat(points, sizes, np.concatenate([quads.reshape(-1), side[::-1], side + count]))


def sheet(left: float, right: float, low: float, high: float, x: float = 0.0) -> Mesh:
    """A rectangle across x, for the far mesh: y from `left` to `right`, z from `low` to `high`."""
    ring = np.array([[x, left, low], [x, right, low], [x, right, high], [x, left, high]])
    return flat(ring, np.array([4]), np.arange(4))


def pointed(left: float, right: float, low: float, high: float) -> list[tuple[float, float]]:
    """Outline of a board with a point of half its width, from `low` to `high`."""
    tip = (right - left) / 2
    return [(left, low), (right, low), (right, high - tip), (left + tip, high), (left, high - tip)]


def upright(y: float, width: float, height: float, cap: float = 0.0) -> list[Mesh]:
    """A square post with a flat cap that reaches `cap` over its sides; without one for 0."""
    half = width / 2
    posts = [box((-half, y - half, _FOOT), (half, y + half, height))]
    if cap > 0.0:
        wide = half + cap
        posts.append(box((-wide, y - wide, height), (wide, y + wide, height + 0.02)))
    return posts


def _posts(width: float, height: float, cap: float = 0.0) -> list[Mesh]:
    """The posts at both ends."""
    first = upright(-_HALF, width, height, cap)
    return [*first, *upright(_HALF, width * _SLIM, height - 0.004, cap * _SLIM)]


def _level(low: float, depth: tuple[float, float], thick: float) -> Mesh:
    """A rail from post to post at a height."""
    return box((depth[0], -_HALF, low), (depth[1], _HALF, low + thick))


def _model(name: str, near: list[Mesh], far: list[Mesh], material: str) -> Model:
    return Model(fence_parts(name, near, far, material), (depth_of(near), _LENGTH, _HEIGHT))


def fence_parts(name: str, near: list[Mesh], far: list[Mesh], material: str) -> tuple[Part, Part]:
    """A part of a fence or gate, and its far mesh."""
    return (
        Part(name, merge(near), material, "fence"),
        Part(f"{name}Proxy", merge(far), material, "fence", double_sided=True, proxy_of=name),
    )


def depth_of(meshes: Sequence[Mesh]) -> float:
    """Extent of meshes along x, metres."""
    return round(float(np.ptp(np.concatenate([mesh.points[:, 0] for mesh in meshes]))), 3)


def _strips(count: int, share: float, low: float, high: float) -> list[Mesh]:
    """Upright sheets that together cover a share of the panel."""
    middles = (np.arange(count) + 0.5) / count * _LENGTH - _HALF
    half = share * _LENGTH / count / 2
    return [sheet(y - half, y + half, low, high) for y in middles.tolist()]


def _bands(*heights: tuple[float, float]) -> list[Mesh]:
    """Level sheets over the whole panel."""
    return [sheet(-_HALF, _HALF, low, high, 0.002) for low, high in heights]


def _picket() -> Model:
    """Pointed pickets before two rails."""
    middles = (np.arange(21) + 0.5) / 21 * _LENGTH - _HALF
    pickets = [plank(pointed(y - 0.036, y + 0.036, 0.06, 0.98), 0.022, 0.042) for y in middles]
    rails = [_level(z, (-0.012, 0.022), 0.07) for z in (0.2, 0.72)]
    far = [*_strips(5, 0.62, 0.06, 0.96), *_bands((0.2, 0.27), (0.72, 0.79))]
    return _model("Timber", [*pickets, *rails, *_posts(0.085, 0.98, 0.008)], far, "wood")


def _boards() -> Model:
    """Boards that overlap, so that none can look through, below a capping."""
    edges = np.linspace(-_HALF + 0.03, _HALF - 0.03, 21)
    boards = []
    for number, (left, right) in enumerate(pairwise(edges.tolist())):
        x = 0.012 if number % 2 else 0.0
        boards.append(box((x, left - 0.01, 0.1), (x + 0.016, right + 0.01, 0.945)))
    gravel = _level(0.0, (-0.008, 0.024), 0.11)
    rails = [_level(z, (-0.045, 0.0), 0.07) for z in (0.22, 0.74)]
    capping = box((-0.03, -_HALF, 0.945), (0.055, _HALF, 0.97))
    far = _bands((0.0, 0.97))
    near = [*boards, gravel, *rails, capping, *_posts(0.09, 0.98, 0.006)]
    return _model("Timber", near, far, "wood")


def _rails() -> Model:
    """Three boards between posts, as around paddocks."""
    levels = (0.18, 0.49, 0.8)
    rails = [_level(z, (0.02, 0.045), 0.13) for z in levels]
    posts = [*_posts(0.1, 1.0), *upright(0.0, 0.08, 0.97)]
    far = [*_bands(*((z, z + 0.13) for z in levels)), *_strips(2, 0.08, 0.0, 0.98)]
    return _model("Timber", [*rails, *posts], far, "wood")


def _railing() -> Model:
    """Square iron bars with spear heads on a low kerb of iron."""
    middles = (np.arange(20) + 0.5) / 20 * _LENGTH - _HALF
    bars = []
    for y in middles.tolist():
        path = np.array([[0.0, y, 0.06], [0.0, y, 0.86], [0.0, y, 0.9], [0.0, y, 1.0]])
        bars.append(tube(path, np.array([0.009, 0.009, 0.022, 0.001]), 4, caps=False))
    rails = [_level(z, (-0.02, 0.02), 0.012) for z in (0.1, 0.8)]
    near = [*bars, *rails, *_posts(0.05, 0.96, 0.012)]
    far = [*_strips(5, 0.16, 0.06, 0.96), *_bands((0.1, 0.125), (0.79, 0.815))]
    return _model("Iron", near, far, "paint_black")


def _mesh() -> Model:
    """A welded grid of rods between posts of steel."""
    middles = np.linspace(-_HALF + 0.06, _HALF - 0.06, 40)
    rods = [
        tube(np.array([[0.0, y, 0.04], [0.0, y, 0.98]]), np.full(2, 0.0042), 3, caps=False)
        for y in middles.tolist()
    ]
    lines = [
        box((x - 0.004, -_HALF, z), (x + 0.004, _HALF, z + 0.008))
        for z in (0.06, 0.28, 0.5, 0.72, 0.94)
        for x in (-0.008, 0.008)
    ]
    near = [*rods, *lines, *_posts(0.06, 1.0)]
    far = [*_strips(6, 0.13, 0.04, 0.98), *_bands(*((z, z + 0.016) for z in (0.06, 0.5, 0.94)))]
    return _model("Iron", near, far, "metal_galvanised")
