"""Meshes of flat faces that show a cell of an atlas."""

import numpy as np
import shapely

from envgen_usd.assets.asset_design import Part
from envgen_usd.assets.polygon_mesh import Mesh, merge, welded
from envgen_usd.assets.shapes.simple_solids import flat, moved
from envgen_usd.assets.signs.sign_atlas import cell_box
from envgen_usd.assets.signs.sign_drawing import plate_area
from envgen_usd.assets.signs.sign_sheets import SignSheet, faces
from envgen_usd.errors import EnvgenError
from envgen_usd.models.array_types import FloatArray


def sign_material(sheet: SignSheet) -> str:
    """Name of the material of a sheet's faces."""
    return f"sign_{sheet.name}"


def face_mesh(area: shapely.Polygon, size: tuple[float, float], cell: FloatArray, x: float) -> Mesh:
    """A face that looks towards +x.

    Args:
        area: Its outline about the middle of its box (y, z), metres.
        size: Width and height of its box, metres.
        cell: 2 x 2, texture coordinates of the box in the atlas, see `sign_atlas.cell_box`.
        x: Its place, metres.
    """
    triangles = face_triangles(area)
    place = triangles.reshape(-1, 2)
    mesh = flat(
        np.c_[np.full(len(place), x), place],
        np.full(len(triangles), 3),
        np.arange(len(place)),
    )
    uv = cell[0] + (place / np.array(size) + 0.5) * (cell[1] - cell[0])
    return Mesh(mesh.points, mesh.face_sizes, mesh.face_vertices, mesh.normals, uv)


def face_triangles(area: shapely.Polygon) -> FloatArray:
    """T x 3 x 2, counter-clockwise."""
    pieces = shapely.get_parts(shapely.constrained_delaunay_triangles(area))
    corners = shapely.get_coordinates(shapely.orient_polygons(pieces)).reshape(-1, 4, 2)
    return np.asarray(corners[:, :3], dtype=np.float64)


class PrintedFaces:
    """The faces of a sheet as meshes."""

    def __init__(self, sheet: SignSheet) -> None:
        """Finds the cell of each face in the atlas."""
        self._sheet = sheet
        rows = list(faces(sheet))
        self._cells = {
            face.name: (face, cell_box(number, len(rows))) for number, face in enumerate(rows)
        }

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the faces."""
        return tuple(self._cells)

    def part(self, name: str, *meshes: Mesh) -> Part:
        """A part that shows faces."""
        return Part(name, merge(list(meshes)), sign_material(self._sheet), "body")

    def face(self, name: str, x: float, height: float) -> Mesh:
        """A face towards +x, with its lower edge at a height in metres."""
        if name not in self._cells:
            raise EnvgenError(f"sheet {self._sheet.name}: the face '{name}' is missing")
        face, cell = self._cells[name]
        area = plate_area(face.plate, face.width, face.height)
        mesh = welded(face_mesh(area, (face.width, face.height), cell, x))
        return moved(mesh, (0.0, 0.0, height + face.height / 2))
