"""One building as a CityGML feature."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from itertools import chain

import numpy as np

from envgen_usd.chunks import snap
from envgen_usd.city.design import Design
from envgen_usd.city.faces import Face, Ring
from envgen_usd.city.shell import build_shell
from envgen_usd.models.arrays import FloatArray, IntArray
from envgen_usd.models.city import CityObject, ThematicSurface
from envgen_usd.models.polygons import Polygons

_LOD = 3
_BELOW_GROUND = 0.5
"""How far the foundation reaches below the lowest ground, metres."""
# SIG3D code lists _AbstractBuilding_roofType, ..._class and ..._function.
_ROOF_TYPES = {
    "flat": "1000",
    "shed": "1010",
    "gabled": "1030",
    "hipped": "1040",
    "pyramidal": "1070",
}
_CLASSES = {"residential": "1000", "industrial": "1160"}
_FUNCTIONS = {"residential": "1000", "industrial": "1310"}
_NAMES = {
    "WallSurface": "wall",
    "RoofSurface": "roof",
    "GroundSurface": "ground",
    "OuterCeilingSurface": "soffit",
    "WindowSurface": "window",
    "DoorSurface": "door",
}


@dataclass(frozen=True)
class Site:
    """Where a building stands.

    Attributes:
        origin: 2, left end of its street wall as seen from the street, metres, road frame.
        along: 2, unit vector along that wall, to the right as seen from the street.
        lowest: Lowest ground under the footprint.
        highest: Highest ground under the footprint.
    """

    origin: FloatArray
    along: FloatArray
    lowest: float
    highest: float


def make_building(name: str, design: Design, site: Site) -> CityObject:
    """Returns a building whose surfaces form a closed solid.

    The floor lies a plinth above the highest ground under the footprint, and the walls reach
    below the lowest, so that nothing floats and no door is buried.

    Args:
        name: gml:id; the surfaces get ids that begin with it.
        design: What it looks like.
        site: Where it stands.
    """
    floor = site.highest + design.plinth
    base = site.lowest - _BELOW_GROUND - floor
    faces, top = build_shell(design, base)
    points = iter(_split(faces, site, floor))
    counts: dict[str, int] = {}
    surfaces = tuple(_surface(name, face, design, points, counts) for face in faces)
    return CityObject(
        id=name,
        kind="Building",
        attributes={
            "class": _CLASSES[design.function],
            "function": _FUNCTIONS[design.function],
            "roofType": _ROOF_TYPES[design.roof],
            "storeysAboveGround": design.storeys,
            "height": round(top - base, 3),
            "floorHeight": round(floor, 3),
            "style": design.style,
        },
        surfaces=surfaces,
        solid_lod=_LOD,
    )


def _split(faces: list[Face], site: Site, floor: float) -> list[FloatArray]:
    """World coordinates of each surface, in the order in which `_surface` takes them."""
    local: list[Ring] = []
    for face in faces:
        holes = [opening.ring[::-1] for opening in face.openings]
        local.append(list(chain(face.ring, *face.holes, *holes)))
        local += [opening.ring for opening in face.openings]
    points = np.array([point for ring in local for point in ring])
    ax, ay = site.along.tolist()
    world = np.empty_like(points)
    world[:, 0] = site.origin[0] + points[:, 0] * ax - points[:, 1] * ay
    world[:, 1] = site.origin[1] + points[:, 0] * ay + points[:, 1] * ax
    world[:, 2] = points[:, 2] + floor
    ends = np.cumsum([len(ring) for ring in local])[:-1]
    return np.split(snap(world), ends)


def _surface(
    name: str, face: Face, design: Design, points: Iterator[FloatArray], counts: dict[str, int]
) -> ThematicSurface:
    sizes = (
        len(face.ring),
        *(len(hole) for hole in face.holes),
        *(4 for _ in face.openings),
    )
    polygon = _polygon(next(points), sizes)
    openings = tuple(
        ThematicSurface(
            id=_number(name, opening.kind, counts),
            kind=opening.kind,
            polygons=_polygon(next(points), (4,)),
            lod=_LOD,
            material="glass" if opening.kind == "WindowSurface" else _door(design),
        )
        for opening in face.openings
    )
    return ThematicSurface(
        id=_number(name, face.kind, counts),
        kind=face.kind,
        polygons=polygon,
        lod=_LOD,
        material=_material(face, design),
        attributes={"part": face.part},
        openings=openings,
    )


def _number(name: str, kind: str, counts: dict[str, int]) -> str:
    short = _NAMES[kind]
    counts[short] = counts.get(short, 0) + 1
    return f"{name}_{short}_{counts[short]}"


def _polygon(points: FloatArray, sizes: tuple[int, ...]) -> Polygons:
    return Polygons(points, *_offsets(sizes))


@cache
def _offsets(sizes: tuple[int, ...]) -> tuple[IntArray, IntArray]:
    return np.cumsum((0, *sizes), dtype=np.int64), np.array([0, len(sizes)], dtype=np.int64)


def _door(design: Design) -> str:
    return "sheet_metal" if design.style == "hall" else "wood"


def _material(face: Face, design: Design) -> str:
    if face.kind == "RoofSurface":
        return "concrete" if face.part in ("coping", "chimney") else design.roof_material
    if face.part == "soffit":
        return design.wall_material if design.style == "hall" else "wood"
    return "concrete" if face.kind == "GroundSurface" else design.wall_material
