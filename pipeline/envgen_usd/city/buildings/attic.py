"""Chimneys, dormers and roof windows in the roof's frame."""

from envgen_usd.city.buildings.building_design import Chimney, Design
from envgen_usd.city.buildings.building_faces import Face, Opening, Ring
from envgen_usd.city.buildings.facades import MARGIN, Hole
from envgen_usd.city.buildings.roofed_blocks import Block, make_block
from envgen_usd.city.buildings.roofs import Roof, RoofSpec, rectangle

_CLEARANCE = 0.15
"""Least margin of roof around a chimney or a roof window, metres; a larger value leaves out more.

"""
_NEAR_RIDGE = 0.35
"""Share of the slope, from the ridge, for chimneys; a larger value moves chimneys down."""
_DORMER_WALL = 1.25
"""Height of a dormer's front above the roof, metres."""
_DORMER_SET_BACK = 0.35
"""Distance of a dormer's front behind the wall, metres."""
_ROOF_WINDOW = (0.78, 1.18)
"""Width and height along the slope of a roof window, metres."""


def add_chimney(chimney: Chimney, roof: Roof) -> float | None:
    """Cuts a chimney into the back slope; returns its top height, `None` if it does not fit."""
    carrier = roof.faces[roof.back]
    along, ys = _ridge_range(roof), [p[1] for p in carrier.ring]
    half, edge = chimney.width / 2, chimney.width / 2 + _CLEARANCE
    low, high, near, far = along[0] + edge, along[1] - edge, min(ys) + edge, max(ys) - edge
    if low > high or near > far or len(carrier.ring) < 4:
        return None
    # Near the ridge; a single slope has its ridge at the back.
    x, depth = low + chimney.along * (high - low), _NEAR_RIDGE * chimney.across * (far - near)
    y = far - depth if roof.height(x, far) > roof.height(x, near) else near + depth
    foot = [
        (px, py, roof.height(px, py))
        for px, py, _ in rectangle(x - half, y - half, x + half, y + half, 0.0)
    ]
    top = max(roof.ridge, foot[0][2], foot[2][2]) + chimney.height
    head = [(px, py, top) for px, py, _ in foot]
    carrier.holes.append(foot[::-1])
    for a in range(4):
        b = (a + 1) % 4
        roof.faces.append(Face("WallSurface", "chimney", [foot[a], foot[b], head[b], head[a]]))
    roof.faces.append(Face("RoofSurface", "chimney", head))
    return top


def add_roof_windows(design: Design, spec: RoofSpec, roof: Roof) -> None:
    """Adds windows to both slopes, low enough to be clear of a chimney."""
    low, high = _ridge_range(roof)
    width, length = _ROOF_WINDOW
    run = length / (1.0 + design.slope**2) ** 0.5
    count = design.extras.roof_windows
    middle = 0.72 * spec.width
    if spec.width / 2 < 3.0 * run or high - low < count * (width + 2 * MARGIN):
        return
    for place in range(count):
        x = low + (high - low) * (place + 0.5) / count
        for front in (True, False):
            ys = (middle + run / 2, middle - run / 2)
            corners = [(x - width / 2, ys[0]), (x + width / 2, ys[0])]
            corners += [(x + width / 2, ys[1]), (x - width / 2, ys[1])]
            # Seen from the back, x points left.
            mirrored = corners if front else [(2 * x - px, py) for px, py in corners]
            ring = [
                (px, spec.width - py if front else py, roof.height(px, py)) for px, py in mirrored
            ]
            carrier = roof.faces[roof.front if front else roof.back]
            if any(_near(ring, hole) for hole in carrier.holes):
                continue
            carrier.openings.append(Opening("WindowSurface", ring))


def _near(ring: Ring, other: Ring) -> bool:
    """True if two rings are close to each other in plan."""
    return all(
        min(p[k] for p in ring) < max(p[k] for p in other) + _CLEARANCE
        and min(p[k] for p in other) < max(p[k] for p in ring) + _CLEARANCE
        for k in (0, 1)
    )


def make_dormers(design: Design, spec: RoofSpec, roof: Roof) -> list[list[Face]]:
    """Returns the dormers of both slopes as closed bodies that reach into the house."""
    low, high = _ridge_range(roof)
    count, width = design.extras.dormers, design.extras.dormer_width
    count = min(count, int((high - low) / (width + 2 * MARGIN)))
    # The roof at the dormer's front; both slopes are alike.
    top = roof.height(0.0, spec.width - _DORMER_SET_BACK) + _DORMER_WALL
    slope = min(design.slope, 0.8)
    if top + width / 2 * slope > roof.ridge - 0.1 or spec.width < 2 * _LEAST_HALF:
        return []
    bodies = []
    for place in range(count):
        x = low + (high - low) * (place + 0.5) / count - width / 2
        for front in (True, False):
            y = _DORMER_SET_BACK if front else spec.width / 2
            depth = spec.width / 2 - _DORMER_SET_BACK
            dormer_roof = RoofSpec("gabled", depth, width, top, slope)
            block = Block(
                x, y, width, depth, spec.eaves - 0.3, dormer_roof, turned=True, part="dormer"
            )
            hole = _dormer_window(design, width, top)

            def holes(side: int, _: float, hole: Hole = hole, front: bool = front) -> list[Hole]:
                return [hole] if side == (0 if front else 2) else []

            bodies.append(make_block(block, holes)[0])
    return bodies


_LEAST_HALF = 2.0


def _dormer_window(design: Design, width: float, top: float) -> Hole:
    half = min(design.windows.width, width - 2 * 0.2) / 2
    return Hole("WindowSurface", (width / 2 - half, top - 1.0, width / 2 + half, top - 0.12))


def _ridge_range(roof: Roof) -> tuple[float, float]:
    """Range of a ridge, or of a flat roof, along x."""
    ring = roof.faces[roof.back].ring
    xs = [p[0] for p in ring if p[2] > roof.ridge - 1e-6] or [p[0] for p in ring]
    return min(xs), max(xs)
