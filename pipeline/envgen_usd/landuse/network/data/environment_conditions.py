"""Conditions of the network: an environment's numbers, without its name."""

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from envgen_usd.models.environment_profile import Profile
from envgen_usd.models.landuse import LanduseClass

CONDITIONS = 15
"""Length of `describe`'s result."""


def describe(profile: Profile) -> NDArray[np.float32]:
    """Numbers of order one that describe an environment's plots.

    The numbers replace country and area type, so another environment within their range needs no
    new training.
    """
    plots = profile.plots
    scales = (
        (plots.frontage, 20.0),
        (plots.depth, 40.0),
        (plots.verge, 2.0),
        (plots.gap, 10.0),
        (plots.group, 3.0),
        (profile.buildings.setback, 6.0),
    )
    ranges = [math.log((value + 0.1) / scale) for pair, scale in scales for value in pair][:-2]
    setback = math.log((profile.buildings.setback[1] + 0.1) / 6.0)
    rubble = float(plots.landuse is LanduseClass.RUBBLE) * 2 - 1
    shares = [4 * plots.occupancy - 3, plots.rows - 1.0, 4 * plots.wood, rubble]
    return np.array([*ranges, setback, *shares], dtype=np.float32)


def blend(parts: tuple[Profile, Profile, Profile]) -> Profile:
    """Joins front and ground of the first environment, depth of the second, rest of the third."""
    first, second, third = parts
    plots = replace(
        third.plots,
        frontage=first.plots.frontage,
        landuse=first.plots.landuse,
        depth=second.plots.depth,
    )
    return replace(first, plots=plots)
