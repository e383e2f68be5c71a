"""What lies beside the road, as polygons of a map or of a part of it, and how a chunk shows it."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import shapely
from numpy.typing import NDArray

from envgen_usd.chunks import Chunk
from envgen_usd.geometry.road_outline import Outline
from envgen_usd.landuse.field_lattice import fields_of
from envgen_usd.landuse.field_rows import rows_at_roads
from envgen_usd.landuse.outer_land import land_limits, outer_land
from envgen_usd.landuse.shape_cells import cells_of_shapes
from envgen_usd.landuse.woodland import AROUND, draw_wood, road_distance
from envgen_usd.models.array_types import BoolArray, ByteArray, IntArray
from envgen_usd.models.environment_profile import Profile
from envgen_usd.models.landuse import LanduseClass, LanduseMap

WOOD_DISTANCE = 5.0
"""Distance between wood and plots, metres; a larger value leaves wider clearings."""

Shapes = NDArray[np.object_]
"""Polygons, metres, road frame."""


@dataclass(frozen=True)
class LandLayout:
    """Polygons of the land beside the road; later polygons of an array cover earlier ones.

    Attributes:
        plots: P polygons.
        numbers: P, the plots' numbers on the map, from 1.
        landuse: P, `LanduseClass` of their ground.
        driveways: Paved ways into plots.
        lanes: Paved lanes behind plots and inside of blocks.
        greens: Blocks whose free land is a common green.
        verges: Strips between the road and the plots.
        ends: Paved ways behind the ends of roads.
        walks: Sidewalks along them.
    """

    plots: Shapes
    numbers: IntArray
    landuse: ByteArray
    driveways: Shapes
    lanes: Shapes
    greens: Shapes
    verges: Shapes
    ends: Shapes = field(default_factory=lambda: np.empty(0, object))
    walks: Shapes = field(default_factory=lambda: np.empty(0, object))

    @staticmethod
    def joined(parts: Sequence["LandLayout"], verges: Shapes) -> "LandLayout":
        """The layout of several parts, in their order, with the verges of all of them."""

        def together(name: str) -> Shapes:
            joined: Shapes = np.concatenate([getattr(part, name) for part in parts])
            return joined

        return LandLayout(
            together("plots"),
            np.concatenate([part.numbers for part in parts]),
            np.concatenate([part.landuse for part in parts]),
            together("driveways"),
            together("lanes"),
            together("greens"),
            verges,
            together("ends"),
            together("walks"),
        )


class LandDrawing:
    """Draws the landuse of chunks from a layout."""

    def __init__(self, layout: LandLayout, outline: Outline, profile: Profile, seed: int) -> None:
        """Sorts the polygons by place.

        Args:
            layout: What lies beside the road, in and around the chunks that are drawn.
            outline: Outline of the road there; its loops are whole.
            profile: The environment.
            seed: The user's seed; it decides the places of woods and fields.
        """
        self._layout, self._outline = layout, outline
        self._profile, self._seed = profile, seed
        self._numbers = np.append(0, layout.numbers)
        self._landuse = np.append(np.uint8(0), layout.landuse)
        self._plots, self._verges = _Places(layout.plots), _Places(layout.verges)
        self._driveways, self._lanes = _Places(layout.driveways), _Places(layout.lanes)
        self._ends, self._walks = _Places(layout.ends), _Places(layout.walks)
        self._greens = _Places(layout.greens)

    def of(self, chunk: Chunk) -> LanduseMap:
        """Draws a chunk; later shapes cover earlier shapes."""
        profile, seed, outline = self._profile, self._seed, self._outline
        rules, inner = profile.plots, np.s_[AROUND:-AROUND, AROUND:-AROUND]
        road = outline.encloses_grid(*chunk.cell_centres())
        away = road_distance(chunk, outline, land_limits(profile))
        plots = np.where(road, 0, self._plots.cells(chunk))
        classes = np.full(plots.shape, LanduseClass.GRASS, dtype=np.uint8)
        if rules.wood > 0.0 and not profile.blocks.forest:
            classes[draw_wood(chunk, away, self._around_plots, rules.wood, seed)] = (
                LanduseClass.WOOD
            )
        beside = ~self._near_plots(chunk)
        fields = fields_of(chunk, seed)
        for kind, cells in outer_land(fields, away[inner], profile).items():
            classes[cells & beside] = kind
        classes[self._greens.cells(chunk) > 0] = LanduseClass.PARK
        verge = (away[inner] <= rules.verge[0]) | (self._verges.cells(chunk) > 0)
        classes[verge] = LanduseClass.VERGE
        classes[self._walks.cells(chunk) > 0] = LanduseClass.SQUARE
        classes[self._ends.cells(chunk) > 0] = LanduseClass.ROAD_END
        classes[self._lanes.cells(chunk) > 0] = LanduseClass.ACCESS
        classes = np.where(plots > 0, self._landuse[plots], classes)
        classes[self._driveways.cells(chunk) > 0] = LanduseClass.ACCESS
        classes[road] = LanduseClass.ROAD
        rows = rows_at_roads(fields, classes, outline)
        return LanduseMap(chunk, classes, self._numbers[plots], rows)

    @cached_property
    def _around_plots(self) -> shapely.STRtree:
        wide = shapely.buffer(self._layout.plots, WOOD_DISTANCE, join_style="mitre")
        return shapely.STRtree(wide)

    def _near_plots(self, chunk: Chunk) -> BoolArray:
        """Cells of a chunk near plots, 255 x 255."""
        around = self._around_plots
        shapes = around.geometries[around.query(shapely.box(*chunk.bounds))]
        near: BoolArray = cells_of_shapes(chunk, ((shape, 1) for shape in shapes)) > 0
        return near


class _Places:
    """Shapes by place, rasterised into the cells of a chunk."""

    def __init__(self, shapes: Shapes) -> None:
        self._shapes = shapes
        self._tree = shapely.STRtree(shapes)

    def cells(self, chunk: Chunk) -> IntArray:
        """1 + index of the shape at each cell, 255 x 255; 0 without a shape."""
        near = np.sort(self._tree.query(shapely.box(*chunk.bounds)))
        return cells_of_shapes(chunk, zip(self._shapes[near], near + 1, strict=True))
