"""The closed shell of one building: walls with openings, roof, chimney, ground."""

from collections.abc import Callable

from envgen_usd.city import roofs
from envgen_usd.city.design import Design
from envgen_usd.city.facade import Hole, lay_out
from envgen_usd.city.faces import Face, Opening, Point, Ring, straight, turned
from envgen_usd.city.roofs import Roof, RoofSpec, rectangle

_ROOFS = {
    "flat": roofs.flat,
    "shed": roofs.shed,
    "gabled": roofs.gabled,
    "hipped": roofs.hipped,
    "pyramidal": roofs.pyramidal,
}
_CHIMNEY_CLEARANCE = 0.15


def build_shell(design: Design, base: float) -> tuple[list[Face], float]:
    """Returns the faces of a building, which together form a closed 2-manifold, and its top.

    The building's frame has its origin in the left end of the street wall as seen from the
    street, x along that wall, y away from the street, and z = 0 at the floor.

    Args:
        design: The building.
        base: Height of the foundation's underside, below zero.

    Returns:
        The faces, and the height of the highest point above the floor.
    """
    roof, faces = _roof(design)
    top = roof.ridge
    if design.chimney is not None:
        top = max(top, _add_chimney(design, roof))
    frame = turned(design.width) if design.ridge_to_street else straight
    for face in faces:
        face.ring = [frame(*point) for point in face.ring]
        face.holes = [[frame(*point) for point in hole] for hole in face.holes]
    corners = rectangle(0.0, 0.0, design.width, design.depth, base)
    faces.append(Face("GroundSurface", "ground", corners[::-1]))
    # A turned roof begins with the right wall.
    tops = roof.tops[-1:] + roof.tops[:-1] if design.ridge_to_street else roof.tops
    for side in range(4):
        faces.append(_wall(design, side, corners, tops[side], base))
    return faces, top


def _roof(design: Design) -> tuple[Roof, list[Face]]:
    length, width = design.width, design.depth
    if design.ridge_to_street:
        length, width = width, length
    # Only an extruded roof can end at a party wall.
    hips = design.roof in ("hipped", "pyramidal")
    spec = RoofSpec(
        length=length,
        width=width,
        eaves=design.eaves,
        slope=design.slope,
        overhang=0.0 if hips and design.style == "row" else design.overhang,
        verge=0.0 if design.style == "row" else design.overhang,
        parapet=design.parapet,
    )
    roof = _ROOFS[design.roof](spec)
    return roof, roof.faces


def _wall(design: Design, side: int, corners: Ring, top: roofs.Border, base: float) -> Face:
    (x0, y0, _), (x1, y1, _) = corners[side], corners[(side + 1) % 4]
    length = design.width if side % 2 == 0 else design.depth
    dx, dy = (x1 - x0) / length, (y1 - y0) / length

    def place(a: float, z: float) -> Point:
        return x0 + a * dx, y0 + a * dy, z

    face = Face("WallSurface", "wall", [place(0.0, base), place(length, base)])
    face.ring += [place(a, z) for a, z in top]
    if side % 2 == 0 or design.style != "row":
        for hole in lay_out(design, length, street=side == 0):
            face.openings.append(Opening(hole.kind, _box(hole, place)))
    return face


def _box(hole: Hole, place: Callable[[float, float], Point]) -> Ring:
    left, bottom, right, top = hole.box
    return [place(left, bottom), place(right, bottom), place(right, top), place(left, top)]


def _add_chimney(design: Design, roof: Roof) -> float:
    """Cuts a chimney into the face that carries it; returns its top, or 0 if there is no room."""
    assert design.chimney is not None
    along, across, width, height = design.chimney
    carrier = roof.faces[roof.carrier]
    xs, ys = [p[0] for p in carrier.ring], [p[1] for p in carrier.ring]
    ridge = [p for p in carrier.ring if p[2] > roof.ridge - 1e-6] or carrier.ring
    half, edge = width / 2, width / 2 + _CHIMNEY_CLEARANCE
    low, high = min(p[0] for p in ridge) + edge, max(p[0] for p in ridge) - edge
    near, far = min(ys) + edge, max(ys) - edge
    if low > high or near > far or len(xs) < 4:
        return 0.0
    # Near the ridge, where chimneys stand.
    x, y = low + along * (high - low), near + 0.35 * across * (far - near)
    foot = [
        (px, py, roof.height(px, py))
        for px, py, _ in rectangle(x - half, y - half, x + half, y + half, 0.0)
    ]
    top = max(roof.ridge, foot[0][2], foot[2][2]) + height
    head = [(px, py, top) for px, py, _ in foot]
    carrier.holes.append(foot[::-1])
    for a in range(4):
        b = (a + 1) % 4
        roof.faces.append(Face("WallSurface", "chimney", [foot[a], foot[b], head[b], head[a]]))
    roof.faces.append(Face("RoofSurface", "chimney", head))
    return top
