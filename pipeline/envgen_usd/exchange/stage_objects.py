"""Metadata of the objects of a stage: components, and the subcomponents inside them."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from pxr import Usd, UsdGeom

from envgen_usd.models.array_types import FloatArray
from envgen_usd.render.stage.placed_parts import column_matrix

_USER = "userProperties:"
_ID, _KIND = "gml_id", "category"
_CLASS, _PART = "semantics:labels:class", "semantics:labels:part"
_ELSEWHERE = {_ID, _KIND, "segmentation_class", "asset", "asset_path", "part_of"}
"""Properties that are fields of their own, or that repeat one."""
_OBJECTS = {"component", "subcomponent"}


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


def objects_below(chunk: Usd.Prim, time: Usd.TimeCode) -> dict[str, StageObject]:
    """All active objects below a chunk by path; the payloads have to be loaded."""
    found: dict[str, StageObject] = {}
    reader = _Reader(time, UsdGeom.XformCache(time))
    for layer in chunk.GetChildren():
        # Actors lie right below their group, which is their layer.
        name = (chunk if layer.HasAttribute(f"{_USER}{_ID}") else layer).GetName()
        inside: list[tuple[Usd.Prim, StageObject | None, str]] = [(layer, None, "")]
        while inside:
            prim, above, label = inside.pop()
            if reader.is_hidden(prim):
                continue
            label = reader.token(prim, _CLASS) or label
            if str(prim.GetKind()) in _OBJECTS and not _is_pose(prim, above):
                above = reader.object(prim, name, label, above)
                found[above.path] = above
            inside += [(child, above, label) for child in reversed(prim.GetChildren())]
    return found


def _is_pose(prim: Usd.Prim, above: StageObject | None) -> bool:
    """True for an asset that shows the object above it, as each pose of a person does."""
    return above is not None and bool(above.asset) and not prim.HasAttribute(f"{_USER}{_ID}")


@dataclass(frozen=True)
class _Reader:
    """Reads prims at a time.

    Attributes:
        time: Time code of all values.
        xforms: Transformations so far.
    """

    time: Usd.TimeCode
    xforms: UsdGeom.XformCache

    def is_hidden(self, prim: Usd.Prim) -> bool:
        """True for an invisible prim."""
        if not prim.IsA("Imageable"):
            return False
        visibility = UsdGeom.Imageable(prim).GetVisibilityAttr().Get(self.time)
        return bool(visibility == UsdGeom.Tokens.invisible)

    def token(self, prim: Usd.Prim, name: str) -> str:
        """First token of an attribute; empty without a value."""
        values = prim.GetAttribute(name).Get(self.time) if prim.HasAttribute(name) else None
        return str(values[0]) if values else ""

    def object(
        self, prim: Usd.Prim, layer: str, label: str, above: StageObject | None
    ) -> StageObject:
        """A component, with the label that it has or inherits and the object above it."""
        given = {
            name.removeprefix(_USER): _plain(prim.GetAttribute(name).Get(self.time))
            for name in prim.GetAuthoredPropertyNames()
            if name.startswith(_USER)
        }
        named = given.get(_ID)
        several = {"gml_ids": named} if isinstance(named, list) else {}
        asset = str(given.get("asset") or "")
        return StageObject(
            path=str(prim.GetPath()),
            id=named if isinstance(named, str) and named else str(prim.GetName()),
            kind=str(given.get(_KIND) or self.token(prim, _PART) or layer.lower()),
            label=label or str(given.get("segmentation_class") or ""),
            layer=layer,
            matrix=column_matrix(self.xforms.GetLocalToWorldTransform(prim)),
            attributes={k: v for k, v in given.items() if k not in _ELSEWHERE} | several,
            asset=asset,
            variants=prim.GetVariantSets().GetAllVariantSelections() if asset else {},
            size=self._size(prim) if asset else (),
            part_of=above.id if above else "",
        )

    def _size(self, prim: Usd.Prim) -> tuple[float, ...]:
        hint = prim.GetAttribute("extentsHint").Get(self.time)
        if not hint:
            return ()
        low, high = np.array(hint[0], np.float64), np.array(hint[1], np.float64)
        return tuple(np.round(high - low, 3).tolist())


def _plain(value: Any) -> Any:  # noqa: ANN401 - USD values of any type
    """A USD value as a JSON value."""
    if value is None or isinstance(value, bool | int | float | str):
        return value
    try:
        return [_plain(item) for item in value]
    except TypeError:
        return str(value)
