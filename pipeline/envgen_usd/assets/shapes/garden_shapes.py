"""What stands in gardens: sheds, clothes lines, terraces. They face +x, away from the house."""

import numpy as np

from envgen_usd.assets.asset_design import Model, Part
from envgen_usd.assets.polygon_mesh import Mesh, merge
from envgen_usd.assets.shapes.simple_solids import box, flat, moved, tube
from envgen_usd.models.array_types import FloatArray

_DEPTH, _WIDTH = 1.8, 2.4
"""Walls of a shed along x and along y, metres."""


def shed(*, gabled: bool) -> Model:
    """A shed of boards with a door and a window: a gable over the door, or a roof that falls back.

    Args:
        gabled: True for a gable.
    """
    half, side, low = _DEPTH / 2, _WIDTH / 2, 1.75
    outline, heights = _section(low, gabled=gabled)
    walls = _prism(outline, heights, gabled=gabled, depth=(half, side))
    door = box((half, -0.62, 0.08), (half + 0.03, 0.12, 1.72))
    battens = [box((half + 0.03, -0.6, z), (half + 0.045, 0.1, z + 0.09)) for z in (0.3, 1.35)]
    pane = box((half, 0.35, 1.0), (half + 0.012, 0.95, 1.45))
    frame = [box((half, 0.31, z), (half + 0.03, 0.99, z + 0.05)) for z in (0.95, 1.45)] + [
        box((half, y, 0.95), (half + 0.03, y + 0.04, 1.5)) for y in (0.31, 0.95)
    ]
    roof = _sheets(low, gabled=gabled)
    far = box((-half, -side, 0.0), (half, side, 2.0))
    return Model(
        (
            Part("Boards", merge([walls, door, *battens]), "wood", "body"),
            Part("Frame", merge(frame), "paint_white", "body"),
            Part("Pane", pane, "glass", "body"),
            Part("Roof", merge(roof), "bitumen", "body"),
            Part("BoardsProxy", far, "wood", "body", proxy_of="Boards"),
        )
    )


def _section(low: float, *, gabled: bool) -> tuple[FloatArray, FloatArray]:
    """Places across the ridge and heights of the wall's top, from one eave to the other, metres."""
    if gabled:
        return np.array([-_WIDTH / 2, 0.0, _WIDTH / 2]), np.array([low, low + 0.5, low])
    return np.array([-_DEPTH / 2, _DEPTH / 2]), np.array([low, low + 0.35])


def _prism(
    outline: FloatArray, heights: FloatArray, *, gabled: bool, depth: tuple[float, float]
) -> Mesh:
    """Walls with a level base below a roof's section."""
    reach = depth[0] if gabled else depth[1]
    count = len(outline) + 2
    across = np.concatenate([[outline[0], outline[-1]], outline[::-1]])
    up = np.concatenate([[0.0, 0.0], heights[::-1]])
    near, far = np.full(count, reach), np.full(count, -reach)
    rings = (
        [(near, across, up), (far, across, up)]
        if gabled
        else [
            (across, far, up),
            (across, near, up),
        ]
    )
    points = np.concatenate([np.stack(ring, axis=1) for ring in rings])
    first = np.arange(count)
    sides = [[n, n + count, (n + 1) % count + count, (n + 1) % count] for n in range(count)]
    corners = np.concatenate([first, first[::-1] + count, np.ravel(sides)])
    return flat(points, np.array([count, count, *([4] * count)]), corners)


def _sheets(low: float, *, gabled: bool) -> list[Mesh]:
    """Sheets of roofing felt, 3 cm thick, that overhang the walls by 8 cm."""
    over, thick = 0.08, 0.03
    places, heights = _section(low, gabled=gabled)
    reach = (_DEPTH if gabled else _WIDTH) / 2 + over
    sheets = []
    for n in range(len(places) - 1):
        slope = (heights[n + 1] - heights[n]) / (places[n + 1] - places[n])
        ends = places[n : n + 2] + np.array([-over, over]) * ([n == 0, n == len(places) - 2])
        level = heights[n] + slope * (ends - places[n])
        ring = [
            (ends[0], level[0]),
            (ends[1], level[1]),
            (ends[1], level[1] + thick),
            (ends[0], level[0] + thick),
        ]
        points = np.array(
            [(end, a, z) if gabled else (a, -end, z) for end in (reach, -reach) for a, z in ring]
        )
        sides = [[i, i + 4, (i + 1) % 4 + 4, (i + 1) % 4] for i in range(4)]
        corners = np.concatenate([np.arange(4), np.arange(4)[::-1] + 4, np.ravel(sides)])
        sheets.append(flat(points, np.full(6, 4), corners))
    return sheets


def clothes_line(*, laden: bool) -> Model:
    """Two posts with cross bars and four lines, with or without laundry."""
    posts = [
        tube(np.array([[0.0, y, 0.0], [0.0, y, 1.9]]), np.full(2, 0.025), 8) for y in (-2.0, 2.0)
    ]
    bars = [
        tube(np.array([[-0.5, y, 1.88], [0.5, y, 1.88]]), np.full(2, 0.02), 6) for y in (-2.0, 2.0)
    ]
    lines = [
        tube(np.array([[x, -2.0, 1.9], [x, 0.0, 1.86], [x, 2.0, 1.9]]), np.full(3, 0.004), 4)
        for x in (-0.45, -0.15, 0.15, 0.45)
    ]
    parts = [Part("Posts", merge([*posts, *bars]), "metal_galvanised", "body")]
    parts.append(Part("Lines", merge(lines), "paint_white", "body"))
    if laden:
        white = [_sheet(-0.45, -1.2, 1.3, 0.95), _sheet(0.15, 0.9, 1.5, 1.0)]
        dark = [_sheet(-0.15, y, 0.45, 0.6) for y in (-1.5, -0.9, -0.3, 0.4)]
        parts.append(Part("Linen", merge(white), "paint_white", "body"))
        parts.append(Part("Clothes", merge(dark), "paint_blue", "body"))
    return Model(tuple(parts))


def _sheet(x: float, y: float, width: float, height: float) -> Mesh:
    """A cloth over a line."""
    return box((x - 0.012, y - width / 2, 1.86 - height), (x + 0.012, y + width / 2, 1.885))


def terrace(*, wooden: bool) -> Model:
    """A terrace of 3 m by 3.6 m with a table and four chairs."""
    slab = box((-1.5, -1.8, 0.0), (1.5, 1.8, 0.05))
    top = box((-0.4, -0.7, 0.75), (0.4, 0.7, 0.79))
    legs = [
        box((x - 0.03, y - 0.03, 0.05), (x + 0.03, y + 0.03, 0.75))
        for x in (-0.34, 0.34)
        for y in (-0.62, 0.62)
    ]
    chairs = [
        moved(part, (x, y, 0.05))
        for x, turn in ((-0.85, -1.0), (0.85, 1.0))
        for y in (-0.38, 0.38)
        for part in _chair(turn)
    ]
    furniture = merge([top, *legs, *chairs])
    floor = "wood" if wooden else "flagstone"
    return Model(
        (
            Part("Floor", slab, floor, "body"),
            Part("Furniture", furniture, "wood", "body"),
            Part("FurnitureProxy", top, "wood", "body", proxy_of="Furniture"),
        )
    )


def _chair(turn: float) -> list[Mesh]:
    """A chair with its back towards +x (1) or -x (-1)."""
    legs = [
        box((x - 0.02, y - 0.02, 0.0), (x + 0.02, y + 0.02, 0.43))
        for x in (-0.2, 0.2)
        for y in (-0.2, 0.2)
    ]
    seat = box((-0.22, -0.22, 0.43), (0.22, 0.22, 0.46))
    x = 0.2 * turn
    back = box((x - 0.02, -0.22, 0.46), (x + 0.02, 0.22, 0.9))
    return [*legs, seat, back]
