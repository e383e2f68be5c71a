"""What is fixed to houses: gutters, pipes, courses, cornices, chimney pots, aerials, dishes.

Each stands before a wall at x = 0, faces +x and has its width along y; its lowest point is z = 0.
"""

import numpy as np

from envgen_usd.assets.asset_design import Model, Part
from envgen_usd.assets.polygon_mesh import Mesh, merge
from envgen_usd.assets.shapes.shop_shapes import standing_part
from envgen_usd.assets.shapes.simple_solids import box, flat, lathe, moved, tube, turned
from envgen_usd.assets.shapes.window_shapes import Box
from envgen_usd.models.array_types import FloatArray


def _profiled(profile: FloatArray, half: float) -> Mesh:
    """A body along y with a closed cross-section (N x 2: x, z; counter-clockwise seen from -y)."""
    count = len(profile)
    ends = [np.c_[profile[:, 0], np.full(count, y), profile[:, 1]] for y in (-half, half)]
    points = np.concatenate(ends)
    side = np.arange(count)
    beside = (side + 1) % count
    quads = np.stack([side, beside, beside + count, side + count], axis=1)
    sizes = np.array([*[4] * count, count, count])
    caps = [side, side[::-1] + count]
    return flat(points, sizes, np.concatenate([quads[:, ::-1].reshape(-1), *caps]))


def gutter() -> Model:
    """A half-round gutter of 6 m on brackets."""
    angle = np.linspace(np.pi, 2 * np.pi, 7)
    outer = np.c_[0.065 + 0.06 * np.cos(angle), 0.065 + 0.06 * np.sin(angle)]
    inner = np.c_[0.065 + 0.052 * np.cos(angle[::-1]), 0.065 + 0.052 * np.sin(angle[::-1])]
    trough = _profiled(np.concatenate([outer, inner]), 3.0)
    brackets = [
        box((0.0, y - 0.015, 0.0), (0.128, y + 0.015, 0.01)) for y in (-2.4, -1.2, 0, 1.2, 2.4)
    ]
    far = _profiled(np.array([[0.005, 0.065], [0.02, 0.01], [0.11, 0.01], [0.125, 0.065]]), 3.0)
    parts = (
        Part("Trough", merge([trough, *brackets]), "paint_black", "body"),
        Part("TroughProxy", far, "paint_black", "body", proxy_of="Trough"),
    )
    return Model(parts)


def downpipe() -> Model:
    """A rainwater pipe of 6 m with a hopper, clips, and a shoe at its foot."""
    path = np.array([[0.16, 0.0, 0.0], [0.1, 0.0, 0.1], [0.08, 0.0, 0.2], [0.08, 0.0, 5.8]])
    pipe = tube(path, np.full(4, 0.038), 10)
    clips = [box((0.0, -0.07, z), (0.124, 0.07, z + 0.025)) for z in (0.4, 2.1, 3.8, 5.4)]
    hopper = box((0.0, -0.11, 5.74), (0.19, 0.11, 6.0))
    far = [tube(path[[0, 2, 3]], np.full(3, 0.04), 3, caps=False), hopper]
    parts = (
        Part("Pipe", merge([pipe, hopper, *clips]), "paint_black", "body"),
        Part("PipeProxy", merge(far), "paint_black", "body", proxy_of="Pipe"),
    )
    return Model(parts)


def stone_course() -> Model:
    """A moulded band of 6 m between two storeys."""
    profile = np.array(
        [[0.0, 0.0], [0.035, 0.0], [0.035, 0.10], [0.06, 0.12], [0.06, 0.155], [0.0, 0.175]]
    )
    return Model((Part("Band", _profiled(profile, 3.0), "trim_stone", "body"),))


def cornice() -> Model:
    """A cornice of 6 m with dentils below the edge of a roof."""
    profile = np.array(
        [[0.0, 0.0], [0.05, 0.0], [0.05, 0.07], [0.1, 0.1], [0.1, 0.2], [0.24, 0.24], [0.24, 0.29],
         [0.3, 0.33], [0.3, 0.36], [0.0, 0.4]]
    )  # fmt: skip
    dentils = [
        box((0.099, y - 0.05, 0.13), (0.17, y + 0.05, 0.2)) for y in np.linspace(-2.9, 2.9, 24)
    ]
    body = _profiled(profile, 3.0)
    parts = (
        Part("Band", merge([body, *dentils]), "trim_stone", "body"),
        Part("BandProxy", body, "trim_stone", "body", proxy_of="Band"),
    )
    return Model(parts)


def chimney_pots(*, count: int) -> Model:
    """Terracotta pots in a row on a flaunching."""
    profile = np.array(
        [
            [0.11, 0.04],
            [0.13, 0.06],
            [0.115, 0.12],
            [0.1, 0.34],
            [0.125, 0.36],
            [0.12, 0.42],
            [0.08, 0.42],
        ]
    )
    places = np.linspace(-0.17, 0.17, count) if count > 1 else np.zeros(1)
    pots = [moved(lathe(profile, 10), (0.0, float(y), 0.0)) for y in places]
    foot = box((-0.2, -0.3, 0.0), (0.2, 0.3, 0.045))
    return Model(
        (
            Part("Pots", merge(pots), "terracotta", "body"),
            Part("Foot", foot, "concrete", "body"),
        )
    )


def aerial() -> Model:
    """A television aerial on a mast: a boom with rods, seen against the sky."""
    mast = tube(np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 2.0]]), np.full(2, 0.018), 6)
    boom = tube(np.array([[-0.3, 0.0, 1.9], [0.75, 0.0, 1.9]]), np.full(2, 0.012), 5)
    rods = [
        tube(np.array([[x, -half, 1.9], [x, half, 1.9]]), np.full(2, 0.006), 4)
        for x, half in zip(np.linspace(-0.22, 0.72, 9), np.linspace(0.36, 0.2, 9), strict=True)
    ]
    return Model((Part("Aerial", merge([mast, boom, *rods]), "metal_galvanised", "body"),))


def satellite_dish() -> Model:
    """A dish on a wall bracket, turned up to the sky in the direction it faces."""
    radius = np.array([0.005, 0.12, 0.22, 0.3])
    profile = np.c_[radius, 0.7 * radius**2]
    rings = lathe(np.concatenate([profile, profile[::-1] + np.array([0.0, 0.012])]), 18)
    tilt = np.radians(62.0)
    lean = np.array(
        [[np.cos(tilt), 0.0, np.sin(tilt)], [0.0, 1.0, 0.0], [-np.sin(tilt), 0.0, np.cos(tilt)]]
    )
    dish = moved(turned(rings, lean), (0.28, 0.0, 0.32))
    arm = tube(np.array([[0.3, 0.0, 0.18], [0.62, 0.0, 0.44]]), np.full(2, 0.012), 5)
    head: list[Box] = [((0.58, -0.03, 0.4), (0.67, 0.03, 0.48))]
    wall: list[Box] = [
        ((0.0, -0.07, 0.16), (0.012, 0.07, 0.36)),
        ((0.0, -0.02, 0.24), (0.26, 0.02, 0.28)),
    ]
    parts = (
        Part("Dish", dish, "paint_grey", "body", double_sided=True),
        Part("Arm", arm, "metal_dark", "body"),
        standing_part("Bracket", [*head, *wall], "metal_dark"),
    )
    low = min(float(part.mesh.points[:, 2].min()) for part in parts)
    lowered = tuple(
        Part(part.name, moved(part.mesh, (0.0, 0.0, -low)), part.material, "body",
             double_sided=part.double_sided) for part in parts
    )  # fmt: skip
    return Model(lowered)
