"""Geometry at its places, with what the ancestors on the stage say about it."""

from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from pxr import UsdGeom

from envgen_usd.models.arrays import FloatArray

Meaning: TypeAlias = tuple[str | None, str | None]
"""Class and part, each none where nothing names it."""


@dataclass(frozen=True)
class Context:
    """What a prim takes over from its ancestors.

    Attributes:
        matrix: 4 x 4, from the parent's space, for column vectors.
        label: Nearest class named above, or none.
        part: Nearest part named above and below that class, or none.
        owner: Path of the object that the prim belongs to, or empty.
        firm: True if the owner is a component; else it is the outermost labelled prim.
        purpose: Inherited purpose.
        material: Index of the material bound above an instance; 0: none.
        overrides: True if that binding is stronger than those below it.
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
    """A geometry with its places.

    Attributes:
        geometry: Index of the geometry.
        matrices: N x 4 x 4.
        label: Class, or none if nothing up to the prototype's root names one.
        owner: Path of the object, in a prototype relative to its root; or empty.
        firm: As in `Context`.
        part: Which part of the object it is, or none if nothing says so.
        many: True if each place is an object of its own.
    """

    geometry: int
    matrices: FloatArray
    label: str | None
    owner: str
    firm: bool
    part: str | None = None
    many: bool = False

    def owners(self) -> list[str]:
        """Path of the object at each place, or one for all places."""
        if not self.many:
            return [self.owner] * len(self.matrices)
        return [f"{self.owner}[{index}]" for index in range(len(self.matrices))]


def refined(own: Meaning, above: Meaning) -> Meaning:
    """What a prim means: a class of its own ends the part named above it."""
    label, part = own
    return label or above[0], part if label or part is not None else above[1]


def placed(part: Part, context: Context, matrices: FloatArray, path: str) -> Part:
    """A part of a prototype at the places of its instances.

    Args:
        part: In the prototype's space.
        context: What the instances take over from their ancestors.
        matrices: N x 4 x 4, from the prototype's space to the context's root.
        path: Of the instance or, where a point instancer has many, of the prototype.
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
    )


def column_matrix(matrix: Any) -> FloatArray:  # noqa: ANN401 - Gf has no types
    """A Gf.Matrix4d, which is for row vectors, as 4 x 4 for column vectors."""
    return np.array(matrix, np.float64).T
