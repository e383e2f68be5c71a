"""Landuse of a map beside its streets: its areas, gardens around its buildings, grass elsewhere."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from envgen_usd.chunks import CELL_SIZE, LANDUSE_CELLS, Chunk
from envgen_usd.errors import Issue
from envgen_usd.geometry.road_outline import Outline
from envgen_usd.landuse.field_rows import FieldPieces
from envgen_usd.landuse.house_plots import PlotHouses, PlotLand, house_plots
from envgen_usd.landuse.osm_landuse import MapPath, OsmMap
from envgen_usd.landuse.plot_territories import MARGIN
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
)
"""Land that plots take the place of."""
_VERGE_OVER = (*_SOFT, LanduseClass.WATER)
"""Classes that a verge takes the place of."""
_PATHS_OVER = (LanduseClass.UNKNOWN, *_SOFT, LanduseClass.PARK, LanduseClass.ALLOTMENT)
"""Classes on which paved paths are seen."""
_PAVED, _OWN, _THROUGH = 1, 2, 4
"""Uses of the cells of a path: it is paved, leads to a house, separates plots."""
_LONGEST_OWN = 30.0
"""Longest driveway of a single house, metres; longer ones serve several."""
_BESIDE_PATH = 0.3
"""Land on either side of an unpaved path that belongs to it, metres."""


@dataclass(frozen=True)
class MappedLanduse:
    """Landuse of a map; its squares are plots, and the land around its houses may be.

    Attributes:
        extract: Areas and ways of the map, in the road frame.
        footprints: Buildings of the map, in the road frame.
        houses: Main buildings, to lay plots around; `None` lays none.
    """

    extract: OsmMap
    footprints: Shapes
    houses: PlotHouses | None = None

    @property
    def issues(self) -> tuple[Issue, ...]:
        """Incomplete areas and ways of the map; its roads are those of the road file."""
        found = self.extract.issues
        return tuple(issue for issue in found if issue.kind != "osm.incomplete_road")

    def generate(
        self,
        surface: RoadSurface,
        chunks: Sequence[Chunk],
        profile: Profile,
        seed: int,  # noqa: ARG002 - nothing is drawn
    ) -> dict[Chunk, LanduseMap]:
        """See `LanduseProvider.generate`.

        1. Land around buildings is lawn, or rubble in industrial environments.
        2. The map's areas, water, railways, ways and paved paths lie on it.
        3. The road is that of the road file, with a verge on soft ground; all else is grass.
        4. Rows of fields run along the longest border between roads, water and other land.
        5. Squares are plots, so that they are furnished, and level on hills.
        6. Houses have plots (`house_plots`).
        """
        outline, drawn = Outline.of(surface), self._layers(profile)
        tree = shapely.STRtree([shape for shape, _ in drawn])
        paths = _Paths(self.extract.paths)
        fields = FieldPieces.of(self.extract.shapes, self.extract.classes)
        of_extract = zip(self.extract.shapes, self.extract.classes, strict=True)
        squares = [shape for shape, kind in of_extract if kind == LanduseClass.SQUARE]
        maps = {}
        for chunk in chunks:
            around = self._margin(chunk)
            box = shapely.box(*chunk.bounds).buffer(around * CELL_SIZE, join_style="mitre")
            near = np.sort(tree.query(box)).tolist()
            cells = cells_of_shapes(chunk, (drawn[n] for n in near), around).astype(np.uint8)
            uses = paths.cells(chunk, box, around)
            is_paved = (uses & _PAVED > 0) & np.isin(cells, _PATHS_OVER)
            cells = np.where(is_paved, np.uint8(LanduseClass.ACCESS), cells)
            road, beside = road_cells(chunk, outline, around)
            cells = np.where(road, np.uint8(LanduseClass.ROAD), cells)
            whole = np.where(cells == 0, np.uint8(LanduseClass.GRASS), cells)
            is_verge = beside & np.isin(whole, _VERGE_OVER)
            own = np.s_[around : around + LANDUSE_CELLS, around : around + LANDUSE_CELLS]
            classes = np.where(is_verge, np.uint8(LanduseClass.VERGE), whole)[own]
            numbers = _numbers(classes, chunk, squares)
            if self.houses is not None and around >= MARGIN:
                ground, is_through = profile.plots.landuse, uses & _THROUGH > 0
                land = PlotLand(chunk, around, cells, is_through, (uses & _OWN > 0) & ~is_through)
                plots = house_plots(self.houses, land, ground)[own]
                on_plot = (plots > 0) & np.isin(classes, _SOFT)
                classes = np.where(on_plot, np.uint8(ground), classes)
                numbers = np.where(plots > 0, plots + len(squares), numbers)
            rows = fields.rows(chunk, classes)
            maps[chunk] = LanduseMap(chunk, classes, numbers, rows)
        return maps

    def _margin(self, chunk: Chunk) -> int:
        """Width of the land around a chunk that its landuse follows from, cells."""
        if self.houses is None:
            return 0
        west, south, east, north = chunk.bounds
        reach = MARGIN * CELL_SIZE
        near = self.houses.near((west - reach, south - reach, east + reach, north + reach))
        return MARGIN if len(near) else 0

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


class _Paths:
    """Paths of a map, by place."""

    def __init__(self, paths: Sequence[MapPath]) -> None:
        grounds = [(path, path.ground(0.0 if path.is_paved else _BESIDE_PATH)) for path in paths]
        # Later ones lie over earlier ones: what separates plots hides what leads to houses.
        grounds.sort(key=lambda each: (_separates(each[0]), each[0].is_paved))
        self._uses = [
            _PAVED * path.is_paved | (_THROUGH if _separates(path) else _OWN) for path, _ in grounds
        ]
        self._grounds = np.array([ground for _, ground in grounds], object)
        self._tree = shapely.STRtree(self._grounds)

    def cells(self, chunk: Chunk, box: shapely.Geometry, around: int) -> IntArray:
        """Sum of the uses of the path on each cell of a chunk and its margin; 0 without."""
        near = np.sort(self._tree.query(box)).tolist()
        return cells_of_shapes(chunk, ((self._grounds[n], self._uses[n]) for n in near), around)


def _separates(path: MapPath) -> bool:
    """True for a path between plots; any other is a part of the plot that it leads to."""
    return path.is_through or path.line.length > _LONGEST_OWN


def _numbers(classes: ByteArray, chunk: Chunk, squares: Sequence[shapely.Geometry]) -> IntArray:
    """Number of the square of each cell, by its place in the map's drawing order; 0 without."""
    cells = cells_of_shapes(chunk, ((shape, n + 1) for n, shape in enumerate(squares)))
    numbers: IntArray = np.where(classes == LanduseClass.SQUARE, cells, 0)
    return numbers
