"""Features of the OpenDRIVE file, and which of them a chunk has to know."""

from collections.abc import Iterable, Sequence

import numpy as np

from envgen_usd.chunks import CHUNK_SIZE, Chunk
from envgen_usd.city.chunk_pieces import ChunkPieces
from envgen_usd.city.footprints import Footprints, footprint_of
from envgen_usd.city.names import reference
from envgen_usd.city.road_links import with_controls
from envgen_usd.models.arrays import FloatArray
from envgen_usd.models.city import CityObject
from envgen_usd.models.surface import RoadSurface

_MARGIN = 30.0
"""Metres around a chunk in which a feature matters to what stands in it."""


def near_chunk(features: Iterable[CityObject], chunk: Chunk) -> list[CityObject]:
    """Features of the file that reach into the chunk or near it."""
    x0, y0, x1, y1 = chunk.bounds
    low, high = np.array([x0, y0]) - _MARGIN, np.array([x1, y1]) + _MARGIN
    found = []
    for feature in features:
        points = _points(feature)
        if len(points) and (points.max(axis=0) >= low).all() and (points.min(axis=0) <= high).all():
            found.append(feature)
    return found


def without_replaced(
    given: Iterable[CityObject], features: Iterable[CityObject]
) -> list[CityObject]:
    """Features of the file without its buildings that given ones stand in place of."""
    taken = Footprints([]).joined(given)
    return [
        feature
        for feature in features
        if feature.kind != "Building" or not taken.touches(footprint_of(feature))
    ]


def in_chunk(
    features: Sequence[CityObject], surface: RoadSurface, chunk: Chunk
) -> tuple[CityObject, ...]:
    """Features of the file that stand in the chunk, with the lanes that they regulate there."""
    here = [feature for feature in features if _tile(feature) == chunk]
    if not here:
        return ()
    features_by_id = {feature.id: feature for feature in surface.furniture}
    pieces = ChunkPieces(surface)

    def refer(name: str) -> str:
        feature = features_by_id.get(name)
        tile = _tile(feature) if feature is not None else None
        if tile is not None:
            return reference(name, "" if tile == chunk else tile.name)
        return pieces.reference(name, chunk)

    return with_controls(here, surface, refer)


def _points(feature: CityObject) -> FloatArray:
    """Points of a feature in plan, N x 2."""
    if feature.placement is not None:
        return feature.placement.position[None, :2]
    shapes = [*feature.geometry.values(), *(surface.polygons for surface in feature.surfaces)]
    points = [shape.points for shape in shapes]
    points += [curve for curves in feature.curves.values() for curve in curves]
    return np.concatenate([np.empty((0, 3)), *points])[:, :2]


def _tile(feature: CityObject) -> Chunk | None:
    """Chunk in which the middle of a feature's points lies."""
    points = _points(feature)
    if not len(points):
        return None
    return Chunk(*np.floor(points.mean(axis=0) / CHUNK_SIZE).astype(int).tolist())
