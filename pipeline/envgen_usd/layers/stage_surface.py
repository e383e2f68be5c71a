"""Reads from a composed stage what actors stand on and what is in their way."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from pxr import Gf, Tf, Usd, UsdGeom

from envgen_usd.assets.usd_files import missing_stage, open_without_files
from envgen_usd.errors import EnvgenError
from envgen_usd.models.actors import Obstacle
from envgen_usd.models.array_types import FloatArray

_ABOVE = 2.5
"""Metres above the foot of a building below which its floors count; higher ones are passed under.

"""
_POLE = 0.15
"""Radius with which a pole or a trunk is in the way, metres."""
_CORNERS = 8
"""Corners of the outline of a pole."""
_FLAT = 0.2
"""Height up to which wheels pass over a prop, metres."""
_DOWN = -0.9
"""Greatest z of the unit normal of a floor that is seen from below."""
_SLENDER = frozenset({"pole", "vegetation", "traffic_sign", "traffic_light", "traffic sign",
                      "traffic light", "tree", "street_light"})  # fmt: skip
"""Labels and categories of objects that stand on a pole or a trunk."""
_BOX = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
"""Corners of a box: whether each coordinate is the lesser or the greater."""
_PREDICATE = Usd.PrimIsActive & Usd.PrimIsDefined & ~Usd.PrimIsAbstract


class StageSurface:
    """A composed stage, whose payloads are loaded while they are read."""

    def __init__(self, path: Path) -> None:
        """Opens the stage.

        Raises:
            EnvgenError: The file is no stage.
        """
        if not path.is_file():
            raise missing_stage(path)
        try:
            self._stage = open_without_files(path)
        except Tf.ErrorException as error:
            raise EnvgenError(f"{path}: cannot be opened: not a USD file") from error
        scale = UsdGeom.GetStageMetersPerUnit(self._stage)
        if UsdGeom.GetStageUpAxis(self._stage) != UsdGeom.Tokens.z or not np.isclose(scale, 1.0):
            raise EnvgenError(f"{path}: is not in metres with z up; give the stage of a build")

    def triangles(self, name: str, near: FloatArray) -> FloatArray:
        """Returns the visible triangles of the chunks' children of a name, T x 3 x 3, metres.

        Args:
            name: ``Roads`` or ``Terrain``.
            near: N x 2, metres; chunks farther away are not read.
        """
        found = [np.empty((0, 3, 3))]
        for root in self._loaded(name, near):
            cache = UsdGeom.XformCache(Usd.TimeCode.EarliestTime())
            for prim in Usd.PrimRange(root):
                if prim.IsA("Mesh") and _is_visible(prim):
                    found.append(_triangles(UsdGeom.Mesh(prim), _matrix(cache, prim)))
        return np.concatenate(found)

    def obstacles(self, near: FloatArray) -> list[Obstacle]:
        """Returns buildings, parked vehicles, people who stand, and props that are not flat.

        Args:
            near: N x 2, metres; chunks farther away are not read.
        """
        found: list[Obstacle] = []
        for root in self._loaded("Buildings", near):
            cache = UsdGeom.XformCache(Usd.TimeCode.EarliestTime())
            for building in root.GetFilteredChildren(_PREDICATE):
                shell = building.GetChild("Shell")
                if shell and shell.IsA("Mesh") and _is_visible(shell):
                    found += _floors(UsdGeom.Mesh(shell), _matrix(cache, shell), building)
        for name in ("Props", "Actors"):
            for root in self._loaded(name, near):
                cache = UsdGeom.XformCache(Usd.TimeCode.EarliestTime())
                for prop in root.GetFilteredChildren(_PREDICATE):
                    found += _prop(prop, cache)
        return found

    def _loaded(self, name: str, near: FloatArray) -> Iterator[Usd.Prim]:
        """Children of this name of the chunks near points; each is loaded while it is used."""
        world = self._stage.GetPrimAtPath("/World")
        for chunk in world.GetFilteredChildren(_PREDICATE) if world else ():
            part = chunk.GetChild(name)
            if not part or not _touches(part, near):
                continue
            path = part.GetPath()
            self._stage.Load(path, Usd.LoadWithoutDescendants)
            yield part
            self._stage.Unload(path)


def _is_visible(prim: Usd.Prim) -> bool:
    return UsdGeom.Imageable(prim).ComputeVisibility() != UsdGeom.Tokens.invisible


def _matrix(cache: UsdGeom.XformCache, prim: Usd.Prim) -> FloatArray:
    """4 x 4, for row vectors."""
    return np.array(cache.GetLocalToWorldTransform(prim), dtype=np.float64)


def _moved(points: object, matrix: FloatArray) -> FloatArray:
    local = np.asarray(points, dtype=np.float64).reshape(-1, 3)
    moved: FloatArray = local @ matrix[:3, :3] + matrix[3, :3]
    return moved


def _touches(prim: Usd.Prim, near: FloatArray) -> bool:
    """Whether the box of an unloaded payload holds any of the points in plan."""
    hint = prim.GetAttribute("extentsHint").Get()
    if not hint:
        return True
    cache = UsdGeom.XformCache(Usd.TimeCode.EarliestTime())
    box = _moved(_box_corners(hint), _matrix(cache, prim))[:, :2]
    inside = (near >= box.min(axis=0) - 1.0) & (near <= box.max(axis=0) + 1.0)
    return bool(inside.all(axis=1).any())


def _box_corners(hint: Sequence[Gf.Vec3f]) -> FloatArray:
    corners: FloatArray = np.array(hint[:2], dtype=np.float64)[_BOX, [0, 1, 2]]
    return corners


def _triangles(mesh: UsdGeom.Mesh, matrix: FloatArray) -> FloatArray:
    """Faces as fans of triangles, T x 3 x 3."""
    points = _moved(mesh.GetPointsAttr().Get(), matrix)
    sizes = np.asarray(mesh.GetFaceVertexCountsAttr().Get(), dtype=np.int64)
    corners = np.asarray(mesh.GetFaceVertexIndicesAttr().Get(), dtype=np.int64)
    first = np.cumsum(sizes) - sizes
    fans = [
        corners[first[sizes > turn + 2, None] + np.array([0, turn + 1, turn + 2])]
        for turn in range(int(sizes.max(initial=3)) - 2)
    ]
    triangles: FloatArray = points[np.concatenate(fans)] if fans else np.empty((0, 3, 3))
    return triangles


def _floors(mesh: UsdGeom.Mesh, matrix: FloatArray, building: Usd.Prim) -> Iterator[Obstacle]:
    """The floors of a building near the ground, as seen from below."""
    triangles = _triangles(mesh, matrix)
    if not len(triangles):
        return
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    length = np.maximum(np.linalg.norm(normal, axis=1), 1e-12)
    low, high = float(triangles[:, :, 2].min()), float(triangles[:, :, 2].max())
    below = triangles[:, :, 2].max(axis=1) < low + _ABOVE
    for corners in triangles[(normal[:, 2] / length < _DOWN) & below]:
        yield Obstacle(str(building.GetPath()), corners[::-1, :2], low, high)


def _prop(prim: Usd.Prim, cache: UsdGeom.XformCache) -> Iterator[Obstacle]:
    hint = prim.GetAttribute("extentsHint").Get()
    if not hint or not _is_visible(prim):
        return
    matrix = _matrix(cache, prim)
    corners = _moved(_box_corners(hint), matrix)
    low, high = float(corners[:, 2].min()), float(corners[:, 2].max())
    if high - low < _FLAT:
        return
    names = {_text(prim, "category"), _text(prim, "segmentation_class")}
    if names & _SLENDER:
        angle = np.arange(_CORNERS) * 2 * np.pi / _CORNERS
        outline = matrix[3, :2] + _POLE * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    else:
        outline = corners[[0, 4, 6, 2], :2]
    yield Obstacle(str(prim.GetPath()), outline, low, high)


def _text(prim: Usd.Prim, name: str) -> str:
    value = prim.GetAttribute(f"userProperties:{name}").Get()
    return value if isinstance(value, str) else ""
