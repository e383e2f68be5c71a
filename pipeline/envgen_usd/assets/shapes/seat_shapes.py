"""Benches, bins and hydrants of further designs; users stand at, or face, +x."""

import numpy as np

from envgen_usd.assets.asset_design import Model, Part
from envgen_usd.assets.polygon_mesh import Mesh, merge
from envgen_usd.assets.shapes.simple_solids import box, lathe, moved, post, tube


def stone_bench() -> Model:
    """A slab of 1.9 m on two blocks."""
    slab = box((-0.02, -0.95, 0.36), (0.42, 0.95, 0.46))
    blocks = [box((0.04, y - 0.14, 0.0), (0.36, y + 0.14, 0.36)) for y in (-0.6, 0.6)]
    return Model((Part("Slats", merge([slab, *blocks]), "concrete", "seat"),))


def steel_bench() -> Model:
    """A bench of round bars on three frames, with arms."""
    seat = [_rod(x, z) for x, z in ((0.02, 0.44), (0.11, 0.43), (0.20, 0.43), (0.29, 0.44))]
    back = [_rod(x, z) for x, z in ((-0.05, 0.56), (-0.08, 0.66), (-0.11, 0.76), (-0.14, 0.85))]
    frames = []
    for y in (-0.85, 0.0, 0.85):
        path = [(-0.16, y, 0.88), (-0.02, y, 0.42), (0.32, y, 0.42), (0.36, y, 0.0)]
        frames.append(tube(np.array(path), np.full(4, 0.025), 6))
        frames.append(tube(np.array([(-0.02, y, 0.42), (-0.10, y, 0.0)]), np.full(2, 0.025), 6))
    return Model(
        (
            Part("Slats", merge([*seat, *back]), "metal_dark", "seat"),
            Part("Frame", merge(frames), "metal_dark", "frame"),
        )
    )


def _rod(x: float, z: float) -> Mesh:
    return tube(np.array([(x, -0.9, z), (x, 0.9, z)]), np.full(2, 0.018), 6)


def pillar_bin() -> Model:
    """A closed round bin of 1.15 m with an opening towards +x and -x."""
    body = lathe(np.array([[0.25, 0.0], [0.27, 0.03], [0.27, 0.80]]), 16)
    lid = lathe(np.array([[0.28, 0.98], [0.28, 1.06], [0.18, 1.13], [0.0, 1.15]]), 16)
    stays = [
        box((x - 0.03, y - 0.03, 0.78), (x + 0.03, y + 0.03, 1.0))
        for x, y in ((0.0, -0.23), (0.0, 0.23))
    ]
    inside = lathe(np.array([[0.24, 0.80], [0.0, 0.801]]), 16)
    band = lathe(np.array([[0.273, 0.66], [0.273, 0.70]]), 16)
    return Model(
        (
            Part("Body", merge([body, lid, *stays]), "paint_black", "body"),
            Part("Lid", merge([inside, band]), "metal_galvanised", "lid"),
        )
    )


def post_bin() -> Model:
    """A small bin on a post, its opening towards +x."""
    case = box((0.04, -0.19, 0.55), (0.32, 0.19, 1.05))
    lid = box((0.02, -0.21, 1.05), (0.34, 0.21, 1.08))
    slot = box((0.32, -0.13, 0.90), (0.325, 0.13, 0.99))
    return Model(
        (
            Part("Body", case, "paint_green", "body"),
            Part("Lid", merge([lid, slot, post(1.25, 0.035, 10)]), "metal_dark", "lid"),
        )
    )


def squat_hydrant() -> Model:
    """A short hydrant with a dome and a bolted flange."""
    body = lathe(
        np.array(
            [[0.17, 0.0], [0.17, 0.06], [0.12, 0.08], [0.12, 0.42], [0.15, 0.44], [0.15, 0.49],
             [0.13, 0.56], [0.08, 0.63], [0.035, 0.65], [0.035, 0.70], [0.0, 0.71]]
        ), 14,
    )  # fmt: skip
    outlets = [
        tube(np.array([[0.0, -0.20, 0.36], [0.0, 0.20, 0.36]]), np.full(2, 0.05), 8),
        tube(np.array([[0.05, 0.0, 0.34], [0.21, 0.0, 0.34]]), np.full(2, 0.07), 8),
    ]
    caps = [
        moved(tube(np.array([[0.0, -0.03, 0.0], [0.0, 0.03, 0.0]]), np.full(2, 0.062), 6), place)
        for place in ((0.0, -0.20, 0.36), (0.0, 0.20, 0.36))
    ]
    return Model(
        (
            Part("Body", merge([body, *outlets]), "paint_yellow", "body"),
            Part("Caps", merge(caps), "metal_dark", "body"),
        )
    )
