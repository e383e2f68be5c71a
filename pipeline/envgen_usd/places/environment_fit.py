"""Fits the distributions of an environment to the figures of a place.

1. Figures with at least `LEAST_SAMPLES` samples become quantiles (Hyndman and Fan 1996, type 7);
   all others keep the environment's value.
2. Shares become weights in proportion to the counts.
3. Dependence is a Gaussian copula: correlations of the normal scores of the ranks (van der Waerden
   1953), shrunk towards independence by one part in the number of samples, so that they stay
   positive definite.
"""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import get_args

import numpy as np

from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.building_rules import CORRELATED, PLOT_FIGURES, Roof
from envgen_usd.models.distribution import (
    Correlation,
    Quantiles,
    mean_of,
    normal_score,
    quantiles_of,
)
from envgen_usd.models.environment_profile import Profile
from envgen_usd.models.figure_types import Weights
from envgen_usd.places.building_figures import HALF_GAP, TOUCHING, BuildingFigures
from envgen_usd.places.osm_tags import SIDEWALK
from envgen_usd.places.street_figures import StreetFigures

LEAST_SAMPLES = 20
"""Samples below which a figure keeps the environment's value."""
_QUANTILES = 41
"""Number of quantiles of a figure."""
_TRIMMED = 0.01
"""Share of the samples beyond each end of a building's figure."""
_TRIMMED_LAND = 0.05
"""Share of the samples beyond each end of a plot's figure; its ends decide how plots are fitted."""
_ROWS = 0.75
"""Share of houses wall to wall from which the environment has rows; other gaps are then few."""
_RECTANGULAR = 0.9
"""Least share of the rectangle around it that a rectangular footprint fills."""
_LEAST_EIGENVALUE = 0.02
"""Least eigenvalue of the correlations; a larger value keeps figures from fixing one another."""
_STOREY = 3.2
"""Height of a storey with its floor where only a building's height is known, metres."""
BOUNDS: Mapping[str, tuple[float, float]] = {
    "frontage": (4.0, 200.0),
    "plot_depth": (6.0, 150.0),
    "gap": (0.0, 100.0),
    "group": (1.0, 40.0),
    "width": (4.0, 150.0),
    "depth": (4.0, 150.0),
    "setback": (0.0, 40.0),
    "side_setback": (0.0, 20.0),
    "storeys": (1.0, 40.0),
    "spacing": (4.0, 200.0),
}
"""Smallest and largest value of a figure; samples beyond count as these."""


_LARGEST_BEHIND = 90.0
"""Largest footprint of what counts as a building behind a house, m²: as large as those are built.

A larger value learns more of them.
"""


@dataclass(frozen=True)
class LearntValue:
    """A value of an environment.

    Attributes:
        table: Table of the environment's file, e.g. ``buildings``.
        key: Key in the table.
        value: The new value, or `None`: the environment's value stays.
        samples: Number of samples that it rests on, or that there were.
    """

    table: str
    key: str
    value: Quantiles | tuple[float, float] | Weights | Correlation | str | float | None
    samples: int


@dataclass(frozen=True)
class Learnt:
    """An environment that was fitted to a place.

    Attributes:
        profile: The environment.
        text: Content of its file.
        values: Each value with its samples.
        figures: Figures of the place's buildings.
        streets: Figures of the place's streets.
        town: Figures of a town of the environment on the place's streets; `None` without streets.
    """

    profile: Profile
    text: str
    values: tuple[LearntValue, ...]
    figures: BuildingFigures
    streets: StreetFigures
    town: BuildingFigures | None


def learnt_values(
    figures: BuildingFigures, streets: StreetFigures, base: Profile
) -> tuple[LearntValue, ...]:
    """The values of an environment that fit a place.

    Args:
        figures: Figures of the buildings to learn from.
        streets: Figures of what stands along the streets.
        base: Environment whose values stay where there are too few samples.
    """
    plan = _Plan(figures, base)
    return (
        *_plots(figures, plan, base),
        *_buildings(figures, plan),
        _dependence(plan),
        *_shares(figures, base),
        *_along_streets(streets, base),
    )


class _Plan:
    """Samples of buildings and their plots in the terms of an environment, NaN where unknown."""

    def __init__(self, figures: BuildingFigures, base: Profile) -> None:
        known = np.isfinite(figures.houses.heights)
        storeys = np.maximum(np.round(figures.houses.heights / _STOREY), 1.0)
        before = SIDEWALK + mean_of(base.plots.verge)
        everywhere = {
            "frontage": figures.frontage,
            "plot_depth": figures.plot_depth - before,
            "width": figures.width,
            "depth": figures.depth,
            "storeys": np.where(
                np.isfinite(figures.houses.storeys) | ~known, figures.houses.storeys, storeys
            ),
            "setback": figures.setback - before,
            "side_setback": figures.side_gap,
        }
        self.everywhere: Mapping[str, FloatArray] = {
            name: np.clip(values, *BOUNDS.get(name, (-np.inf, np.inf)))
            for name, values in everywhere.items()
        }
        # Plots lie along streets, so a building in the second row tells nothing about theirs.
        chosen = figures.at_street
        if np.sum(chosen) < LEAST_SAMPLES:
            chosen = np.ones_like(chosen)
        self.samples: Mapping[str, FloatArray] = {
            name: values[chosen] for name, values in self.everywhere.items()
        }

    def figure(self, name: str, trimmed: float = _TRIMMED) -> tuple[Quantiles | None, int]:
        """Quantiles of a figure, and the number of its samples."""
        return _quantiles(self.samples[name], trimmed)


def _quantiles(values: FloatArray, trimmed: float) -> tuple[Quantiles | None, int]:
    known = values[np.isfinite(values)]
    if len(known) < LEAST_SAMPLES:
        return None, len(known)
    return quantiles_of(known, _QUANTILES, trimmed), len(known)


def _plots(figures: BuildingFigures, plan: _Plan, base: Profile) -> Iterator[LearntValue]:
    wide = np.clip(figures.gaps[figures.gaps > 2.0 * HALF_GAP] - 2.0 * HALF_GAP, *BOUNDS["gap"])
    for key, name in (("frontage", "frontage"), ("depth", "plot_depth")):
        yield LearntValue("plots", key, *plan.figure(name, _TRIMMED_LAND))
    setback, number = plan.figure("setback")
    # The measured setbacks hold all of the spread; the verge would add its own.
    verge = mean_of(base.plots.verge)
    yield LearntValue("plots", "verge", (verge, verge) if setback else None, number)
    yield LearntValue("plots", "gap", *_quantiles(wide, _TRIMMED_LAND))
    groups = np.clip(figures.groups, *BOUNDS["group"])
    yield LearntValue("plots", "group", *_quantiles(groups, _TRIMMED_LAND))


def _buildings(figures: BuildingFigures, plan: _Plan) -> Iterator[LearntValue]:
    for name in ("width", "depth", "setback", "side_setback"):
        yield LearntValue("buildings", name, *plan.figure(name))
    # Few buildings state their storeys, and no plot limits them: all of the place count.
    yield LearntValue("buildings", "storeys", *_quantiles(plan.everywhere["storeys"], _TRIMMED))
    if len(figures.gaps) >= LEAST_SAMPLES:
        touching = float(np.mean(figures.gaps <= TOUCHING))
        style = "row" if touching > _ROWS else "detached"
        yield LearntValue("buildings", "style", style, len(figures.gaps))
    else:
        yield LearntValue("buildings", "style", None, len(figures.gaps))
    front = int(np.sum(figures.at_street))
    behind = int(np.sum(~figures.at_street & (figures.area <= _LARGEST_BEHIND)))
    share = round(min(behind / max(front, 1), 1.0), 3)
    known = share if front >= LEAST_SAMPLES else None
    yield LearntValue("buildings.details", "back_buildings", known, len(figures.area))


def _dependence(plan: _Plan) -> LearntValue:
    """Correlations of a building's figures with one another and with its plot's."""
    names = {"plot_width": "frontage", **{name: name for name in CORRELATED}}
    known = np.isfinite(plan.samples["frontage"])
    values = {name: plan.samples[of][known] for name, of in names.items()}
    chosen = [n for n, v in values.items() if np.isfinite(v).sum() >= LEAST_SAMPLES]
    if set(PLOT_FIGURES) - set(chosen) or set(PLOT_FIGURES) == set(chosen):
        return LearntValue("buildings", "correlation", None, int(known.sum()))
    given = {name: quantiles_of(values[name], _QUANTILES, _TRIMMED) for name in PLOT_FIGURES}
    matrix = _correlations([values[name] for name in chosen])
    rows = tuple(
        (*(round(float(value), 3) for value in row[:number]), 1.0)
        for number, row in enumerate(matrix)
    )
    found = Correlation(tuple(chosen), rows, given, int(known.sum()))
    return LearntValue("buildings", "correlation", found, found.samples)


def _correlations(columns: Sequence[FloatArray]) -> FloatArray:
    """Correlations of the normal scores of columns, each pair over its common samples."""
    count = len(columns)
    matrix = np.eye(count)
    for i in range(count):
        for j in range(i):
            both = np.isfinite(columns[i]) & np.isfinite(columns[j])
            number = int(both.sum())
            if number >= LEAST_SAMPLES:
                scores = [_scores(columns[n][both]) for n in (i, j)]
                spread = float(np.prod([score.std() for score in scores]))
                if spread > 0.0:
                    found = float(np.mean(scores[0] * scores[1])) / spread
                    matrix[i, j] = matrix[j, i] = found * (1.0 - 1.0 / number)
    values, vectors = np.linalg.eigh(matrix)
    positive = (vectors * np.maximum(values, _LEAST_EIGENVALUE)) @ vectors.T
    scale = 1.0 / np.sqrt(np.diag(positive))
    correlations: FloatArray = positive * scale[:, None] * scale
    return correlations


def _scores(values: FloatArray) -> FloatArray:
    """Normal scores of the ranks; ties share their middle rank."""
    _, place, counts = np.unique(values, return_inverse=True, return_counts=True)
    ranks = np.cumsum(counts) - (counts - 1) / 2.0
    return np.array([normal_score(r / (len(values) + 1.0)) for r in ranks])[place]


def _shares(figures: BuildingFigures, base: Profile) -> Iterator[LearntValue]:
    rules, houses = base.buildings, figures.houses
    # Only mapped buildings have domes and onions.
    drawn = (r if r in get_args(Roof) else "pyramidal" for r in houses.roofs.tolist() if r)
    roofs = Counter(sorted(drawn))
    yield _weights("buildings", "roofs", {roof: float(count) for roof, count in roofs.items()})
    rectangular = float(np.sum(figures.fill >= _RECTANGULAR))
    winged: dict[str, float] = {
        name: share for name, share in rules.details.footprints.items() if name != "rectangle"
    }
    if not sum(winged.values()):
        winged = {"l": 1.0}
    total = sum(winged.values())
    rest = len(figures.fill) - rectangular
    shapes = {"rectangle": rectangular, **{n: rest * w / total for n, w in winged.items()}}
    yield _weights("buildings.details", "footprints", shapes)
    for key, weights, found in (
        ("materials", rules.materials, houses.walls),
        ("roof_materials", rules.roof_materials, houses.roofing),
    ):
        yield _weights("buildings", key, *_families(weights, found.tolist()))


def _families(weights: Weights, found: Sequence[str]) -> tuple[dict[str, float], int]:
    """Weights of materials so that each family has its counted share; and the samples.

    A family is the begin of the materials' names. Families that the environment lacks are left out.
    """
    counts = Counter(sorted(family for family in found if family))
    scaled = {}
    for family, count in counts.items():
        members = {n: w for n, w in weights.items() if n.startswith(family) and w > 0.0}
        total = sum(members.values())
        scaled.update({name: count * weight / total for name, weight in members.items()})
    known = sum(n for f, n in counts.items() if any(m.startswith(f) for m in scaled))
    return scaled, known


def _weights(
    table: str, key: str, counts: Mapping[str, float], samples: int | None = None
) -> LearntValue:
    number = round(sum(counts.values())) if samples is None else samples
    if number < LEAST_SAMPLES:
        return LearntValue(table, key, None, number)
    total = sum(counts.values())
    shares = {name: count / total for name, count in counts.items() if count > 0.0}
    return LearntValue(table, key, shares, number)


def _along_streets(streets: StreetFigures, base: Profile) -> Iterator[LearntValue]:
    for table, spacing in (
        ("street_trees", streets.tree_spacing),
        ("street_lights", streets.lamp_spacing),
    ):
        samples = np.clip(spacing, *BOUNDS["spacing"])
        yield LearntValue(table, "spacing", *_quantiles(samples, _TRIMMED))
    counts = Counter(sorted(streets.enclosures))
    none = base.enclosures.kinds.get("none", 0.0) / sum(base.enclosures.kinds.values())
    total = sum(counts.values())
    # A map that shows no enclosure does not say that there is none: their share stays.
    shares = {kind: count * (1.0 - none) for kind, count in counts.items()}
    yield _weights("enclosures", "kinds", {"none": none * total, **shares} if total else {}, total)
