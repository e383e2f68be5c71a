"""What lies and stands on roads and yards: gullies, containers, pallets, silos, flower beds."""

import numpy as np

from envgen_usd.assets.asset_design import Model, Part
from envgen_usd.assets.polygon_mesh import Mesh, merge
from envgen_usd.assets.shapes.simple_solids import box, lathe, moved, tube, upright_size


def gully(*, slotted: bool) -> Model:
    """A grating of 45 cm in a frame, level with the road; bars across or in two rows of slots."""
    frame = [
        box((-0.225, -0.225, 0.0), (0.225, -0.195, 0.008)),
        box((-0.225, 0.195, 0.0), (0.225, 0.225, 0.008)),
        box((-0.225, -0.196, 0.0), (-0.195, 0.196, 0.008)),
        box((0.195, -0.196, 0.0), (0.225, 0.196, 0.008)),
    ]
    bars = [
        box((-0.196, y - 0.011, 0.002), (0.196, y + 0.011, 0.007))
        for y in np.linspace(-0.165, 0.165, 7)
    ]
    if slotted:
        bars.append(box((-0.02, -0.196, 0.002), (0.02, 0.196, 0.0075)))
    pit = box((-0.2, -0.2, 0.0), (0.2, 0.2, 0.002))
    far = box((-0.225, -0.225, 0.0), (0.225, 0.225, 0.008))
    parts = (
        Part("Grating", merge([*frame, *bars]), "metal_cast", "lid"),
        Part("Pit", pit, "paint_black", "lid"),
        Part("GratingProxy", far, "metal_cast", "lid", proxy_of="Grating"),
    )
    return Model(parts)


def mooring() -> Model:
    """A cast bollard of 0.75 m on a plate, to which ships are tied; its nose faces +x."""
    body = lathe(
        np.array(
            [[0.34, 0.0], [0.34, 0.05], [0.24, 0.08], [0.19, 0.16], [0.17, 0.42], [0.20, 0.50],
             [0.30, 0.56], [0.31, 0.64], [0.25, 0.71], [0.0, 0.75]]
        ), 20,
    )  # fmt: skip
    nose = tube(np.array([[0.0, 0.0, 0.6], [0.44, 0.0, 0.6]]), np.array([0.11, 0.09]), 10)
    angle = np.arange(6) * np.pi / 3.0
    bolts = [
        moved(lathe(np.array([[0.025, 0.05], [0.025, 0.075], [0.0, 0.076]]), 6), (x, y, 0.0))
        for x, y in np.stack([0.29 * np.cos(angle), 0.29 * np.sin(angle)], axis=1).tolist()
    ]
    return Model((Part("Body", merge([body, nose, *bolts]), "metal_cast", "body"),))


def container() -> Model:
    """A freight container of 20 feet (ISO 668: 6.06 m by 2.44 m by 2.59 m), its doors at +x."""
    length, width, height = 6.06, 2.44, 2.59
    half, side = length / 2, width / 2
    posts = [
        box((x - 0.08, y - 0.08, 0.0), (x + 0.08, y + 0.08, height))
        for x in (-half + 0.08, half - 0.08)
        for y in (-side + 0.08, side - 0.08)
    ]
    rails = [
        box((-half + 0.16, y - 0.05, z), (half - 0.16, y + 0.05, z + 0.14))
        for y in (-side + 0.05, side - 0.05)
        for z in (0.0, height - 0.14)
    ]
    ends = [
        box((x - 0.05, -side + 0.16, z), (x + 0.05, side - 0.16, z + 0.14))
        for x in (-half + 0.05, half - 0.05)
        for z in (0.0, height - 0.14)
    ]
    ribs = [
        box((x, y - 0.018, 0.14), (x + 0.11, y + 0.018, height - 0.14))
        for y in (-side + 0.035, side - 0.035)
        for x in np.arange(-half + 0.2, half - 0.3, 0.22)
    ]
    walls = [
        box((-half + 0.1, -side + 0.06, 0.12), (half - 0.07, side - 0.06, height - 0.03)),
    ]
    bars = [
        tube(np.array([[half + 0.01, y, 0.12], [half + 0.01, y, 2.5]]), np.full(2, 0.018), 6)
        for y in (-0.85, -0.3, 0.3, 0.85)
    ]
    seam = box((half - 0.075, -0.012, 0.14), (half - 0.06, 0.012, height - 0.14))
    parts = (
        Part("Body", merge([*posts, *rails, *ends, *ribs, *walls]), "paint_blue", "body"),
        Part("Bars", merge([*bars, seam]), "metal_galvanised", "body"),
        Part("BodyProxy", box((-half, -side, 0.0), (half, side, height)), "paint_blue", "body",
             proxy_of="Body"),
    )  # fmt: skip
    return Model(parts)


def _pallet(z: float) -> list[Mesh]:
    """The boards and blocks of a pallet of 1.2 m by 0.8 m (EN 13698-1)."""
    deck = [
        box((-0.6, y - width / 2, z + 0.122), (0.6, y + width / 2, z + 0.144))
        for y, width in ((-0.33, 0.145), (-0.165, 0.1), (0.0, 0.145), (0.165, 0.1), (0.33, 0.145))
    ]
    cross = [
        box((x - 0.0725, -0.4, z + 0.1), (x + 0.0725, 0.4, z + 0.122)) for x in (-0.52, 0, 0.52)
    ]
    blocks = [
        box((x - 0.07, y - 0.05, z + 0.022), (x + 0.07, y + 0.05, z + 0.1))
        for x in (-0.52, 0.0, 0.52)
        for y in (-0.345, 0.0, 0.345)
    ]
    skids = [box((-0.6, y - 0.05, z), (0.6, y + 0.05, z + 0.022)) for y in (-0.345, 0.0, 0.345)]
    return [*deck, *cross, *blocks, *skids]


def _far_stack(count: int) -> Part:
    """Pallets in the distance: the deck of each, and three rows of blocks through the stack."""
    decks = [
        box((-0.6, -0.4, 0.144 * layer + 0.1), (0.6, 0.4, 0.144 * layer + 0.144))
        for layer in range(count)
    ]
    rows = [
        box((-0.59, y - 0.05, 0.0), (0.59, y + 0.05, 0.144 * count - 0.02))
        for y in (-0.34, 0, 0.34)
    ]
    return Part("WoodProxy", merge([*decks, *rows]), "wood", "body", proxy_of="Wood")


def pallets(*, loaded: bool) -> Model:
    """A stack of five pallets, or one with boxes on it."""
    if not loaded:
        stack = [mesh for layer in range(5) for mesh in _pallet(0.144 * layer)]
        return Model((Part("Wood", merge(stack), "wood", "body"), _far_stack(5)))
    goods = [
        box((x + 0.005, y + 0.005, 0.144 + 0.35 * z), (x + 0.375, y + 0.375, 0.49 + 0.35 * z))
        for x in (-0.57, -0.19, 0.19)
        for y in (-0.38, 0.0)
        for z in (0, 1, 2)
        if (x, z) != (0.19, 2)
    ]
    return Model(
        (
            Part("Wood", merge(_pallet(0.0)), "wood", "body"),
            Part("Goods", merge(goods), "cardboard", "body"),
            _far_stack(1),
            Part(
                "GoodsProxy",
                box((-0.57, -0.38, 0.144), (0.57, 0.38, 1.19)),
                "cardboard",
                "body",
                proxy_of="Goods",
            ),
        )
    )


def silo(*, tall: bool) -> Model:
    """A silo of sheet metal on legs with a hopper, a ladder and a rail."""
    radius, low, top = (1.5, 3.2, 10.0) if tall else (1.8, 2.6, 7.0)
    shell = lathe(
        np.array(
            [[0.2, 0.9], [radius, low], [radius + 0.03, low + 0.1], [radius, low + 0.2],
             [radius, top], [0.35, top + 0.7], [0.3, top + 0.85], [0.0, top + 0.9]]
        ), 24,
    )  # fmt: skip
    legs = []
    for turn in np.linspace(0.25, 2 * np.pi + 0.25, 4, endpoint=False):
        foot = np.array([np.cos(turn), np.sin(turn)]) * (radius - 0.08)
        # Legs stand a little in the ground, so that none hangs above it once pieces are set apart.
        path = np.array([[*foot, -0.002], [*foot, low + 0.25]])
        legs.append(tube(path, np.full(2, 0.09), 8))
    rungs = [
        box((radius + 0.12, -0.2, z), (radius + 0.14, 0.2, z + 0.02))
        for z in np.arange(0.6, top, 0.3)
    ]
    stiles = [
        box((radius + 0.11, y - 0.02, 0.3), (radius + 0.15, y + 0.02, top)) for y in (-0.2, 0.2)
    ]
    far = moved(
        lathe(np.array([[0.2, 0.9], [radius, low], [radius, top], [0.0, top + 0.9]]), 8), (0, 0, 0)
    )
    parts = (
        Part("Shell", shell, "metal_galvanised", "body"),
        Part("Legs", merge([*legs, *rungs, *stiles]), "paint_grey", "body"),
        Part("ShellProxy", far, "metal_galvanised", "body", proxy_of="Shell"),
    )
    return Model(parts, upright_size(shell, *legs))
