"""Features of the OpenDRIVE file, selected by chunk."""

from collections import Counter
from collections.abc import Collection, Iterable, Sequence

import numpy as np

from envgen_usd.chunks import Chunk, chunk_at
from envgen_usd.city.feature_ids import reference
from envgen_usd.city.footprints import Footprints, footprint_of
from envgen_usd.city.roads.feature_relations import SIGN_REACH, with_controls
from envgen_usd.city.roads.file_objects import file_object
from envgen_usd.city.roads.road_index import RoadIndex
from envgen_usd.errors import Issue, Severity
from envgen_usd.models.city_model import CityObject
from envgen_usd.models.road_feature import RoadFeature

_MARGIN = 30.0
"""Margin around a chunk in which features affect its objects, metres; a larger value includes more.

"""


def near_chunk(roads: RoadIndex, chunk: Chunk) -> list[CityObject]:
    """Features of the file that reach into the chunk or near it."""
    x0, y0, x1, y1 = chunk.bounds
    low, high = np.array([x0, y0]) - _MARGIN, np.array([x1, y1]) + _MARGIN
    objects = []
    for feature in roads.features_near(chunk.bounds, _MARGIN):
        points = feature.plan()
        if (points.max(axis=0) >= low).all() and (points.min(axis=0) <= high).all():
            objects.append(file_object(feature))
    return objects


def beyond_land(features: Iterable[RoadFeature], chunks: Collection[Chunk]) -> tuple[Issue, ...]:
    """Returns an issue for each object or signal of the file with instances in no chunk."""
    far = [feature for feature in features if _tile(feature) not in chunks]
    counts = Counter(feature.origin for feature in far if feature.origin is not None)
    return tuple(
        Issue(
            "object.beyond_land",
            Severity.WARNING,
            origin.path,
            f"{count} instances stand beyond the land around the roads",
            "left out",
        )
        for origin, count in counts.items()
    )


def replaced_issues(
    features: Iterable[CityObject], kept: Iterable[CityObject], roads: RoadIndex, chunk: Chunk
) -> tuple[Issue, ...]:
    """Returns an issue for each building of the file in a chunk that given buildings replace."""
    left = {feature.id for feature in kept}
    gone = [roads.features[each.id] for each in features if each.id not in left]
    return tuple(
        Issue(
            "object.replaced",
            Severity.INFO,
            feature.origin.path if feature.origin is not None else feature.id,
            "a building of the city model stands there",
            "left out",
        )
        for feature in gone
        if _tile(feature) == chunk
    )


def without_replaced(given: Footprints, features: Iterable[CityObject]) -> list[CityObject]:
    """Features of the file without buildings that given buildings replace."""
    return [
        feature
        for feature in features
        if feature.kind != "Building" or not given.touches(footprint_of(feature))
    ]


def in_chunk(
    features: Sequence[CityObject], roads: RoadIndex, chunk: Chunk
) -> tuple[CityObject, ...]:
    """Features of the file that stand in the chunk, with the lanes that they regulate there."""
    here = [feature for feature in features if _tile(roads.features[feature.id]) == chunk]
    if not here:
        return ()

    def refer(name: str) -> str:
        feature = roads.features.get(name)
        tile = _tile(feature) if feature is not None else None
        if tile is not None:
            return reference(name, "" if tile == chunk else tile.name)
        return roads.pieces.reference(name, chunk)

    lanes = roads.pieces.lanes_near(chunk.bounds, SIGN_REACH)
    return with_controls(here, lanes, roads.abreast, refer)


def _tile(feature: RoadFeature) -> Chunk | None:
    """Chunk at the mean of a feature's points."""
    points = feature.plan()
    if not len(points):
        return None
    return chunk_at(points.mean(axis=0))
