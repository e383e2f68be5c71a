"""Traffic lights; their lenses face +x, and a phase lights one of them, or red with amber."""

from dataclasses import dataclass, replace

import numpy as np

from envgen_usd.assets.asset_design import AssetDesign, Model, Part
from envgen_usd.assets.polygon_mesh import Mesh, merge
from envgen_usd.assets.shapes.simple_solids import box, flat, moved, post, tube

_LIGHT = "traffic_light"
"""Class of heads and lenses; their posts are poles."""
_LENSES = ("Red", "Amber", "Green")
_PHASES = {
    "red": ("Red",),
    "red_amber": ("Red", "Amber"),
    "amber": ("Amber",),
    "green": ("Green",),
    "off": (),
}
"""Lit lenses of each phase (Vienna Convention on Road Signs and Signals, article 23)."""


@dataclass(frozen=True)
class _Head:
    """A head of lenses; metres.

    Attributes:
        lenses: Names of its lenses from the top.
        diameter: Of a lens: 0.2 or 0.3 (EN 12368).
        foot: Height of its lower edge.
        board: Margin of the board behind it; 0 without one.
        post: Radius of the post.
    """

    lenses: tuple[str, ...]
    diameter: float
    foot: float
    board: float
    post: float


_HEADS = {
    "post": _Head(_LENSES, 0.2, 2.55, 0.0, 0.055),
    "board": _Head(_LENSES, 0.2, 2.40, 0.14, 0.057),
    "large": _Head(_LENSES, 0.3, 2.60, 0.0, 0.07),
    "pedestrian": _Head(("Red", "Green"), 0.2, 2.20, 0.0, 0.055),
}


def traffic_light_design() -> AssetDesign:
    """The traffic lights: designs, phases, and the colour of the housing."""
    heads = {
        name: {"Head": f"paint_{name}", "HeadProxy": f"paint_{name}"}
        for name in ("black", "green", "yellow")
    }
    phases = {
        phase: {
            lens: f"lens_{lens.lower()}_lit" if lens in lit else f"lens_{lens.lower()}"
            for lens in _LENSES
        }
        for phase, lit in _PHASES.items()
    }
    models = {name: _light(head) for name, head in _HEADS.items()}
    looks = {"phase": phases, "housing": heads}
    return AssetDesign("traffic_light", "traffic_light", "pole", models, "design", looks)


def _light(head: _Head) -> Model:
    cell = head.diameter + 0.1
    top = head.foot + cell * len(head.lenses)
    half = cell / 2
    front = head.post + 0.22
    body = box((head.post + 0.02, -half, head.foot), (front, half, top))
    heights = [top - cell * (number + 0.5) for number in range(len(head.lenses))]
    hoods = [moved(_hood(head.diameter * 0.58), (front, 0.0, z)) for z in heights]
    brackets = [
        tube(np.array([[0.0, 0.0, z], [head.post + 0.04, 0.0, z]]), np.full(2, 0.025), 8)
        for z in (head.foot + 0.1, top - 0.1)
    ]
    metal = [post(top + 0.06, head.post, 12), box((-0.14, -0.14, 0.0), (0.14, 0.14, 0.02))]
    parts = [
        Part("Post", merge([*metal, *brackets]), "metal_galvanised", "post"),
        Part("Head", merge([body, *hoods]), "paint_black", "signal_head", of_class=_LIGHT),
    ]
    parts += [
        replace(parts[0], name="PostProxy", mesh=post(top + 0.06, head.post, 4), proxy_of="Post"),
        replace(parts[1], name="HeadProxy", mesh=body, proxy_of="Head"),
    ]
    parts += [
        Part(name, moved(_lens(head.diameter / 2), (front, 0.0, z)), f"lens_{name.lower()}",
             "lens", of_class=_LIGHT)
        for name, z in zip(head.lenses, heights, strict=True)
    ]  # fmt: skip
    if head.board:
        parts += _board(head, half, top)
    return Model(tuple(parts))


def _board(head: _Head, half: float, top: float) -> list[Part]:
    """A dark board with a white edge behind the head."""
    x, reach, edge = head.post + 0.05, half + head.board, 0.05
    low, high = head.foot - head.board, top + head.board
    dark = box((x, -reach, low), (x + 0.012, reach, high))
    bars = [
        box((x - 0.002, side * reach - edge / 2, low), (x + 0.016, side * reach + edge / 2, high))
        for side in (-1, 1)
    ]
    bars += [
        box((x - 0.002, -reach, z - edge / 2), (x + 0.016, reach, z + edge / 2))
        for z in (low, high)
    ]
    return [
        Part("Board", dark, "paint_black", "signal_head", of_class=_LIGHT),
        Part("Edge", merge(bars), "paint_white", "signal_head", of_class=_LIGHT),
    ]


def _lens(radius: float) -> Mesh:
    """A domed lens at the origin: rings of 20 corners, and a disc in the middle."""
    angle = np.linspace(0.0, 2 * np.pi, 20, endpoint=False)
    circle = np.stack([np.zeros(20), np.cos(angle), np.sin(angle)], axis=1)
    steps = ((0.0, 1.0), (0.012, 0.8), (0.02, 0.4))
    rings = np.stack([circle * radius * share + (x, 0.0, 0.0) for x, share in steps])
    ring, k = np.meshgrid(np.arange(2), np.arange(20), indexing="ij")
    beside = (k + 1) % 20
    quads = np.stack(
        [ring * 20 + k, ring * 20 + beside, (ring + 1) * 20 + beside, (ring + 1) * 20 + k], -1
    )
    corners = np.concatenate([quads.reshape(-1), 40 + np.arange(20)])
    return flat(rings.reshape(-1, 3), np.array([*([4] * 40), 20]), corners)


def _hood(radius: float) -> Mesh:
    """A half tube over a lens, 0.9 of its radius deep and more: outer side, edge, inner side."""
    angle = np.linspace(np.pi * 0.02, np.pi * 0.98, 9)
    arc = np.stack([np.zeros(9), np.cos(angle), np.sin(angle)], axis=1)
    depth = 1.2 * radius
    lines = [(0.0, radius), (depth, radius), (depth, radius - 0.008), (0.0, radius - 0.008)]
    rings = np.stack([arc * size + np.array([x, 0.0, 0.0]) for x, size in lines])
    ring, k = np.meshgrid(np.arange(3), np.arange(8), indexing="ij")
    quads = np.stack(
        [ring * 9 + k, ring * 9 + k + 1, (ring + 1) * 9 + k + 1, (ring + 1) * 9 + k], -1
    )
    return flat(rings.reshape(-1, 3), np.full(24, 4), quads.reshape(-1))
