"""Traverses a composed stage and collects the drawable prims."""

from dataclasses import replace

import numpy as np
from pxr import Gf, Usd, UsdGeom, UsdLux, UsdShade

from envgen_usd.errors import Issue, Severity
from envgen_usd.models.array_types import FloatArray
from envgen_usd.render.gprims import read_gprim
from envgen_usd.render.placed_parts import Context, Meaning, Part, column_matrix, placed, refined
from envgen_usd.render.prim_semantics import Semantics, is_component, owner_of
from envgen_usd.render.render_scene import Geometry, Lane
from envgen_usd.render.stage_lamps import Lamp, read_lamp
from envgen_usd.render.stage_lanes import read_lane
from envgen_usd.render.stage_materials import MaterialTable
from envgen_usd.render.stage_meshes import BadMeshError, FaceGroup, face_count, read_geometries

_DRAWN = (UsdGeom.Tokens.default_, UsdGeom.Tokens.render)
_IDENTITY = Gf.Matrix4d(1.0)


class Traversal:
    """Content of a stage, collected during the traversal.

    Attributes:
        materials: Looks.
        semantics: Classes and objects.
        geometries: Meshes; those of a prototype once.
        lanes: Centre lines of driving lanes.
        lamps: Lamps; those of a prototype once.
        issues: Prims that cannot be drawn.
    """

    def __init__(self, stage: Usd.Stage, time: Usd.TimeCode) -> None:
        """Starts empty; values are read at `time`."""
        self.materials = MaterialTable(time)
        self.semantics = Semantics(time)
        self.geometries: list[Geometry] = []
        self.lanes: list[Lane] = []
        self.lamps: list[Lamp] = []
        self.issues: list[Issue] = []
        self._stage = stage
        self._time = time
        self._templates: dict[tuple[str, int, bool], list[Part]] = {}

    def parts(self, prim: Usd.Prim, above: Context) -> list[Part]:
        """All parts at and below a prim; `above` holds the inherited properties."""
        context = self._enter(prim, above)
        if context is None:
            return []
        if prim.IsInstance():
            return self._instance(prim, context)
        if UsdGeom.PointInstancer(prim):
            return self._point_instances(UsdGeom.PointInstancer(prim), context)
        parts: list[Part] = []
        if UsdGeom.Gprim(prim):
            parts = self._gprim(prim, context)
        elif UsdLux.LightAPI(prim):
            parts = self._lamp(prim, context)
        for child in prim.GetChildren():
            parts += self.parts(child, context)
        return parts

    def _enter(self, prim: Usd.Prim, above: Context) -> Context | None:
        """Properties that a prim's children inherit, or `None` for an invisible prim."""
        if prim.IsPseudoRoot() or not UsdGeom.Imageable(prim):
            return replace(above, root=False)
        imageable = UsdGeom.Imageable(prim)
        if imageable.GetVisibilityAttr().Get(self._time) == UsdGeom.Tokens.invisible:
            return None
        matrix = above.matrix if above.root else self._matrix(prim, above.matrix)
        if not np.isfinite(matrix).all():
            self._report(prim, "stage.transform", "the transformation is not finite")
            return None
        purpose = imageable.GetPurposeAttr()
        named = self._meaning(prim)
        label, part = refined(named, (above.label, above.part))
        owner, firm = above.owner, above.firm
        if not firm and is_component(prim):
            owner, firm = owner_of(prim), True
        elif not owner and named[0]:
            owner = str(prim.GetPath())
        return replace(
            above,
            matrix=matrix,
            label=label,
            part=part,
            owner=owner,
            firm=firm,
            purpose=purpose.Get() if purpose.HasAuthoredValue() else above.purpose,
            root=False,
        )

    def _meaning(self, prim: Usd.Prim) -> Meaning:
        return self.semantics.direct_label(prim), self.semantics.direct_part(prim)

    def _matrix(self, prim: Usd.Prim, above: FloatArray) -> FloatArray:
        xformable = UsdGeom.Xformable(prim)
        if not xformable:
            return above
        local = xformable.GetLocalTransformation(self._time)
        if xformable.GetResetXformStack():
            return world_matrix(self._stage) @ column_matrix(local)
        return above if local == _IDENTITY else above @ column_matrix(local)

    def _gprim(self, prim: Usd.Prim, context: Context) -> list[Part]:
        if UsdGeom.Curves(prim):
            lane = read_lane(UsdGeom.Curves(prim), context.matrix, self._time)
            self.lanes += [lane] if lane is not None else []
            return []
        if context.purpose not in _DRAWN:
            return []
        if UsdGeom.Mesh(prim):
            return self._mesh(UsdGeom.Mesh(prim), context)
        geometry = read_gprim(UsdGeom.Gprim(prim), self._bound(prim, context), self._time)
        if geometry is None:
            self._report(prim, "stage.unsupported", f"{prim.GetTypeName()} is not supported")
            return []
        return [self._part(geometry, context, (context.label, context.part))]

    def _lamp(self, prim: Usd.Prim, context: Context) -> list[Part]:
        lamp = read_lamp(prim, self._time)
        if lamp is None or not lamp.power.any():
            return []
        if not np.isfinite(lamp.power).all():
            self._report(prim, "stage.lamp", "its light is not finite")
            return []
        self.lamps.append(lamp)
        number = len(self.lamps) - 1
        return [Part(number, context.matrix[None], None, "", firm=False, is_lamp=True)]

    def _mesh(self, mesh: UsdGeom.Mesh, context: Context) -> list[Part]:
        groups = self._groups(mesh, context)
        try:
            read = read_geometries(mesh, [group for group, _ in groups], self._time)
        except BadMeshError as error:
            self._report(mesh.GetPrim(), "stage.mesh", str(error))
            return []
        pairs = zip(read, groups, strict=True)
        return [self._part(g, context, meaning) for g, (_, meaning) in pairs if g is not None]

    def _part(self, geometry: Geometry, context: Context, meaning: Meaning) -> Part:
        self.geometries.append(geometry)
        index = len(self.geometries) - 1
        label, part = meaning
        return Part(index, context.matrix[None], label, context.owner, context.firm, part)

    def _groups(self, mesh: UsdGeom.Mesh, context: Context) -> list[tuple[FaceGroup, Meaning]]:
        """Faces of a mesh by material and labels, from its GeomSubsets."""
        whole = self._bound(mesh.GetPrim(), context)
        kinds: list[tuple[int, Meaning]] = [(whole, (context.label, context.part))]
        kind_of = np.zeros(face_count(mesh, self._time), np.int64)
        for subset in UsdGeom.Subset.GetAllGeomSubsets(mesh):
            if subset.GetElementTypeAttr().Get() != UsdGeom.Tokens.face:
                continue
            faces = np.array(subset.GetIndicesAttr().Get(self._time) or (), np.int64)
            faces = faces[(faces >= 0) & (faces < len(kind_of))]
            material = self._bound(subset.GetPrim(), context)
            named = self._meaning(subset.GetPrim())
            for old in np.unique(kind_of[faces]).tolist():
                chosen = material if material != whole else kinds[old][0]
                kinds.append((chosen, refined(named, kinds[old][1])))
                kind_of[faces[kind_of[faces] == old]] = len(kinds) - 1
        looks = self.materials.materials
        chosen_faces = (kind_of == k if len(kinds) > 1 else None for k in range(len(kinds)))
        return [
            (FaceGroup(faces, material, looks[material]), meaning)
            for faces, (material, meaning) in zip(chosen_faces, kinds, strict=True)
        ]

    def _bound(self, prim: Usd.Prim, context: Context) -> int:
        if context.overrides:
            return context.material
        material, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()
        return self.materials.index(material) if material else context.material

    def _instance(self, prim: Usd.Prim, context: Context) -> list[Part]:
        material, binding = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()
        if material and not context.overrides:
            strength = UsdShade.MaterialBindingAPI.GetMaterialBindingStrength(binding)
            strong = strength == UsdShade.Tokens.strongerThanDescendants
            context = replace(context, material=self.materials.index(material), overrides=strong)
        template = self._template(prim.GetPrototype(), context)
        path = str(prim.GetPath())
        return [placed(part, context, context.matrix[None], path) for part in template]

    def _template(self, prototype: Usd.Prim, context: Context) -> list[Part]:
        """Parts of a prototype in its space; paths of owners are relative to it."""
        root = str(prototype.GetPath())
        key = (root, context.material, context.overrides)
        if key not in self._templates:
            start = Context(
                np.eye(4),
                purpose=context.purpose,
                material=context.material,
                overrides=context.overrides,
                root=True,
            )
            parts = self.parts(prototype, start)
            self._templates[key] = [replace(p, owner=p.owner.removeprefix(root)) for p in parts]
        return self._templates[key]

    def _point_instances(self, instancer: UsdGeom.PointInstancer, context: Context) -> list[Part]:
        numbers = np.array(instancer.GetProtoIndicesAttr().Get(self._time) or (), np.int64)
        raw = instancer.ComputeInstanceTransformsAtTime(
            self._time,
            self._time,
            UsdGeom.PointInstancer.ExcludeProtoXform,
            UsdGeom.PointInstancer.IgnoreMask,
        )
        local = np.array(raw, np.float64).reshape(-1, 4, 4).transpose(0, 2, 1)
        if len(local) != len(numbers):
            self._report(instancer.GetPrim(), "stage.instancer", "arrays differ in length")
            return []
        mask = instancer.ComputeMaskAtTime(self._time)
        seen = np.array(mask, bool) if mask else np.ones(len(numbers), bool)
        finite = np.isfinite(local).all(axis=(1, 2))
        if not finite.all():
            text = f"{np.count_nonzero(~finite)} of {len(local)} instances are not finite"
            self._report(instancer.GetPrim(), "stage.instancer", text)
        seen &= finite
        parts: list[Part] = []
        for number, target in enumerate(instancer.GetPrototypesRel().GetTargets()):
            prototype = self._stage.GetPrimAtPath(target)
            chosen = local[(numbers == number) & seen]
            if not prototype or not len(chosen):
                continue
            matrices = context.matrix @ chosen @ self._matrix(prototype, np.eye(4))
            template = self._template(prototype, context)
            parts += [placed(part, context, matrices, str(target)) for part in template]
        return parts

    def _report(self, prim: Usd.Prim, kind: str, message: str) -> None:
        where = str(prim.GetPath())
        self.issues.append(Issue(kind, Severity.WARNING, where, message, "left out"))


def world_matrix(stage: Usd.Stage) -> FloatArray:
    """From stage units and axes to metres, z up: 4 x 4."""
    matrix = np.eye(4)
    if UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.y:
        matrix[1:3, 1:3] = ((0.0, -1.0), (1.0, 0.0))
    matrix[:3, :3] *= UsdGeom.GetStageMetersPerUnit(stage)
    return matrix
