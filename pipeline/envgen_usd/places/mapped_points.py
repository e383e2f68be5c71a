"""What a map has on and beside its streets: crossings, signs, furniture, trees, barriers."""

import re
from collections import defaultdict
from collections.abc import Callable, Iterator

import numpy as np
import shapely

from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.street_plan import MapLine, StreetPoint
from envgen_usd.places.osm_streets import Places, StreetExtract
from envgen_usd.places.osm_tags import line_kind

_TREE_SPACING = 8.0
"""Distance of the trees of a row, metres; a larger value gives fewer trees."""
_HEIGHTS = (0.2, 10.0)
"""Plausible heights of barriers, metres."""

Metric = Callable[[Places], FloatArray]
"""Projection of longitudes and latitudes, N x 2, metres."""


def points_of_map(extract: StreetExtract, metric: Metric) -> tuple[StreetPoint, ...]:
    """Crossings, signals, signs, and what stands beside streets."""
    return (*_on_streets(extract, metric), *_beside(extract, metric))


def lines_of_map(extract: StreetExtract, metric: Metric) -> tuple[MapLine, ...]:
    """Hedges, fences, walls and railways."""
    found = []
    for tags, places in extract.lines:
        kind, line = line_kind(tags), metric(places)
        if kind != "tree_row" and np.linalg.norm(np.diff(line, axis=0), axis=1).sum() > 0.0:
            found.append(MapLine(kind, line, _metres(tags.get("height", ""))))
    return tuple(found)


def _on_streets(extract: StreetExtract, metric: Metric) -> Iterator[StreetPoint]:
    on: dict[int, list[int]] = defaultdict(list)
    for way in extract.ways:
        for node in way.nodes:
            on[node].append(way.id)
    for node, kind, place, along in extract.points:
        if on[node]:
            only = on[node][0] if len(on[node]) == 1 else 0
            yield StreetPoint(kind, metric((place,))[0], along, only)


def _beside(extract: StreetExtract, metric: Metric) -> Iterator[StreetPoint]:
    places = metric(tuple(place for _, place in extract.beside))
    for (kind, _), place in zip(extract.beside, places, strict=True):
        yield StreetPoint(kind, place)
    places = metric(tuple(place for _, _, place, _ in extract.signs))
    for (_, code, _, along), place in zip(extract.signs, places, strict=True):
        yield StreetPoint("sign", place, along, code=code)
    for tags, line in extract.lines:
        if line_kind(tags) == "tree_row":
            for place in _row(metric(line)):
                yield StreetPoint("tree", place)


def _row(line: FloatArray) -> FloatArray:
    """Places of the trees of a row, evenly along its line."""
    path = shapely.LineString(line)
    count = max(round(path.length / _TREE_SPACING), 1)
    places = np.linspace(0.0, path.length, count + 1)
    found: FloatArray = shapely.get_coordinates(shapely.line_interpolate_point(path, places))
    return found


def _metres(text: str) -> float:
    """Height of a barrier; NaN where the tag says nothing or nonsense."""
    found = re.match(r"\s*([0-9]+(?:[.,][0-9]+)?)\s*m?\s*$", text)
    value = float(found[1].replace(",", ".")) if found else 0.0
    return value if _HEIGHTS[0] <= value <= _HEIGHTS[1] else float("nan")
