"""A block: four walls on a rectangle, a roof, and a floor; a closed shell."""

from collections.abc import Callable
from dataclasses import dataclass

from envgen_usd.city.buildings.building_faces import Face, Opening, Point, Ring, placed
from envgen_usd.city.buildings.facades import Hole
from envgen_usd.city.buildings.roofs import Roof, RoofSpec, make_roof, rectangle


@dataclass(frozen=True)
class Block:
    """Position and shape of a block; metres, in the building's frame.

    Attributes:
        x: x of the left front corner.
        y: y of the left front corner.
        width: Along x.
        depth: Along y.
        base: Underside.
        roof: Roof over a rectangle whose length runs along x, or along y if `turned`.
        turned: True if the ridge runs along y.
        part: Part name of its walls.
    """

    x: float
    y: float
    width: float
    depth: float
    base: float
    roof: RoofSpec
    turned: bool = False
    part: str = "wall"


def make_block(
    block: Block,
    holes: Callable[[int, float], list[Hole]],
    on_roof: Callable[[Roof], list[list[Face]]] = lambda _: [],
) -> tuple[list[Face], Roof, list[list[Face]]]:
    """Returns the faces of a block and its roof, and the bodies on it.

    Args:
        block: Block to build.
        holes: Returns the openings of a wall (0 front, 1 right, 2 back, 3 left) by its length.
        on_roof: May add to the roof's faces; returns bodies in the roof's frame.
    """
    roof = make_roof(block.roof)
    bodies = on_roof(roof)
    frame = placed(block.x, block.y, block.width, block.turned)
    faces = [face.moved(frame) for face in roof.faces]
    corners = rectangle(block.x, block.y, block.x + block.width, block.y + block.depth, block.base)
    # A turned roof begins with the right wall.
    tops = roof.tops[-1:] + roof.tops[:-1] if block.turned else roof.tops
    for side in range(4):
        start, end = corners[side], corners[(side + 1) % 4]
        length = block.width if side % 2 == 0 else block.depth
        faces.append(_wall(block, (start, end), tops[side], holes(side, length)))
    faces.append(Face("GroundSurface", "ground", corners[::-1]))
    return faces, roof, [[face.moved(frame) for face in body] for body in bodies]


def _wall(
    block: Block, ends: tuple[Point, Point], top: list[tuple[float, float]], holes: list[Hole]
) -> Face:
    (x0, y0, _), (x1, y1, _) = ends
    length = abs(x1 - x0) + abs(y1 - y0)
    dx, dy = (x1 - x0) / length, (y1 - y0) / length

    def place(a: float, z: float) -> Point:
        return x0 + a * dx, y0 + a * dy, z

    ring = [ends[0], ends[1], *(place(a, z) for a, z in top)]
    openings = [Opening(hole.kind, _box(hole, place)) for hole in holes]
    return Face("WallSurface", block.part, ring, openings=openings)


def _box(hole: Hole, place: Callable[[float, float], Point]) -> Ring:
    left, bottom, right, top = hole.box
    return [place(left, bottom), place(right, bottom), place(right, top), place(left, top)]
