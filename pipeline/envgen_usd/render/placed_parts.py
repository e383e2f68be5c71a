"""Geometry at its placements, with properties inherited from its ancestors."""

from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from pxr import UsdGeom

from envgen_usd.models.array_types import FloatArray

Meaning: TypeAlias = tuple[str | None, str | None]
"""Class and part; `None` without a label."""


@dataclass(frozen=True)
class Context:
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
        root: True for the root of a prototype, whose transform belongs to its instances.
    """

    matrix: FloatArray
    label: str | None = None
    part: str | None = None
    owner: str = ""
    firm: bool = False
    purpose: str = UsdGeom.Tokens.default_
    material: int = 0
    overrides: bool = False
    root: bool = False


@dataclass(frozen=True)
class Part:
    """A geometry with its placements.

    Attributes:
        geometry: Index of the geometry, or of the lamp.
        matrices: N x 4 x 4, placements.
        label: Class, or `None` without a label up to the prototype's root.
        owner: Path of the object, in a prototype relative to its root; or empty.
        firm: As in `Context`.
        part: Part of the object, or `None` without a part label.
        many: True if each placement is a separate object.
        is_lamp: True for a lamp, which has no geometry.
    """

    geometry: int
    matrices: FloatArray
    label: str | None
    owner: str
    firm: bool
    part: str | None = None
    many: bool = False
    is_lamp: bool = False

    def owners(self) -> list[str]:
        """Path of the object at each placement, or a single path for all."""
        if not self.many:
            return [self.owner] * len(self.matrices)
        return [f"{self.owner}[{index}]" for index in range(len(self.matrices))]


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
        path: Path of the instance, or of the prototype of a point instancer.
    """
    places = (matrices[:, None] @ part.matrices[None]).reshape(-1, 4, 4)
    several = len(matrices) > 1
    meaning = refined((part.label, part.part), (context.label, context.part))
    inherited = context.firm or (context.owner and not several and not part.firm)
    return Part(
        geometry=part.geometry,
        matrices=places,
        label=meaning[0],
        owner=context.owner if inherited else path + part.owner,
        firm=context.firm or part.firm,
        part=meaning[1],
        many=not context.firm and (part.many or several),
        is_lamp=part.is_lamp,
    )


def column_matrix(matrix: Any) -> FloatArray:  # noqa: ANN401 - Gf has no types
    """Converts a Gf.Matrix4d, which is for row vectors, to 4 x 4 for column vectors."""
    return np.array(matrix, np.float64).T
