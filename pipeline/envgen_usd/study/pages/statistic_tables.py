"""Tables of the statistics of real and synthetic images."""

import math
from collections.abc import Sequence

import numpy as np

from envgen_usd.models.array_types import FloatArray
from envgen_usd.study.pages.study_tables import Table
from envgen_usd.study.set_realism import Distance
from envgen_usd.study.set_statistics import BANDS, SetStatistics
from envgen_usd.study.study_classes import CLASSES

_NAMES = (*CLASSES, "void")
_BORDERS = 12
"""Pairs of neighbouring classes that are listed."""


def statistic_tables(real: SetStatistics, synthetic: SetStatistics) -> tuple[Table, ...]:
    """Statistics by class, by row, by column, and of neighbours: real / synthetic."""
    return (
        _by_class(real, synthetic),
        _by_band("row, from the top", real.rows, synthetic.rows),
        _by_band("column, from the left", real.columns, synthetic.columns),
        _neighbours(real, synthetic),
    )


def distance_table(title: str, distances: Sequence[Distance]) -> Table:
    """Distances beside those of real ones."""
    body = [
        (
            each.name,
            f"{each.synthetic:.4f}",
            f"{each.real:.4f}",
            "–" if math.isnan(each.ratio) else f"{each.ratio:.1f}",
        )
        for each in distances
    ]
    head = ("distance", "synthetic to real", "real to real", "times")
    return Table(title, head, tuple(body))


def _by_class(real: SetStatistics, synthetic: SetStatistics) -> Table:
    body = []
    for value, name in enumerate(_NAMES):
        cells = [_pair(100 * real.share[value], 100 * synthetic.share[value], 1)]
        for key in ("brightness", "chroma", "gradient"):
            if value < len(CLASSES):
                pair = getattr(real, key)[value], getattr(synthetic, key)[value]
                cells.append(_pair(*pair, 3))
            else:
                cells.append("")
        body.append((name, *cells))
    head = ("class", "share, %", "brightness", "chroma", "gradient")
    return Table("By class, real / synthetic", head, tuple(body))


def _by_band(name: str, real: FloatArray, synthetic: FloatArray) -> Table:
    body = [
        (f"{band + 1} of {BANDS}", *(_pair(100 * r, 100 * s, 0) for r, s in zip(a, b, strict=True)))
        for band, (a, b) in enumerate(zip(real, synthetic, strict=True))
    ]
    return Table(f"Shares by {name}, %, real / synthetic", ("band", *_NAMES), tuple(body))


def _neighbours(real: SetStatistics, synthetic: SetStatistics) -> Table:
    gap = np.triu(np.abs(real.adjacency - synthetic.adjacency))
    body = []
    for place in np.argsort(-gap, axis=None)[:_BORDERS].tolist():
        a, b = divmod(place, len(_NAMES))
        pair = _pair(200 * real.adjacency[a, b], 200 * synthetic.adjacency[a, b], 1)
        body.append((f"{_NAMES[a]} and {_NAMES[b]}", pair))
    head = ("neighbours", "share of the borders, %")
    return Table("Neighbours that differ most, real / synthetic", head, tuple(body))


def _pair(first: float, second: float, digits: int) -> str:
    return " / ".join("–" if math.isnan(v) else f"{v:.{digits}f}" for v in (first, second))
