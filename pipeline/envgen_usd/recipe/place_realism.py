"""Compares a generated town with a real place, beside the place's halves with each other."""

from collections.abc import Mapping

import numpy as np

from envgen_usd.errors import EnvgenError
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.place import Place
from envgen_usd.places.building_figures import measure
from envgen_usd.places.street_figures import measure_streets
from envgen_usd.study.set_realism import Distance

_LEAST = 10
"""Least number of samples of a figure that is compared."""
_BUILDINGS = {
    "footprint, m²": "area",
    "height, m": "height",
    "plot width, m": "frontage",
    "plot depth, m": "plot_depth",
    "plot coverage": "coverage",
    "setback, m": "setback",
    "gap between buildings, m": "gaps",
    "buildings in a row": "groups",
}
_STREETS = {"tree spacing, m": "tree_spacing", "lamp spacing, m": "lamp_spacing"}


def place_distances(real: Place, generated: Place) -> tuple[Distance, ...]:
    """Kolmogorov's distances of plots, buildings, trees and lights, 0 to 1.

    Figures of which one of the sides has fewer than 10 samples are left out; a city model without
    streets has no plots, setbacks and spacings.

    Args:
        real: The real place.
        generated: The generated town, or another place.

    Raises:
        EnvgenError: No figure has enough samples.
    """
    theirs, ours = _figures(real), _figures(generated)
    west, east = (_figures(half) for half in real.halves())
    found = [
        Distance(name, largest_gap(theirs[name], ours[name]), largest_gap(west[name], east[name]))
        for name in theirs
        if min(len(each[name]) for each in (theirs, ours, west, east)) >= _LEAST
    ]
    if not found:
        raise EnvgenError(
            f"{real.source}, {generated.source}: have no figure with {_LEAST} samples in common;"
            " give larger places"
        )
    return tuple(found)


def largest_gap(first: FloatArray, second: FloatArray) -> float:
    """Largest difference of two empirical distributions (Kolmogorov and Smirnov)."""
    places = np.concatenate((first, second))
    shares = [
        np.searchsorted(np.sort(each), places, "right") / len(each) for each in (first, second)
    ]
    return float(np.abs(shares[0] - shares[1]).max())


def _figures(place: Place) -> Mapping[str, FloatArray]:
    buildings, streets = measure(place), measure_streets(place)
    found = {name: getattr(buildings, key) for name, key in _BUILDINGS.items()}
    found |= {name: getattr(streets, key) for name, key in _STREETS.items()}
    return {name: np.asarray(v, np.float64)[np.isfinite(v)] for name, v in found.items()}
