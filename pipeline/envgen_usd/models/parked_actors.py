"""Actors that stand still: vehicles, people, bicycles, wheeled bins."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeAlias

from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.frozen_model import Model

MIRROR = 0.17
"""Metres by which each mirror stands out from the side of a car, a lorry or a bus."""
_MIRRORED = frozenset({"car", "truck", "bus"})


@dataclass(frozen=True, repr=False, eq=False)
class ActorLook(Model):
    """An asset with those variants that decide its size.

    Attributes:
        kind: Kind of asset, e.g. ``car``.
        asset: Name of the asset.
        selections: Variant of each variant set that changes the size.
        weight: How often the look occurs, relative to the others of its kind.
        size: 3, metres along x, y and z, with mirrors; +x is the front.
    """

    kind: str
    asset: str
    selections: Mapping[str, str]
    weight: float
    size: FloatArray

    @property
    def width(self) -> float:
        """Width without mirrors, metres: what stands at a kerb."""
        return float(self.size[1]) - (2 * MIRROR if self.kind in _MIRRORED else 0.0)


Looks: TypeAlias = Mapping[str, tuple[ActorLook, ...]]
"""Looks by kind; a kind without assets is missing."""


@dataclass(frozen=True, repr=False, eq=False)
class ParkedActor(Model):
    """An actor that stands still.

    Attributes:
        id: Unique over all maps and stable over rebuilds (an NCName).
        look: Its asset.
        position: 3, metres, road frame; the middle of its foot.
        heading: Radians, counter-clockwise from +x to its front.
        pitch: Radians; positive values raise the front.
        roll: Radians; positive values raise its left side.
        place: Where it stands: ``kerb``, ``raised_kerb`` (half on the sidewalk), ``parking_lane``,
            ``parking_space``, ``car_park``, ``driveway``, ``yard``, ``sidewalk``, ``crossing``,
            ``stop``, ``rack``.
    """

    id: str
    look: ActorLook
    position: FloatArray
    heading: float
    place: str
    pitch: float = 0.0
    roll: float = 0.0
