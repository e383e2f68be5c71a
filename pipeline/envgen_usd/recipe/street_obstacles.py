"""What stands in the way of actors: footprints of the features of a city, with their real sizes."""

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np
import shapely

from envgen_usd.assets.asset_catalogue import Catalogue
from envgen_usd.city.footprints import footprint_of
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.city_model import City, CityObject

_IN_THE_WAY = ("CityFurniture", "SolitaryVegetationObject", "PlantCover", "OtherConstruction")
_FLAT = 0.1
"""Height of an asset, metres, below which it is in nobody's way: gratings."""
_LOWEST_MAST = 2.9
"""Height of an asset, metres, above which only its foot is in the way: trees, lamps, signs."""


def street_obstacles(city: City, catalogue: Catalogue) -> tuple[shapely.Geometry, ...]:
    """Returns the ground that furniture, plants, walls and buildings cover, in plan.

    Args:
        city: City of a chunk.
        catalogue: Asset library; gives the sizes of what the city model places without a size.
    """
    sizes, flat = low_sizes(catalogue), flat_kinds(catalogue)
    standing = (each for each in city.objects if each.kind in _IN_THE_WAY)
    shapes = [
        footprint_of(_sized(each, sizes))
        for each in standing
        if each.placement is None or each.placement.template not in flat
    ]
    floors = [floor for each in city.objects if each.kind == "Building" for floor in _floors(each)]
    return tuple(shape for shape in (*shapes, *floors) if not shape.is_empty)


def low_sizes(catalogue: Catalogue) -> Mapping[str, FloatArray]:
    """Largest extent (x, y) in metres of the assets of each kind of low furniture."""
    sizes: dict[str, FloatArray] = {}
    for asset in catalogue.assets.values():
        boxes = np.stack(list(asset.extents.values()))
        size = (boxes[:, 1] - boxes[:, 0]).max(axis=0)
        if size[2] < _LOWEST_MAST:
            sizes[asset.kind] = np.maximum(sizes.get(asset.kind, np.zeros(2)), size[:2])
    return sizes


def flat_kinds(catalogue: Catalogue) -> frozenset[str]:
    """Kinds of assets that lie flat on the ground."""
    heights: dict[str, float] = {}
    for asset in catalogue.assets.values():
        highest = max(float(box[1][2]) for box in asset.extents.values())
        heights[asset.kind] = max(heights.get(asset.kind, 0.0), highest)
    return frozenset(kind for kind, height in heights.items() if height < _FLAT)


def _sized(feature: CityObject, sizes: Mapping[str, FloatArray]) -> CityObject:
    placement = feature.placement
    if placement is None or placement.template not in sizes or placement.size[:2].any():
        return feature
    size = np.append(sizes[placement.template], placement.size[2])
    return replace(feature, placement=replace(placement, size=size))


def _floors(building: CityObject) -> Iterator[shapely.Geometry]:
    """Ground surfaces of a building and its parts."""
    for part in building.walk():
        for surface in part.surfaces:
            if surface.kind == "GroundSurface":
                for number in range(len(surface.polygons)):
                    yield shapely.Polygon(surface.polygons.rings(number)[0][:, :2]).buffer(0.0)
