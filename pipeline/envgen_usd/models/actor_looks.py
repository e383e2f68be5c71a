"""What a moving actor looks like: an asset, its variants and its wheels."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.frozen_model import Model


@dataclass(frozen=True, repr=False, eq=False)
class MovingLook(Model):
    """An asset that stands for an actor; a box stands in where `asset` is empty.

    Attributes:
        kind: Kind of actor.
        asset: Name of the asset.
        path: Path of its interface relative to the library.
        label: Token in the `class` taxonomy.
        selections: Variant of each variant set.
        scale: Factor of its size.
        box: 2 x 3, its bounding box, metres, after scaling; +x is the front.
        wheels: W x 3, centres of the wheels in the asset's frame, metres, before scaling.
        radius: Radius of the wheels, metres, before scaling; 0 without wheels.
        spinning: Path of each mesh that turns with a wheel, below the asset, to its wheel.
        cycle: Variants of the set `pose` that follow one another while it moves: phases of a walk,
            or of a turn of the pedals.
        cycle_length: Metres that a cycle covers, before scaling.
        standing: Variant of the set `pose` of a person who does not walk; empty without any.
    """

    kind: str
    asset: str
    path: str
    label: str
    selections: Mapping[str, str]
    scale: float
    box: FloatArray
    wheels: FloatArray = field(default_factory=lambda: np.empty((0, 3)))
    radius: float = 0.0
    spinning: Mapping[str, int] = field(default_factory=dict)
    cycle: tuple[str, ...] = ()
    cycle_length: float = 0.0
    standing: str = ""

    @property
    def size(self) -> FloatArray:
        """Length, width and height, metres."""
        size: FloatArray = self.box[1] - self.box[0]
        return size

    @property
    def middle(self) -> FloatArray:
        """Middle of the foot of its box from the asset's origin, 3, metres; z is 0.

        The box of a person changes with each step, so their origin counts.
        """
        if self.kind == "pedestrian":
            return np.zeros(3)
        return np.append(self.box.mean(axis=0)[:2], 0.0)

    def contacts(self) -> FloatArray:
        """Returns where its wheels touch the ground, K x 2, metres from the middle of its box."""
        if self.kind == "pedestrian":
            return np.zeros((1, 2))
        if len(self.wheels):
            return self.wheels[:, :2] * self.scale - self.middle[:2]
        length, width, _ = self.size.tolist()
        axle, track = _AXLE * length, _TRACK * width
        if self.kind in {"bicycle", "motorcycle"}:
            return np.array([[axle, 0.0], [-axle, 0.0]])
        return np.array([[axle, track], [axle, -track], [-axle, track], [-axle, -track]])


_AXLE = 0.29
"""Distance of axles from the middle, as a share of the length, where the asset says nothing."""
_TRACK = 0.42
"""Distance of wheels from the middle, as a share of the width."""
