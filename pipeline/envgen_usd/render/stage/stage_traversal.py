"""Traverses a composed stage and collects the drawable prims."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from math import isfinite
from typing import Any
from weakref import WeakValueDictionary

import numpy as np
from pxr import Pcp, Sdf, Tf, Usd, UsdGeom, UsdShade

from envgen_usd.errors import Issue, Severity
from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.render.render_scene import Lane
from envgen_usd.render.stage.gprims import read_gprim
from envgen_usd.render.stage.mesh_batches import geometries_of
from envgen_usd.render.stage.placed_parts import (
    Context,
    Instance,
    Levels,
    Meaning,
    Part,
    Placement,
    Slot,
    Template,
    column_matrix,
    placed,
    refined,
)
from envgen_usd.render.stage.prim_semantics import (
    LABELS,
    PART_OF,
    PARTS,
    TAXONOMY,
    Semantics,
    is_component,
    owner_of,
)
from envgen_usd.render.stage.stage_instances import read_instances
from envgen_usd.render.stage.stage_lamps import read_lamp
from envgen_usd.render.stage.stage_lanes import read_lane
from envgen_usd.render.stage.stage_materials import MaterialTable
from envgen_usd.render.stage.stage_meshes import (
    FaceGroup,
    MeshArrays,
    read_mesh,
    read_topology,
)
from envgen_usd.render.stage.typed_values import BadValueError, whole_numbers
from envgen_usd.render.stage.usd_errors import usd_fault

_DRAWN = (UsdGeom.Tokens.default_, UsdGeom.Tokens.render)
_PROXY = UsdGeom.Tokens.proxy
_CLASS_LABELS, _PART_LABELS = LABELS + TAXONOMY, LABELS + PARTS
_BINDING = "material:binding"
_SKELETON_ROOT = "SkelRoot"
_FACE = UsdGeom.Tokens.face
_BATCH = 200_000
"""Corners of the meshes that are triangulated at once; a larger value takes more memory."""


def no_gate(_prim: Usd.Prim, _context: Context) -> bool:
    """The gate of a traversal that visits everything itself."""
    return False


class Traversal:
    """Content of a stage, collected during the traversal.

    Attributes:
        materials: Looks.
        semantics: Classes and objects.
        placements: What is drawn; each geometry is in its slot after `finish`.
        lanes: Centre lines of driving lanes.
        issues: Prims that cannot be drawn.
        gate: Called before the children of a prim are visited; True if it has visited them.
        apart: Paths of prims that are not visited: what moves.
        inherited: What the prims of `apart` that were met inherit from above, by path.
        world: 4 x 4, from the stage to metres with z up, for column vectors.
    """

    def __init__(
        self,
        stage: Usd.Stage,
        time: Usd.TimeCode,
        gate: Callable[[Usd.Prim, Context], bool] = no_gate,
    ) -> None:
        """Starts empty.

        Args:
            stage: Stage.
            time: Values are read at this time.
            gate: As the attribute.
        """
        self.materials = MaterialTable(time)
        self.semantics = Semantics(time)
        self.placements: list[Placement] = []
        self.lanes: list[Lane] = []
        self.issues: list[Issue] = []
        self._stage = stage
        self._time = time
        self.gate = gate
        self.apart: frozenset[Sdf.Path] = frozenset()
        self.inherited: dict[Sdf.Path, Context] = {}
        self.world = world_matrix(stage)
        self._xforms = UsdGeom.XformCache(time)
        self._templates: WeakValueDictionary[object, Template] = WeakValueDictionary()
        self._contents: dict[str, object] = {}
        self._meshes: list[tuple[MeshArrays, list[Slot]]] = []
        self._corners = 0
        self._levels: dict[str, Levels] = {}

    def visit(self, prim: Usd.Prim, above: Context) -> None:
        """Collects what is at and below a prim; `above` holds the inherited properties."""
        if self.apart and not above.body and prim.GetPath() in self.apart:
            self.inherited[prim.GetPath()] = above
            return
        context = self._enter(prim, above)
        if context is None:
            return
        if prim.IsInstance():
            self._instance(prim, context)
            return
        if prim.IsA("PointInstancer"):
            self._point_instances(UsdGeom.PointInstancer(prim), context)
            return
        if prim.IsA("Gprim"):
            self._gprim(prim, context)
        elif prim.HasAPI("LightAPI"):
            self._lamp(prim, context)
        elif prim.GetTypeName() == _SKELETON_ROOT:
            text = "skeletons are not supported; meshes stand as they are modelled"
            self._report(prim, "stage.skeleton", text, action="drawn so")
        if not self.gate(prim, context):
            self.visit_children(prim, context)

    def visit_children(self, prim: Usd.Prim, context: Context) -> None:
        """Collects what is below a prim; `context` holds what its children inherit."""
        for child in _children(prim):
            self.visit(child, context)

    def context_above(self, prim: Usd.Prim) -> Context | None:
        """What a prim inherits from above; `None` below an invisible prim."""
        parent = prim.GetParent()
        if parent.IsPseudoRoot():
            return Context(self.world)
        above = self.context_above(parent)
        return above and self._enter(parent, above)

    def separately(self, visit: Callable[[], None]) -> list[Placement]:
        """Returns what a visit collects, triangulated; earlier placements stay apart."""
        outer, self.placements = self.placements, []
        visit()
        self.finish()
        inner, self.placements = self.placements, outer
        self._levels = {}
        self._xforms = UsdGeom.XformCache(self._time)
        self.semantics.forget_prims()
        return inner

    def finish(self) -> None:
        """Triangulates the meshes so far, and fills their slots."""
        batches = geometries_of([mesh for mesh, _ in self._meshes])
        for found, (_, slots) in zip(batches, self._meshes, strict=True):
            for geometry, slot in zip(found, slots, strict=True):
                slot.geometry = geometry
        self._meshes, self._corners = [], 0

    def _enter(self, prim: Usd.Prim, above: Context) -> Context | None:
        """Properties that a prim's children inherit, or `None` for an invisible prim."""
        if prim.IsPseudoRoot() or not prim.IsA("Imageable"):
            return above._replace(root=False, body=False)
        names = prim.GetAuthoredPropertyNames()
        if "visibility" in names and not above.body:
            visibility = UsdGeom.Imageable(prim).GetVisibilityAttr().Get(self._time)
            if visibility == UsdGeom.Tokens.invisible:
                return None
        matrix = above.matrix
        if not (above.root or above.body) and "xformOpOrder" in names:
            matrix = self._matrix(prim, matrix)
            if not isfinite(matrix.sum()):
                self._report(prim, "stage.transform", "the transformation is not finite")
                return None
        label, part, owner, firm = above.label, above.part, above.owner, above.firm
        named = self._meaning(prim, names)
        if named != (None, None):
            label, part = refined(named, (label, part))
        if not firm and is_component(prim):
            owner, firm = owner_of(prim) if PART_OF in names else str(prim.GetPath()), True
        elif not owner and named[0]:
            owner = str(prim.GetPath())
        purpose = above.purpose
        if "purpose" in names:
            authored = UsdGeom.Imageable(prim).GetPurposeAttr()
            token = authored.Get() if authored.HasAuthoredValue() else None
            purpose = token if isinstance(token, str) else purpose
        bound = above.bound or _BINDING in " ".join(names)
        return Context(
            matrix, label, part, owner, firm, purpose, above.material, above.overrides, bound
        )

    def _meaning(self, prim: Usd.Prim, names: list[str]) -> Meaning:
        """Labels on a prim, whose authored properties are given."""
        label = self.semantics.direct_label(prim) if _CLASS_LABELS in names else None
        return label, self.semantics.direct_part(prim) if _PART_LABELS in names else None

    def _matrix(self, prim: Usd.Prim, above: FloatArray) -> FloatArray:
        if not prim.IsA("Xformable"):
            return above
        try:
            local, resets = self._xforms.GetLocalTransformation(prim)
        except Tf.ErrorException as error:
            raise usd_fault(error, f"the transformation of {prim.GetPath()}") from error
        product: FloatArray = (self.world if resets else above) @ column_matrix(local)
        return product

    def _gprim(self, prim: Usd.Prim, context: Context) -> None:
        if prim.IsA("Curves"):
            self._lane(UsdGeom.Curves(prim), context)
        elif context.purpose not in _DRAWN and not _is_far_level(prim, context):
            return
        elif prim.IsA("Mesh"):
            self._mesh(UsdGeom.Mesh(prim), context)
        else:
            self._solid(prim, context)

    def _lane(self, curves: UsdGeom.Curves, context: Context) -> None:
        try:
            lane = read_lane(curves, context.matrix, self._time)
        except BadValueError as error:
            self._report(curves.GetPrim(), "stage.lane", str(error), curves.GetPointsAttr())
            return
        if lane is not None:
            self.lanes.append(lane)
        elif context.purpose in _DRAWN:
            self._unsupported(curves.GetPrim())

    def _solid(self, prim: Usd.Prim, context: Context) -> None:
        try:
            geometry = read_gprim(UsdGeom.Gprim(prim), self._bound(prim, context), self._time)
        except BadValueError as error:
            self._report(prim, "stage.value", str(error))
            return
        if geometry is None:
            self._unsupported(prim)
            return
        self._add_part(Slot(geometry), context, (context.label, context.part))

    def _lamp(self, prim: Usd.Prim, context: Context) -> None:
        try:
            lamp = read_lamp(prim, self._time)
        except BadValueError as error:
            self._report(prim, "stage.lamp", str(error))
            return
        if lamp is None or not lamp.power.any():
            return
        part = Part(Slot(), context.matrix[None], None, "", firm=False, lamp=lamp)
        self.placements.append(part)

    def _mesh(self, mesh: UsdGeom.Mesh, context: Context) -> None:
        try:
            topology = read_topology(mesh, self._time)
        except BadValueError as error:
            self._report(mesh.GetPrim(), "stage.mesh", str(error), mesh.GetPointsAttr())
            return
        group_of, kinds = self._groups(mesh, context, len(topology.sizes))
        looks = self.materials.materials
        groups = [FaceGroup(material, looks[material]) for material, _ in kinds]
        levels = self._levels_of(mesh.GetPrim(), context)
        slots = [Slot(levels=levels) for _ in kinds]
        if levels is not None:
            (levels.far if context.purpose == _PROXY else levels.near).extend(slots)
        arrays = read_mesh(mesh, topology, group_of, groups, self._time)
        self._meshes.append((arrays, slots))
        for slot, (_, meaning) in zip(slots, kinds, strict=True):
            self._add_part(slot, context, meaning)
        self._corners += len(topology.corners)
        if self._corners > _BATCH:
            self.finish()

    def _levels_of(self, prim: Usd.Prim, context: Context) -> Levels | None:
        """The levels of detail that a mesh belongs to."""
        target = str(prim.GetPath()) if context.purpose == _PROXY else _far_level(prim)
        return self._levels.setdefault(target, Levels()) if target else None

    def _add_part(self, slot: Slot, context: Context, meaning: Meaning) -> None:
        label, part = meaning
        matrices = context.matrix[None]
        self.placements.append(Part(slot, matrices, label, context.owner, context.firm, part))

    def _groups(
        self, mesh: UsdGeom.Mesh, context: Context, faces: int
    ) -> tuple[IntArray, list[tuple[int, Meaning]]]:
        """Group of each face, and material and labels of the groups, from its GeomSubsets."""
        whole = self._bound(mesh.GetPrim(), context)
        kinds: list[tuple[int, Meaning]] = [(whole, (context.label, context.part))]
        group_of = np.zeros(faces, np.int64)
        for subset in UsdGeom.Subset.GetAllGeomSubsets(mesh):
            prim = subset.GetPrim()
            names = prim.GetAuthoredPropertyNames()
            if "elementType" in names and subset.GetElementTypeAttr().Get() != _FACE:
                continue
            chosen = self._chosen(subset)
            chosen = chosen[(chosen >= 0) & (chosen < faces)]
            inner = (
                context if context.bound else context._replace(bound=_BINDING in " ".join(names))
            )
            material, named = self._bound(prim, inner), self._meaning(prim, names)
            groups = group_of[chosen]
            for old in np.flatnonzero(np.bincount(groups)).tolist():
                look = material if material != whole else kinds[old][0]
                kinds.append((look, refined(named, kinds[old][1])))
                group_of[chosen[groups == old]] = len(kinds) - 1
        return group_of, kinds

    def _chosen(self, subset: UsdGeom.Subset) -> IntArray:
        """Faces of a subset."""
        try:
            return whole_numbers(subset.GetIndicesAttr(), self._time)
        except BadValueError as error:
            self._report(subset.GetPrim(), "stage.value", str(error))
            return np.empty(0, np.int64)

    def _bound(self, prim: Usd.Prim, context: Context) -> int:
        if context.overrides or not context.bound:
            return context.material
        material, _ = _bound_material(prim)
        return self.materials.index(material) if material else context.material

    def _instance(self, prim: Usd.Prim, context: Context) -> None:
        if context.bound and not context.overrides:
            material, binding = _bound_material(prim)
            if material:
                strength = UsdShade.MaterialBindingAPI.GetMaterialBindingStrength(binding)
                strong = strength == UsdShade.Tokens.strongerThanDescendants
                number = self.materials.index(material)
                context = context._replace(material=number, overrides=strong)
        template = self._template(prim.GetPrototype(), context, prim)
        self.placements.append(Instance(template, context, str(prim.GetPath())))

    def _template(
        self, prototype: Usd.Prim, context: Context, instance: Usd.Prim | None = None
    ) -> Template:
        """Parts of a prototype in its space.

        Prototypes get other paths when their instances are loaded again; `instance` tells what they
        are composed of.
        """
        root = str(prototype.GetPath())
        if root not in self._contents:
            self._contents[root] = root if instance is None else _arcs(instance)
        key = (self._contents[root], context.material, context.overrides, context.purpose)
        template = self._templates.get(key)
        if template is None:
            start = Context(
                np.eye(4),
                purpose=context.purpose,
                material=context.material,
                overrides=context.overrides,
                root=True,
            )
            outer, self.placements = self.placements, []
            self.visit(prototype, start)
            inner, self.placements = self.placements, outer
            template = self._templates[key] = Template(tuple(_relative(inner, root)))
        return template

    def _point_instances(self, instancer: UsdGeom.PointInstancer, context: Context) -> None:
        found = read_instances(instancer, self._time)
        if found.fault:
            self._report(instancer.GetPrim(), "stage.instancer", found.fault, found.faulty)
        targets = instancer.GetPrototypesRel().GetTargets()
        for number, target in enumerate(targets):
            prototype = self._stage.GetPrimAtPath(target)
            chosen = found.matrices[found.prototypes == number]
            if not prototype:
                self._report(instancer.GetPrim(), "stage.instancer", f"there is no {target}")
            if not prototype or not len(chosen):
                continue
            matrices = context.matrix @ chosen @ self._matrix(prototype, np.eye(4))
            template = self._template(prototype, context)
            path = copies_path(instancer.GetPath(), target, targets)
            self.placements += [placed(part, context, matrices, path) for part in template.parts]

    def _unsupported(self, prim: Usd.Prim) -> None:
        self._report(prim, "stage.unsupported", f"{prim.GetTypeName()} is not supported")

    def _report(
        self,
        prim: Usd.Prim,
        kind: str,
        message: str,
        attribute: Usd.Attribute | None = None,
        action: str = "left out",
    ) -> None:
        """Names a prim, and the file with its strongest opinion or with that of an attribute."""
        stack: Any = attribute.GetPropertyStack(self._time) if attribute else prim.GetPrimStack()
        files = [spec.layer.identifier for spec in stack[:1] if not spec.layer.anonymous]
        text = " ".join([message, *(f"(file {file})" for file in files)])
        self.issues.append(Issue(kind, Severity.WARNING, str(prim.GetPath()), text, action))


def _bound_material(prim: Usd.Prim) -> tuple[UsdShade.Material, Usd.Relationship]:
    """The material of a prim for final pictures, or else that for previews, and its binding."""
    api = UsdShade.MaterialBindingAPI(prim)
    material, binding = api.ComputeBoundMaterial(UsdShade.Tokens.full)
    return (material, binding) if material else api.ComputeBoundMaterial(UsdShade.Tokens.preview)


def _children(prim: Usd.Prim) -> list[Usd.Prim]:
    """What is drawn below a prim: prototypes of instancers may lie below a class or an ``over``."""
    if prim.IsDefined() and not prim.IsAbstract():
        return list(prim.GetChildren())
    there = prim.GetFilteredChildren(Usd.PrimIsActive & Usd.PrimIsLoaded)
    return [child for child in there if child.HasDefiningSpecifier()]


def copies_path(instancer: Sdf.Path, target: Sdf.Path, targets: Sequence[Sdf.Path]) -> str:
    """Path that names the copies of a prototype, which several instancers may share."""
    if target.HasPrefix(instancer):
        return str(target)
    is_alone = sum(each.name == target.name for each in targets) == 1
    return f"{instancer}/{target.name}" if is_alone else f"{instancer}{target}"


def _far_level(prim: Usd.Prim) -> str:
    """Path of the mesh that replaces a mesh at a distance, beside it; empty without one."""
    if not prim.HasRelationship("proxyPrim"):
        return ""
    for target in UsdGeom.Imageable(prim).GetProxyPrimRel().GetTargets():
        stand_in = prim.GetStage().GetPrimAtPath(target)
        if stand_in and stand_in.IsActive() and stand_in.IsA("Mesh"):
            beside = stand_in.GetParent() == prim.GetParent()
            return str(target) if beside else ""
    return ""


def _is_far_level(prim: Usd.Prim, context: Context) -> bool:
    """True for a proxy that a mesh beside it names; other proxies are for interactive viewers."""
    if context.purpose != _PROXY or not prim.IsA("Mesh"):
        return False
    path = str(prim.GetPath())
    return any(_far_level(beside) == path for beside in prim.GetParent().GetChildren())


def _arcs(instance: Usd.Prim) -> object:
    """What an instance is composed of below its own opinions: arcs, layers and paths."""
    arcs: list[tuple[str, str, str]] = []

    def note(node: Any) -> None:  # noqa: ANN401 - Pcp has no types
        if node.hasSpecs and node.arcType != Pcp.ArcTypeRoot and not node.IsDueToAncestor():
            layer = node.layerStack.identifier.rootLayer.identifier
            arcs.append((str(node.arcType), layer, str(node.path)))
        for child in node.children:
            note(child)

    note(instance.GetPrimIndex().rootNode)
    return tuple(arcs)


def _relative(placements: list[Placement], root: str) -> list[Part]:
    """Parts of a prototype, with owners relative to its root."""
    parts = [
        part
        for placement in placements
        for part in ([placement] if isinstance(placement, Part) else placement.parts())
    ]
    return [replace(part, owner=part.owner.removeprefix(root)) for part in parts]


def world_matrix(stage: Usd.Stage) -> FloatArray:
    """From stage units and axes to metres, z up: 4 x 4."""
    matrix = np.eye(4)
    if UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.y:
        matrix[1:3, 1:3] = ((0.0, -1.0), (1.0, 0.0))
    matrix[:3, :3] *= UsdGeom.GetStageMetersPerUnit(stage)
    return matrix
