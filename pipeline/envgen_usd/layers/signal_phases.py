"""Phases of traffic lights: the lights of a junction agree, and crossing roads do not both go."""

import math

import numpy as np

from envgen_usd.assets.variant_choice import Choice
from envgen_usd.models.city_model import CityObject, Placement
from envgen_usd.seeds import generator

_SQUARE = 100.0
"""Side in metres of the squares of the road frame whose lights agree; junctions are smaller.

A larger value makes more junctions agree with one another.
"""
_CYCLE = (
    ("green", "red", 0.42),
    ("amber", "red", 0.05),
    ("red", "red", 0.03),
    ("red", "red_amber", 0.03),
    ("red", "green", 0.42),
    ("red", "amber", 0.05),
)
"""Phases of the road nearer to the x axis and of the other, and their shares of a cycle."""
_WALKERS = {"1000002", "1000007", "1000013"}
"""Types of signals for pedestrians and cyclists (OpenDRIVE 1.4, annex of 14.1)."""


def place_key(placement: Placement) -> str:
    """Names the square of a light; lights of a square share their design and their cycle."""
    x, y = np.floor(np.asarray(placement.position)[:2] / _SQUARE).astype(int).tolist()
    return f"{x}_{y}"


def with_phase(choice: Choice, feature: CityObject, placement: Placement, seed: int) -> Choice:
    """Returns a traffic light's choice with its phase, and the design of a pedestrians' light.

    The phase follows from the seed, the square and the heading, so a light is the same in every
    build. An asset without the variants keeps its choice. Pedestrians go while their light's road
    has green, as they walk along it.
    """
    variants = choice.asset.variants
    draw = generator(seed, "props", "phase", place_key(placement)).random()
    shares = np.cumsum([share for _, _, share in _CYCLE])
    row = _CYCLE[min(int(np.searchsorted(shares, draw * shares[-1])), len(_CYCLE) - 1)]
    along = abs(math.cos(placement.heading)) >= math.sqrt(0.5)
    phase, design = row[0 if along else 1], choice.selections.get("design", "")
    if str(feature.attributes.get("opendrive_type", "")) in _WALKERS:
        phase, design = "green" if phase == "green" else "red", "pedestrian"
    asked = {"phase": phase, "design": design}
    known = {name: value for name, value in asked.items() if value in variants.get(name, ())}
    return Choice(choice.asset, {**choice.selections, **known})
