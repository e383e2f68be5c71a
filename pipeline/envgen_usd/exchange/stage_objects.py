"""Metadata of the objects of a stage: components, and the subcomponents inside them."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from math import isfinite
from typing import Any

import numpy as np
from pxr import Usd, UsdGeom, Vt

from envgen_usd.chunks import is_chunk_name
from envgen_usd.errors import Issue, Severity
from envgen_usd.models.array_types import FloatArray
from envgen_usd.render.stage.placed_parts import column_matrix
from envgen_usd.render.stage.stage_instances import read_instances
from envgen_usd.render.stage.stage_traversal import copies_path
from envgen_usd.render.stage.typed_values import BadValueError, rows

_USER = "userProperties:"
_ID, _KIND = "gml_id", "category"
_CLASS, _PART = "semantics:labels:class", "semantics:labels:part"
_ELSEWHERE = {_ID, _KIND, "segmentation_class", "asset", "asset_path", "part_of"}
"""Properties that are fields of their own, or that repeat one."""
_OBJECTS = {"component", "subcomponent"}
_ASSEMBLY = "assembly"
_DRAWN = Usd.PrimIsActive & Usd.PrimIsLoaded
"""Prims of prototypes, which may lie below a class or an ``over``."""


@dataclass(frozen=True, eq=False)
class StageObject:
    """A building, a tree, a window, a road surface, ... of a chunk.

    Attributes:
        path: Path of the prim.
        id: Id of the feature in the city model, or the name of the prim.
        kind: Category, e.g. ``tree``; without a category, the part label or the layer.
        label: Semantic class; empty without a label.
        layer: Layer of the stage, e.g. ``Props``.
        matrix: 4 x 4, to the world in stage units and axes, for column vectors.
        attributes: Further user properties.
        asset: Name of the asset; empty for geometry of its own.
        variants: Variant selections of the asset.
        size: Size of the asset along its axes, metres; empty where the stage gives none.
        part_of: Id of the object that contains it, or empty.
    """

    path: str
    id: str
    kind: str
    label: str
    layer: str
    matrix: FloatArray
    attributes: Mapping[str, Any] = field(default_factory=dict)
    asset: str = ""
    variants: Mapping[str, str] = field(default_factory=dict)
    size: tuple[float, ...] = ()
    part_of: str = ""

    def facts(self) -> dict[str, Any]:
        """What is known of the object, without empty entries, as JSON values."""
        names = ("id", "kind", "label", "path", "asset", "variants", "size", "part_of")
        facts = {name: getattr(self, name) for name in (*names, "attributes")}
        facts["class"] = facts.pop("label")
        return {name: value for name, value in facts.items() if value not in ("", {}, ())}


def layers_below(prim: Usd.Prim) -> list[Usd.Prim]:
    """The layers of a chunk or of a whole stage: the groups and objects right below.

    Assemblies, e.g. the world, and chunks inside them are no layers.
    """
    found = []
    for child in prim.GetChildren():
        if str(child.GetKind()) == _ASSEMBLY or is_chunk_name(child.GetName()):
            found += layers_below(child)
        else:
            found.append(child)
    return found


def objects_below(
    layers: Iterable[Usd.Prim], time: Usd.TimeCode, issues: dict[Issue, None]
) -> dict[str, StageObject]:
    """All active objects of layers by path; the payloads have to be loaded.

    Args:
        layers: Prims of the layers, and objects that lie in none.
        time: Time code of all values.
        issues: Takes warnings about values that are left out.
    """
    found: dict[str, StageObject] = {}
    reader = _Reader(time, UsdGeom.XformCache(time), issues)
    for layer in layers:
        # Actors lie right below their group, which is their layer.
        is_actor = layer.HasAttribute(f"{_USER}{_ID}")
        name = (layer.GetParent() if is_actor else layer).GetName()
        inside: list[tuple[Usd.Prim, StageObject | None, str]] = [(layer, None, "")]
        while inside:
            prim, above, label = inside.pop()
            if reader.is_hidden(prim):
                continue
            label = reader.token(prim, _CLASS) or label
            if str(prim.GetKind()) in _OBJECTS and not _is_pose(prim, above):
                matrix = column_matrix(reader.xforms.GetLocalToWorldTransform(prim))
                if not isfinite(matrix.sum()):  # The reader of the geometry reports it.
                    continue
                above = reader.object(prim, name, label, above, matrix)
                found[above.path] = above
            if prim.IsA("PointInstancer"):
                found |= reader.copies(UsdGeom.PointInstancer(prim), name, label, above)
                continue
            inside += [(child, above, label) for child in reversed(_inside(prim, above))]
    return found


def _inside(prim: Usd.Prim, above: StageObject | None) -> list[Usd.Prim]:
    """What may hold objects: in groups that are instances, too; assets have none inside."""
    if prim.IsInstance() and above is None:
        return list(prim.GetFilteredChildren(Usd.TraverseInstanceProxies()))
    return list(prim.GetChildren())


def _is_pose(prim: Usd.Prim, above: StageObject | None) -> bool:
    """True for an asset that shows the object above it, as each pose of a person does."""
    return above is not None and bool(above.asset) and not prim.HasAttribute(f"{_USER}{_ID}")


def _outermost_objects(prototype: Usd.Prim) -> list[Usd.Prim]:
    """The objects that a prototype holds, or else the prototype."""
    found: list[Usd.Prim] = []
    inside: Any = iter(Usd.PrimRange(prototype, Usd.TraverseInstanceProxies(_DRAWN)))
    for prim in inside:
        if str(prim.GetKind()) in _OBJECTS:
            found.append(prim)
            inside.PruneChildren()
    return found or [prototype]


@dataclass(frozen=True)
class _Reader:
    """Reads prims at a time.

    Attributes:
        time: Time code of all values.
        xforms: Transformations so far.
        issues: Warnings so far.
    """

    time: Usd.TimeCode
    xforms: UsdGeom.XformCache
    issues: dict[Issue, None]

    def is_hidden(self, prim: Usd.Prim) -> bool:
        """True for an invisible prim."""
        if not prim.IsA("Imageable"):
            return False
        visibility = UsdGeom.Imageable(prim).GetVisibilityAttr().Get(self.time)
        return bool(visibility == UsdGeom.Tokens.invisible)

    def token(self, prim: Usd.Prim, name: str) -> str:
        """First token of an attribute; empty without a value."""
        values = prim.GetAttribute(name).Get(self.time) if prim.HasAttribute(name) else None
        return str(values[0]) if isinstance(values, Vt.TokenArray) and values else ""

    def object(
        self,
        prim: Usd.Prim,
        layer: str,
        label: str,
        above: StageObject | None,
        matrix: FloatArray,
    ) -> StageObject:
        """A component, with the label that it has or inherits and the object above it."""
        given = self._user_properties(prim)
        named = given.get(_ID)
        several = {"gml_ids": named} if isinstance(named, list) else {}
        asset = str(given.get("asset") or "")
        return StageObject(
            path=str(prim.GetPath()),
            id=named if isinstance(named, str) and named else str(prim.GetName()),
            kind=str(given.get(_KIND) or self.token(prim, _PART) or layer.lower()),
            label=label or str(given.get("segmentation_class") or ""),
            layer=layer,
            matrix=matrix,
            attributes={k: v for k, v in given.items() if k not in _ELSEWHERE} | several,
            asset=asset,
            variants=prim.GetVariantSets().GetAllVariantSelections() if asset else {},
            size=self._size(prim) if asset else (),
            part_of=above.id if above else "",
        )

    def copies(
        self,
        instancer: UsdGeom.PointInstancer,
        layer: str,
        label: str,
        above: StageObject | None,
    ) -> dict[str, StageObject]:
        """Each copy of each object in the prototypes of an instancer, by the path that images give.

        In an object, copies are its parts and no objects.
        """
        if above is not None:
            return {}
        world = column_matrix(self.xforms.GetLocalToWorldTransform(instancer.GetPrim()))
        drawn = read_instances(instancer, self.time)
        targets = instancer.GetPrototypesRel().GetTargets()
        found: dict[str, StageObject] = {}
        for number, target in enumerate(targets):
            prototype = instancer.GetPrim().GetStage().GetPrimAtPath(target)
            places = world @ drawn.matrices[drawn.prototypes == number]
            if not prototype or not np.isfinite(places).all():
                continue
            path = copies_path(instancer.GetPath(), target, targets)
            for part in _outermost_objects(prototype):
                one = self._in_prototype(part, prototype, layer, label)
                if not isfinite(one.matrix.sum()):
                    continue
                name = path + one.path.removeprefix(str(target))
                for index, matrix in enumerate(places @ one.matrix):
                    mark = f"[{index}]" if len(places) > 1 else ""
                    found[name + mark] = replace(
                        one, path=name + mark, id=one.id + mark, matrix=matrix
                    )
        return found

    def _in_prototype(
        self, prim: Usd.Prim, prototype: Usd.Prim, layer: str, label: str
    ) -> StageObject:
        """An object in a prototype; its matrix leads to the space of the copies."""
        own, _ = self.xforms.ComputeRelativeTransform(prim, prototype)
        root = self.xforms.GetLocalTransformation(prototype)[0]
        matrix = column_matrix(root) @ column_matrix(own)
        return self.object(prim, layer, self.token(prim, _CLASS) or label, None, matrix)

    def _user_properties(self, prim: Usd.Prim) -> dict[str, Any]:
        """User properties as JSON values, without those that JSON cannot hold."""
        given = {}
        for name in prim.GetAuthoredPropertyNames():
            if name.startswith(_USER):
                attribute = prim.GetAttribute(name)
                try:
                    given[name.removeprefix(_USER)] = json_value(attribute.Get(self.time))
                except BadValueError as error:
                    self._left_out(attribute, str(error))
        return given

    def _size(self, prim: Usd.Prim) -> tuple[float, ...]:
        attribute = prim.GetAttribute("extentsHint")
        if not attribute.HasAuthoredValue():
            return ()
        try:
            hint = rows(attribute, self.time, 3)
            size = np.diff(hint[:2], axis=0)
            if not (len(size) and np.isfinite(size).all()):
                raise BadValueError("extentsHint is no box")
        except BadValueError as error:
            self._left_out(attribute, str(error))
            return ()
        return tuple(np.round(size[0], 3).tolist())

    def _left_out(self, attribute: Usd.Attribute, why: str) -> None:
        path = str(attribute.GetPath())
        self.issues[value_issue(path, why)] = None


def value_issue(where: str, why: str) -> Issue:
    """The warning about a value that no file of an export can hold."""
    return Issue("export.value", Severity.WARNING, where, why, "left out")


def json_value(value: Any) -> Any:  # noqa: ANN401 - USD values of any type
    """A USD value as a JSON value.

    Raises:
        BadValueError: It holds a number without an end.
    """
    if isinstance(value, float) and not isfinite(value):
        raise BadValueError("is not a finite number")
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, dict):
        return {str(name): json_value(item) for name, item in value.items()}
    try:
        return [json_value(item) for item in value]
    except TypeError:
        return str(value)
