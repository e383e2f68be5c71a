"""Landuse of a map beside its streets: its areas, gardens around its buildings, grass elsewhere."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from envgen_usd.chunks import Chunk
from envgen_usd.geometry.road_outline import Outline
from envgen_usd.landuse.field_rows import FieldPieces
from envgen_usd.landuse.osm_landuse import OsmMap
from envgen_usd.landuse.road_cells import road_cells
from envgen_usd.landuse.shape_cells import cells_of_shapes
from envgen_usd.models.array_types import ByteArray, IntArray
from envgen_usd.models.environment_profile import Profile
from envgen_usd.models.landuse import LanduseClass, LanduseMap
from envgen_usd.models.place import Shapes
from envgen_usd.models.road_surface import RoadSurface

_GARDEN = 14.0
"""Width of the land around a building that belongs to it, metres."""
_STREETS = (LanduseClass.ROAD, LanduseClass.VERGE)
"""Classes that the road file decides about."""
_SOFT = (
    LanduseClass.GRASS,
    LanduseClass.LAWN,
    LanduseClass.FIELD,
    LanduseClass.WOOD,
    LanduseClass.CROP,
    LanduseClass.ORCHARD,
    LanduseClass.WATER,
)
"""Classes that a verge takes the place of."""


@dataclass(frozen=True)
class MappedLanduse:
    """Landuse of a map; only its squares are plots.

    Attributes:
        extract: Areas and ways of the map, in the road frame.
        footprints: Buildings of the map, in the road frame.
    """

    extract: OsmMap
    footprints: Shapes

    def generate(
        self,
        surface: RoadSurface,
        chunks: Sequence[Chunk],
        profile: Profile,
        seed: int,  # noqa: ARG002 - nothing is drawn
    ) -> dict[Chunk, LanduseMap]:
        """See `LanduseProvider.generate`.

        1. Land around buildings is lawn, or rubble in industrial environments.
        2. The map's areas, water, railways and ways lie on it.
        3. The road is that of the road file, with a verge on soft ground; all else is grass.
        4. Rows of fields run along the longest border between roads, water and other land.
        5. Squares are plots, so that they are furnished, and level on hills.
        """
        outline, drawn = Outline.of(surface), self._layers(profile)
        tree = shapely.STRtree([shape for shape, _ in drawn])
        fields = FieldPieces.of(self.extract.shapes, self.extract.classes)
        of_extract = zip(self.extract.shapes, self.extract.classes, strict=True)
        squares = [shape for shape, kind in of_extract if kind == LanduseClass.SQUARE]
        maps = {}
        for chunk in chunks:
            near = np.sort(tree.query(shapely.box(*chunk.bounds))).tolist()
            cells = cells_of_shapes(chunk, (drawn[n] for n in near))
            classes = np.where(cells == 0, LanduseClass.GRASS, cells).astype(np.uint8)
            classes = _with_road(classes, chunk, outline)
            rows = fields.rows(chunk, classes)
            maps[chunk] = LanduseMap(chunk, classes, _numbers(classes, chunk, squares), rows)
        return maps

    def _layers(self, profile: Profile) -> list[tuple[shapely.Geometry, LanduseClass]]:
        """Shapes with their classes in drawing order."""
        ground = profile.plots.landuse
        around = shapely.buffer(self.footprints, _GARDEN, quad_segs=4)
        gardens = shapely.get_parts(shapely.union_all(around)) if len(around) else []
        own = zip(self.extract.shapes, self.extract.classes, strict=True)
        return [
            *((shape, ground) for shape in gardens),
            *((shape, kind) for shape, kind in own if kind not in _STREETS),
        ]


def _numbers(classes: ByteArray, chunk: Chunk, squares: Sequence[shapely.Geometry]) -> IntArray:
    """Number of the square of each cell, by its place in the map's drawing order; 0 without."""
    cells = cells_of_shapes(chunk, ((shape, n + 1) for n, shape in enumerate(squares)))
    numbers: IntArray = np.where(classes == LanduseClass.SQUARE, cells, 0)
    return numbers


def _with_road(classes: ByteArray, chunk: Chunk, outline: Outline) -> ByteArray:
    """Classes with the road and its verge."""
    road, near = road_cells(chunk, outline)
    classes = np.where(near & np.isin(classes, _SOFT), np.uint8(LanduseClass.VERGE), classes)
    with_road: ByteArray = np.where(road, np.uint8(LanduseClass.ROAD), classes)
    return with_road
