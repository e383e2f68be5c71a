"""Traffic signs with a face of an atlas, on one post or two; they face +x."""

from dataclasses import replace

import numpy as np
import shapely

from envgen_usd.assets.asset_design import AssetDesign, Model, Part
from envgen_usd.assets.polygon_mesh import Mesh, merge, welded
from envgen_usd.assets.shapes.printed_faces import face_mesh, face_triangles, sign_material
from envgen_usd.assets.shapes.simple_solids import box, flat, moved, tube
from envgen_usd.assets.signs.sign_atlas import cell_box
from envgen_usd.assets.signs.sign_drawing import plate_area
from envgen_usd.assets.signs.sign_sheets import SignFace, SignSheet, faces
from envgen_usd.models.array_types import FloatArray

LOWER_EDGE = 2.0
"""Height of a plate's lower edge, metres; a larger value raises signs."""
_CLASS = "traffic_sign"
_POST, _SHEET = 0.038, 0.003
"""Metres: radius of a post (pipe of 76 mm), thickness of a plate."""
_COARSE = 0.012
"""Deviation of a proxy's outline as a share of its size; a larger value leaves out more corners."""
_LOWERED = {"triangle": 0.12, "diamond": 0.12, "cross": 0.45}
"""Metres, by plate, from its upper edge to the end of the post."""
_WIDE = 1.15
"""Width in metres from which a plate has two posts."""


def sign_design(sheet: SignSheet) -> AssetDesign:
    """Returns the asset of a sheet, with a variant ``face`` for each face."""
    rows = list(faces(sheet))
    models = {
        face.name: _sign(face, sign_material(sheet), cell_box(number, len(rows)))
        for number, face in enumerate(rows)
    }
    return AssetDesign(sheet.asset, "traffic_sign", "pole", models, "face")


def shop_sign_design(sheet: SignSheet) -> AssetDesign:
    """Returns the panels with the names of shops, with a variant ``face`` for each."""
    rows = list(faces(sheet))
    models = {
        face.name: _panel(face, sign_material(sheet), cell_box(number, len(rows)))
        for number, face in enumerate(rows)
    }
    return AssetDesign("shop_sign", "shop_sign", "building", models, "face")


def _panel(face: SignFace, material: str, cell: FloatArray) -> Model:
    """A panel 2 cm thick with its back at x = 0 and its foot at z = 0."""
    area = plate_area(face.plate, face.width, face.height)
    lift = (0.0, 0.0, face.height / 2)
    half = face.width / 2
    back = box((0.0, -half, 0.0), (0.018, half, face.height))
    front = moved(face_mesh(area, (face.width, face.height), cell, 0.02), lift)
    parts = (
        Part("Back", back, "paint_grey", "body"),
        Part("Face", welded(front), material, "sign_face"),
    )
    return Model(parts)


def _sign(face: SignFace, material: str, cell: FloatArray) -> Model:
    lift = (0.0, 0.0, LOWER_EDGE + face.height / 2)
    area = plate_area(face.plate, face.width, face.height)
    front = face_mesh(area, (face.width, face.height), cell, _POST + 0.014)
    coarse = face_mesh(_coarse(area), (face.width, face.height), cell, _POST + 0.014)
    across = (-0.34 * face.width, 0.34 * face.width) if face.width > _WIDE else (0.0,)
    top = LOWER_EDGE + face.height - _LOWERED.get(face.plate, 0.02)
    meshes = {
        "Post": (merge([_bar(y, top, 10) for y in across]), "metal_galvanised", "post"),
        "Back": (welded(moved(_back(area, face), lift)), "metal_galvanised", "sign_back"),
        "Face": (welded(moved(front, lift)), material, "sign_face"),
    }
    light = {
        "Post": merge([_bar(y, top, 3) for y in across]),
        "Back": welded(moved(_reversed(coarse), lift)),
        "Face": welded(moved(coarse, lift)),
    }
    parts = [
        Part(name, mesh, look, label, of_class="" if name == "Post" else _CLASS)
        for name, (mesh, look, label) in meshes.items()
    ]
    parts += [
        replace(part, name=f"{part.name}Proxy", mesh=light[part.name], proxy_of=part.name)
        for part in parts
    ]
    return Model(tuple(parts))


def _bar(y: float, top: float, sides: int) -> Mesh:
    return tube(np.array([[0.0, y, 0.0], [0.0, y, top]]), np.full(2, _POST), sides)


def _coarse(area: shapely.Polygon) -> shapely.Polygon:
    """The outline with fewer corners, for the distance."""
    left, low, right, high = area.bounds
    return area.simplify(_COARSE * min(right - left, high - low))


def _reversed(mesh: Mesh) -> Mesh:
    """A plate that faces the other way, behind the face."""
    order = np.arange(len(mesh.face_vertices)).reshape(-1, 3)[:, ::-1].reshape(-1)
    return flat(mesh.points - (0.002, 0.0, 0.0), mesh.face_sizes, mesh.face_vertices[order])


def _back(area: shapely.Polygon, face: SignFace) -> Mesh:
    """The grey back with the rim of the plate, and the two rails that hold it."""
    ring = shapely.get_coordinates(shapely.orient_polygons(area).exterior)[:-1]
    count = len(ring)
    low, high = _POST + 0.014 - _SHEET, _POST + 0.014
    points = np.concatenate([np.c_[np.full(count, low), ring], np.c_[np.full(count, high), ring]])
    k = np.arange(count)
    beside = (k + 1) % count
    rim = np.stack([k, beside, beside + count, k + count], axis=1)
    sides = flat(points, np.full(count, 4), rim.reshape(-1))
    place = face_triangles(area)[:, ::-1].reshape(-1, 2)
    behind = flat(
        np.c_[np.full(len(place), low), place], np.full(len(place) // 3, 3), np.arange(len(place))
    )
    return merge([sides, behind, *_rails(area, face, low)])


def _rails(area: shapely.Polygon, face: SignFace, end: float) -> list[Mesh]:
    """Two rails behind the plate, as far as it reaches; a cross has none."""
    rails = []
    for z in (-0.18 * face.height, 0.18 * face.height):
        level = shapely.LineString([(-face.width, z), (face.width, z)])
        left, _, right, _ = shapely.intersection(area, level).bounds
        half = 0.75 * min(-left, right)
        rails.append(box((_POST - 0.004, -half, z - 0.015), (end, half, z + 0.015)))
    return rails if face.plate != "cross" else []
