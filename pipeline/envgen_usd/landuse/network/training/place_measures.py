"""How near landuse of any source is to that of a real place, as distributions.

Cells that the place gives (road, water, railway) and verges count nowhere: sources draw them by
different conventions.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.distance import jensenshannon

from envgen_usd.landuse.network.data.place_channels import GIVEN
from envgen_usd.landuse.network.data.place_sample import PlaceSample
from envgen_usd.landuse.network.training.landuse_measures import (
    CLASSES,
    confusion_of,
    distances,
    mean_iou,
    plot_shapes,
)
from envgen_usd.landuse.place_landuse import PlaceLand
from envgen_usd.models.array_types import BoolArray, ByteArray, FloatArray
from envgen_usd.models.landuse import LanduseClass

FIGURES = ("shares", "area", "depth", "frontage", "adjacency", "miou")
"""Figures of `differences`: share of the land with a class too much or too little; Wasserstein
distances of plots with houses, m², m and m; Jensen-Shannon distance of the pairs of adjacent
classes; mean intersection over union with the place itself."""
_APART = (*GIVEN, LanduseClass.VERGE, LanduseClass.UNKNOWN)
_HOUSES = (LanduseClass.LAWN, LanduseClass.RUBBLE)


@dataclass(frozen=True, eq=False)
class LandFigures:
    """Figures of squares.

    Attributes:
        shares: Share of each class in the land.
        shapes: P x 3, area (m²), depth and frontage (m) of plots with houses.
        adjacency: Share of each pair of adjacent cells that differ in class, or in plot.
        squares: Classes of each square.
    """

    shares: FloatArray
    shapes: FloatArray
    adjacency: FloatArray
    squares: tuple[ByteArray, ...]


def land_figures(lands: Sequence[PlaceLand], places: Sequence[PlaceSample]) -> LandFigures:
    """Measures squares of land on the streets of places, square by square."""
    counts, pairs = np.zeros(CLASSES), np.zeros((CLASSES, CLASSES))
    shapes, squares = [np.empty((0, 3))], []
    for land, place in zip(lands, places, strict=True):
        counted = ~np.isin(land.classes, _APART) & ~np.isin(place.classes, _APART)
        counts += np.bincount(land.classes[counted], minlength=CLASSES)
        pairs += _adjacent(land, counted)
        with_house = np.where(np.isin(land.classes, _HOUSES), land.plots, 0)
        shapes.append(plot_shapes(with_house, place.raw[1:3]))
        squares.append(land.classes)
    return LandFigures(
        counts / max(1.0, counts.sum()),
        np.concatenate(shapes),
        pairs / max(1.0, pairs.sum()),
        tuple(squares),
    )


def differences(
    real: LandFigures, other: LandFigures, places: Sequence[PlaceSample] = ()
) -> FloatArray:
    """Differences of `FIGURES`; the last is NaN without the places of both."""
    shapes = distances([real.shapes], [other.shapes])
    shares = float(np.abs(real.shares - other.shares).sum() / 2.0)
    pairs = real.adjacency.ravel(), other.adjacency.ravel()
    # Land of a single class has no pairs, and nothing in common with land that has some.
    has_pairs = all(np.any(one) for one in pairs)
    adjacency = float(jensenshannon(*pairs, 2)) if has_pairs else 1.0
    miou = agreement(real, other, places) if places else np.nan
    return np.array([shares, *shapes, adjacency, miou])


def agreement(one: LandFigures, other: LandFigures, places: Sequence[PlaceSample]) -> float:
    """Mean intersection over union of two sources on the same squares."""
    confusion = np.zeros((CLASSES, CLASSES))
    for first, second, place in zip(one.squares, other.squares, places, strict=True):
        apart = np.isin(place.classes, _APART) | np.isin(first, _APART) | np.isin(second, _APART)
        # Cells that do not count are marked as road in the first, as `confusion_of` leaves it out.
        confusion += confusion_of(np.where(apart, np.uint8(LanduseClass.ROAD), first), second)
    return mean_iou(confusion)


def _adjacent(land: PlaceLand, counted: BoolArray) -> FloatArray:
    """Counts of pairs of adjacent cells by class, in either order."""
    pairs = np.zeros(CLASSES * CLASSES)
    for axis in (0, 1):
        classes, plots, counts = (
            np.moveaxis(values, axis, 0) for values in (land.classes, land.plots, counted)
        )
        meets = (classes[1:] != classes[:-1]) | (plots[1:] != plots[:-1])
        meets &= counts[1:] & counts[:-1]
        first, second = classes[1:][meets].astype(np.int64), classes[:-1][meets].astype(np.int64)
        pairs += np.bincount(first * CLASSES + second, minlength=CLASSES**2)
    square = pairs.reshape(CLASSES, CLASSES)
    both: FloatArray = square + square.T
    return both
