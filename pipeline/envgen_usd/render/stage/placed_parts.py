"""Geometry at its placements, with properties inherited from its ancestors."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from pxr import UsdGeom

from envgen_usd.models.array_types import FloatArray
from envgen_usd.render.render_scene import Geometry, Level, Use, extent
from envgen_usd.render.stage.stage_lamps import Lamp

Meaning: TypeAlias = tuple[str | None, str | None]
"""Class and part; `None` without a label."""


class Context(NamedTuple):
    """Properties that a prim inherits from its ancestors.

    Attributes:
        matrix: 4 x 4, from the parent's space, for column vectors.
        label: Class label of the nearest labelled ancestor, or `None`.
        part: Nearest part label below that ancestor, or `None`.
        owner: Path of the object that the prim belongs to, or empty.
        firm: True if the owner is a component; else it is the outermost labelled prim.
        purpose: Inherited purpose.
        material: Index of the material bound above an instance; 0 without a binding.
        overrides: True if that binding is stronger than descendant bindings.
        bound: True if the prim or an ancestor has a material binding.
        root: True for the root of a prototype, whose transform belongs to its instances.
        body: True for a moving body, whose transform and visibility belong to a moment.
    """

    matrix: FloatArray
    label: str | None = None
    part: str | None = None
    owner: str = ""
    firm: bool = False
    purpose: str = UsdGeom.Tokens.default_
    material: int = 0
    overrides: bool = False
    bound: bool = False
    root: bool = False
    body: bool = False


@dataclass(eq=False)
class Slot:
    """A place for a geometry, filled after the traversal.

    Attributes:
        geometry: The geometry; `None` without triangles.
        levels: The levels of detail that it belongs to; `None` if it is drawn at all distances.
    """

    geometry: Geometry | None = None
    levels: "Levels | None" = None


@dataclass(eq=False)
class Levels:
    """A mesh, and the simpler one that replaces it at a distance (`proxyPrim`)."""

    near: list[Slot] = field(default_factory=list)
    far: list[Slot] = field(default_factory=list)

    def level(self, slot: Slot) -> Level | None:
        """The level of a slot; `None` if one of both is empty. All slots have to be filled."""
        drawn, replacing = self._both
        return replacing if slot in self.far else drawn

    @cached_property
    def _both(self) -> tuple[Level | None, Level | None]:
        """The levels of the near slots and of the far ones."""
        drawn = [slot.geometry.points for slot in self.near if slot.geometry is not None]
        if not drawn or all(slot.geometry is None for slot in self.far):
            return None, None
        low, high = extent(np.concatenate(drawn))
        x, y, z = ((low + high) / 2.0).tolist()
        drawn_near = Level(far=False, middle=(x, y, z), size=float(np.linalg.norm(high - low)))
        return drawn_near, replace(drawn_near, far=True)


@dataclass(frozen=True, eq=False)
class Part:
    """A geometry with its placements.

    Attributes:
        slot: Holds the geometry.
        matrices: N x 4 x 4, placements.
        label: Class, or `None` without a label up to the prototype's root.
        owner: Path of the object, in a prototype relative to its root; or empty.
        firm: As in `Context`.
        part: Part of the object, or `None` without a part label.
        many: True if each placement is a separate object.
        lamp: Lamp instead of a geometry, or `None`.
    """

    slot: Slot
    matrices: FloatArray
    label: str | None
    owner: str
    firm: bool
    part: str | None = None
    many: bool = False
    lamp: Lamp | None = None

    def owners(self) -> list[str]:
        """Path of the object at each placement, or a single path for all."""
        if not self.many:
            return [self.owner] * len(self.matrices)
        return [f"{self.owner}[{index}]" for index in range(len(self.matrices))]


@dataclass(frozen=True, eq=False)
class Template:
    """Parts of a prototype, in its space; owners are relative to its root."""

    parts: tuple[Part, ...]


class Instance(NamedTuple):
    """A placement of a prototype.

    Attributes:
        template: The prototype.
        context: Properties that the instance inherits; its matrix is that of the instance.
        path: Path of the instance.
    """

    template: Template
    context: Context
    path: str

    def parts(self) -> list[Part]:
        """Parts in the space of the instance."""
        matrix = self.context.matrix[None]
        return [placed(part, self.context, matrix, self.path) for part in self.template.parts]


Placement: TypeAlias = Part | Instance


@dataclass
class _Gathered:
    """Placements of a part: the numbers of its instances, and the scene objects."""

    part: Part
    instances: list[int] = field(default_factory=list)
    scene_objects: list[int] = field(default_factory=list)


def refined(direct: Meaning, above: Meaning) -> Meaning:
    """Resolved labels of a prim: a class label on the prim ends the inherited part."""
    label, part = direct
    return label or above[0], part if label or part is not None else above[1]


def placed(part: Part, context: Context, matrices: FloatArray, path: str) -> Part:
    """A part of a prototype at the placements of its instances.

    Args:
        part: In the prototype's space.
        context: Properties that the instances inherit from their ancestors.
        matrices: N x 4 x 4, from the prototype's space to the context's root.
        path: Path of the instance, or of a prototype's copies in a point instancer.
    """
    several = len(matrices) > 1
    meaning = refined((part.label, part.part), (context.label, context.part))
    return Part(
        slot=part.slot,
        matrices=_multiplied(matrices, part),
        label=meaning[0],
        owner=_owner(part, context, path, several=several),
        firm=context.firm or part.firm,
        part=meaning[1],
        many=not context.firm and (part.many or several),
        lamp=part.lamp,
    )


def _owner(part: Part, context: Context, path: str, *, several: bool) -> str:
    inherited = context.firm or (context.owner and not several and not part.firm)
    return context.owner if inherited else path + part.owner


def _multiplied(matrices: FloatArray, part: Part) -> FloatArray:
    product: FloatArray = matrices[:, None] @ part.matrices[None]
    return product.reshape(-1, 4, 4)


def gathered_uses(
    placements: Iterable[Placement], scene_object: Callable[[str, str, str], int]
) -> tuple[tuple[Geometry, ...], tuple[Use, ...]]:
    """Joins the placements of each geometry.

    Args:
        placements: In the order of the traversal.
        scene_object: Number of an object by class, path and part.
    """
    found: dict[Part, _Gathered] = {}
    matrices: list[FloatArray] = []
    for placement in placements:
        if isinstance(placement, Part):
            _gather(found, placement, scene_object)
            continue
        for part in placement.template.parts:
            _gather_instance(found, part, placement, len(matrices), scene_object)
        matrices.append(placement.context.matrix)
    return _uses(found.values(), np.array(matrices).reshape(-1, 4, 4))


def _gather(
    found: dict[Part, _Gathered], part: Part, scene_object: Callable[[str, str, str], int]
) -> None:
    if part.slot.geometry is not None:
        name = part.label or "void"
        meant = [scene_object(name, owner, part.part or "") for owner in part.owners()]
        found[part] = _Gathered(part, scene_objects=meant)


def _gather_instance(
    found: dict[Part, _Gathered],
    part: Part,
    instance: Instance,
    number: int,
    scene_object: Callable[[str, str, str], int],
) -> None:
    if part.slot.geometry is None:
        return
    if part not in found:
        found[part] = _Gathered(part)
    gathered, context = found[part], instance.context
    label, meant = refined((part.label, part.part), (context.label, context.part))
    owner = _owner(part, context, instance.path, several=False)
    gathered.instances.append(number)
    count = len(part.matrices)
    for index in range(count):
        path = f"{owner}[{index}]" if part.many and not context.firm else owner
        gathered.scene_objects.append(scene_object(label or "void", path, meant or ""))


def _uses(
    found: Iterable[_Gathered], instances: FloatArray
) -> tuple[tuple[Geometry, ...], tuple[Use, ...]]:
    by_slot: dict[Slot, list[_Gathered]] = {}
    for each in found:
        by_slot.setdefault(each.part.slot, []).append(each)
    geometries: list[Geometry] = []
    uses: list[Use] = []
    for slot, those in by_slot.items():
        level = slot.levels.level(slot) if slot.levels else None
        if slot.levels and slot in slot.levels.far and level is None:
            continue
        matrices = [
            _multiplied(instances[each.instances], each.part)
            if each.instances
            else each.part.matrices
            for each in those
        ]
        numbers = [number for each in those for number in each.scene_objects]
        assert slot.geometry is not None
        where = np.concatenate(matrices), np.array(numbers, np.uint32)
        uses.append(Use(len(geometries), *where, level=level))
        geometries.append(slot.geometry)
    return tuple(geometries), tuple(uses)


def gathered_lamps(placements: Iterable[Placement]) -> list[tuple[Lamp, FloatArray]]:
    """Lamps with their placements, N x 4 x 4 each."""
    lamps = []
    for placement in placements:
        if isinstance(placement, Part):
            parts = [placement] if placement.lamp else []
        else:
            parts = placement.parts() if any(part.lamp for part in placement.template.parts) else []
        lamps += [(part.lamp, part.matrices) for part in parts if part.lamp]
    return lamps


def templates_of(placements: Iterable[Placement]) -> tuple[Template, ...]:
    """The prototypes of the instances, each once."""
    found = (each.template for each in placements if isinstance(each, Instance))
    return tuple(dict.fromkeys(found))


def unlabelled(placements: Sequence[Placement]) -> tuple[int, int]:
    """Returns how many placed parts have no class label, and how many there are."""
    missing = total = 0
    for placement in placements:
        template = (placement,) if isinstance(placement, Part) else placement.template.parts
        above = None if isinstance(placement, Part) else placement.context.label
        drawn = [part for part in template if part.slot.geometry is not None]
        total += len(drawn)
        missing += 0 if above else sum(part.label is None for part in drawn)
    return missing, total


def column_matrix(matrix: Any) -> FloatArray:  # noqa: ANN401 - Gf has no types
    """Converts a Gf.Matrix4d, which is for row vectors, to 4 x 4 for column vectors."""
    return np.array(matrix, np.float64).T
