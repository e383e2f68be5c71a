"""Types of an environment's figures, with their bounds."""

from collections.abc import Mapping
from typing import Annotated, TypeAlias

from msgspec import Meta

Share: TypeAlias = Annotated[float, Meta(ge=0.0, le=1.0)]
Weight: TypeAlias = Annotated[float, Meta(ge=0.0, le=1e6)]
Weights: TypeAlias = Annotated[Mapping[str, Weight], Meta(min_length=1)]


def heaviest(weights: Mapping[str, float]) -> str:
    """Returns the name of the largest weight, where nothing may be drawn."""
    return max(weights.items(), key=lambda item: (item[1], item[0]))[0]
