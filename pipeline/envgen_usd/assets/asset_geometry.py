"""Checks the geometry of an asset: materials, part labels, and stated sizes."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from pxr import Usd, UsdGeom, UsdSemantics, UsdShade  # type: ignore[attr-defined]

from envgen_usd.assets.asset_catalogue import Asset
from envgen_usd.assets.usd_values import from_vectors
from envgen_usd.errors import Issue, Severity
from envgen_usd.label_taxonomy import parts
from envgen_usd.models.array_types import FloatArray

GROUND_TOLERANCE = 0.05
"""Largest distance of an asset's lowest point from the ground, metres.

A larger value tolerates more.
"""
SIZE_TOLERANCE = 0.05
"""Largest difference of a stated size from the geometry's, metres; larger values tolerate more."""
SIZE_SHARE = 0.1
"""The same as a share of the size; the larger of both tolerances counts."""
CONTAINED = 1e-3
"""Largest distance by which geometry may exceed `extentsHint`, metres."""
_HANGING = {"window", "door", "roof_window"}
_DRAWN = {UsdGeom.Tokens.default_, UsdGeom.Tokens.render}


@dataclass
class StatedSizes:
    """Compares the stated sizes of an asset with its geometry in all variants.

    Some variants take parts away, so a stated size has to fit all variants that share it. The
    height of a standing asset counts from the ground.
    """

    asset: Asset
    _boxes: dict[tuple[bytes, bytes], FloatArray] = field(default_factory=dict)
    _where: dict[tuple[bytes, bytes], str] = field(default_factory=dict)

    def add(self, chosen: Mapping[str, str], where: str, box: FloatArray) -> None:
        """Adds the geometry's box (2 x 3) with these variants."""
        key = self.asset.size(chosen).tobytes(), self.asset.extent(chosen).tobytes()
        other = self._boxes.get(key, box)
        self._where.setdefault(key, where)
        low, high = np.minimum(other[0], box[0]), np.maximum(other[1], box[1])
        self._boxes[key] = np.stack([low, high])

    def check(self) -> Iterator[Issue]:
        """Yields an issue for each stated size that disagrees with the geometry."""
        for (size_bytes, hint_bytes), box in self._boxes.items():
            size, hint = np.frombuffer(size_bytes), np.frombuffer(hint_bytes).reshape(2, 3)
            where = self._where[size_bytes, hint_bytes]
            real = _filled(self.asset, box)
            tolerance = np.maximum(SIZE_TOLERANCE, SIZE_SHARE * real)
            if (np.abs(size - real) > tolerance).any():
                text = f"nominal_size {_shown(size)} is not the geometry's size {_shown(real)}"
                yield Issue("library.size", Severity.ERROR, where, text)
            if (hint[0] > box[0] + CONTAINED).any() or (hint[1] < box[1] - CONTAINED).any():
                text = f"extentsHint {_shown(hint)} does not contain the geometry {_shown(box)}"
                yield Issue("library.extent", Severity.ERROR, where, text)
            elif (np.abs(hint - box) > tolerance).any():
                text = f"extentsHint {_shown(hint)} is larger than the geometry {_shown(box)}"
                yield Issue("library.extent", Severity.ERROR, where, text)


def _filled(asset: Asset, box: FloatArray) -> FloatArray:
    """Size (3, metres) that scaling refers to: of a window, what lies in its unit box."""
    low, high = box
    if asset.kind not in _HANGING:
        return np.array([*(high - low)[:2], high[2]])
    inside: FloatArray = np.minimum(high, [1.0, np.inf, 1.0]) - np.maximum(low, [0.0, low[1], 0.0])
    return inside


def _shown(values: FloatArray) -> str:
    return str(np.round(values, 3).tolist())


def check_meshes(drawn: Sequence[Usd.Prim], where: str) -> Iterator[Issue]:
    """Checks that each drawn mesh or subset has a material and a label of `part`."""
    known = set(parts())
    query = UsdSemantics.LabelsQuery("part", Usd.TimeCode.Default())
    pieces: list[Usd.Prim] = []
    for prim in drawn:
        subsets = UsdShade.MaterialBindingAPI(prim).GetMaterialBindSubsets()
        pieces += [subset.GetPrim() for subset in subsets] or [prim]
    # All at once: they share parents, whose bindings are then found once.
    materials, _ = UsdShade.MaterialBindingAPI.ComputeBoundMaterials(pieces)
    for piece, material in zip(pieces, materials, strict=True):
        if not material:
            text = f"{piece.GetPath()} has no material"
            yield Issue("library.material", Severity.ERROR, where, text)
        names = query.ComputeUniqueInheritedLabels(piece)
        if not names:
            text = f"{piece.GetPath()} has no label of the taxonomy 'part'"
            yield Issue("library.part", Severity.ERROR, where, text)
        for name in sorted(set(map(str, names)) - known):
            text = f"{piece.GetPath()}: part '{name}' is not in the label taxonomy"
            yield Issue("library.part", Severity.ERROR, where, text)


def check_points(
    meshes: Sequence[Usd.Prim], where: str, seen: set[tuple[str, str]]
) -> Iterator[Issue]:
    """Checks that no two points of a mesh are the same in all that they hold.

    Such points cost memory and tear where a program moves them.

    Args:
        meshes: Meshes of an asset.
        where: The asset's file and variants.
        seen: Layer and path of the meshes that were checked before; grows.
    """
    for prim in meshes:
        source = prim.GetPrimStack()[-1]
        key = source.layer.identifier, str(source.path)
        count = 0 if key in seen else _repeated(UsdGeom.Mesh(prim))
        seen.add(key)
        if count:
            text = f"{count} points of {prim.GetPath()} repeat others"
            action = "merge them, or move touching pieces apart"
            yield Issue("library.points", Severity.WARNING, where, text, action)


def _repeated(mesh: UsdGeom.Mesh) -> int:
    """Number of points that repeat the place and all vertex values of another."""
    points = mesh.GetPointsAttr().Get()
    if not points:
        return 0
    columns = [np.array(points, np.float32)]
    vertex = {UsdGeom.Tokens.vertex, UsdGeom.Tokens.varying}
    normals = mesh.GetNormalsAttr().Get()
    if normals and mesh.GetNormalsInterpolation() in vertex:
        columns.append(np.array(normals, np.float32))
    for primvar in UsdGeom.PrimvarsAPI(mesh.GetPrim()).GetPrimvarsWithAuthoredValues():
        if primvar.GetInterpolation() in vertex:
            columns.append(np.array(primvar.ComputeFlattened(), np.float32))
    rows = np.column_stack([each.reshape(len(points), -1) for each in columns]) + 0.0
    kinds = np.ascontiguousarray(rows).view(f"V{rows.shape[1] * 4}")
    return len(rows) - len(np.unique(kinds))


def check_ground(asset: Asset, box: FloatArray, where: str) -> Iterator[Issue]:
    """Checks that a standing asset touches the ground."""
    low = box[0, 2]
    if asset.kind not in _HANGING and abs(low) > GROUND_TOLERANCE:
        text = f"the lowest point is {low:.3f} m from the ground"
        yield Issue("library.ground", Severity.WARNING, where, text)


def drawn_meshes(meshes: Sequence[Usd.Prim]) -> list[Usd.Prim]:
    """Those that are no proxies or guides."""
    return [prim for prim in meshes if UsdGeom.Imageable(prim).ComputePurpose() in _DRAWN]


@dataclass
class DrawnBoxes:
    """Boxes of the drawn meshes of a stage, whatever variants are chosen.

    Variants take turns with the same meshes, whose boxes are computed once.
    """

    _known: dict[tuple[object, ...], FloatArray] = field(default_factory=dict)

    def box(self, drawn: Sequence[Usd.Prim]) -> FloatArray | None:
        """2 x 3 bounding box of the drawn meshes, metres; `None` without any points."""
        cache = UsdGeom.XformCache()
        boxes = [box for prim in drawn if (box := self._box(prim, cache)) is not None]
        if not boxes:
            return None
        low = np.min([box[0] for box in boxes], axis=0)
        high = np.max([box[1] for box in boxes], axis=0)
        both: FloatArray = np.stack([low, high])
        return both

    def _box(self, prim: Usd.Prim, cache: UsdGeom.XformCache) -> FloatArray | None:
        attribute = UsdGeom.Mesh(prim).GetPointsAttr()
        source = attribute.GetPropertyStack(Usd.TimeCode.Default())
        if not source:
            return None
        matrix = from_vectors(cache.GetLocalToWorldTransform(prim))
        key = tuple((spec.layer.identifier, str(spec.path)) for spec in source), matrix.tobytes()
        if key not in self._known:
            points = attribute.Get()
            if not points:
                return None
            moved = from_vectors(points) @ matrix[:3, :3] + matrix[3, :3]
            self._known[key] = np.stack([moved.min(axis=0), moved.max(axis=0)])
        return self._known[key]
