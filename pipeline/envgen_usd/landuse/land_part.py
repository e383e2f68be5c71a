"""The part of a map whose land is laid out at a time."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import shapely

from envgen_usd.geometry.square_index import Bounds, holds
from envgen_usd.landuse.blocks.street_land import MapFrame
from envgen_usd.landuse.land_layout import LandLayout, Shapes
from envgen_usd.landuse.plot_sites import Sites
from envgen_usd.landuse.roadside import Roadside
from envgen_usd.models.array_types import BoolArray, FloatArray
from envgen_usd.models.road_surface import RoadSurface

NEAR = 150.0
"""Distance from the part within which plots outside of blocks are laid out with it, metres.

A larger value lets parts agree about longer rows of plots, and takes longer.
"""
_BESIDE = 60.0
"""Distance from a block within which roads may have to do with it, metres."""
_INTO = 1.0
"""Distance of the point that places a plot from its front, metres."""


@dataclass(frozen=True)
class LandPart:
    """A rectangle of the map, with what it needs to know of the rest.

    A block belongs wholly to the part that holds its south-western corner; any other plot belongs
    to the part that holds the middle of its front. So each plot belongs to one part, and a part
    follows from the roads in it and near it alone.

    Attributes:
        bounds: The rectangle, metres; its west and south borders belong to it.
        middle: Middle of the map, 2, metres.
        reach: Distance of the farthest road from it, metres.
        first: Number of its first plot.
    """

    bounds: Bounds
    middle: FloatArray
    reach: float
    first: int = 1


class PartBlocks:
    """Tells what belongs to a part of a map."""

    def __init__(self, surface: RoadSurface, part: LandPart) -> None:
        """Finds the blocks.

        Args:
            surface: The road in the part and around it.
            part: The part.
        """
        loops = [loop[:, :2] for loop in surface.outline_loops() if len(loop) > 2]
        rings = np.array([shapely.linearrings(loop) for loop in loops], object)
        enclosed = np.flatnonzero(~shapely.is_ccw(rings))
        faces = shapely.polygons(rings[enclosed])
        self._tree = shapely.STRtree(faces)
        corners = [loops[number] for number in enclosed.tolist()]
        self._corners = np.array([loop[np.lexsort(loop.T)[0]] for loop in corners]).reshape(-1, 2)
        self._part = part

    @cached_property
    def frame(self) -> MapFrame:
        """The map around the part."""
        part = self._part
        owned = shapely.union_all([*self._owned_blocks, self._box(NEAR)])
        return MapFrame(part.middle, part.reach, shapely.box(*owned.buffer(_BESIDE).bounds))

    def near(self, roadsides: Sequence[Roadside]) -> list[Roadside]:
        """Roadsides of the part's blocks, and others near the part."""
        lines = [shapely.linestrings(side.points) for side in roadsides]
        around = [*shapely.buffer(self._owned_blocks, _BESIDE), self._box(NEAR)]
        area = shapely.union_all(around)
        shapely.prepare(area)
        return [side for side, line in zip(roadsides, lines, strict=True) if area.intersects(line)]

    @cached_property
    def _owned_blocks(self) -> Shapes:
        blocks: Shapes = self._tree.geometries[self._inside(self._corners)]
        return blocks

    def candidates(self, sites: Sites) -> BoolArray:
        """Sites that belong to the part, and those outside of blocks that may touch them.

        A row of sites is kept whole.
        """
        owners, in_block = self._owners(_places(sites))
        close = shapely.intersects_xy(self._box(NEAR), *_places(sites).T)
        wanted = self._inside(owners) | (close & ~in_block)
        row = np.cumsum(sites.heads) - 1
        kept: BoolArray = np.bincount(row, wanted, minlength=len(sites))[row] > 0.0
        return kept

    def has(self, place: FloatArray) -> bool:
        """Tells whether a place (2, metres) lies in the part."""
        return bool(self._inside(place[None])[0])

    def own(self, layout: LandLayout, sites: Sites) -> LandLayout:
        """What belongs to the part.

        Args:
            layout: Plots of the sites, each with its driveway; lanes of the sites; then others.
            sites: The sites.
        """
        own_sites, back = self._inside(self._owners(_places(sites))[0]), sites.rows > 0
        of_lanes = np.concatenate([own_sites[back], own_sites[back & sites.heads]])
        plots = self._has(layout.plots, own_sites)
        return replace(
            layout,
            plots=layout.plots[plots],
            numbers=self._part.first + np.arange(np.count_nonzero(plots)),
            landuse=layout.landuse[plots],
            driveways=layout.driveways[self._has(layout.driveways, own_sites, are_ways=True)],
            lanes=layout.lanes[self._has(layout.lanes, of_lanes)],
            greens=layout.greens[self._has(layout.greens, np.empty(0, np.bool_))],
        )

    def _has(self, shapes: Shapes, known: BoolArray, *, are_ways: bool = False) -> BoolArray:
        """Tells which shapes belong to the part; of the first of them, it is known."""
        rest = shapes[len(known) :]
        if are_ways:
            # The third and the fourth corner of a way lie in its plot.
            corners = shapely.get_coordinates(rest).reshape(-1, 5, 2)
            places = corners[:, 2:4].mean(axis=1)
        else:
            places = shapely.get_coordinates(shapely.point_on_surface(rest)).reshape(-1, 2)
        return np.concatenate([known, self._inside(self._owners(places)[0])])

    def _owners(self, places: FloatArray) -> tuple[FloatArray, BoolArray]:
        """The points that decide about places (N x 2), and whether a place lies in a block."""
        place, block = self._tree.query(shapely.points(places), "within")
        owners, in_block = places.copy(), np.zeros(len(places), np.bool_)
        owners[place], in_block[place] = self._corners[block], True
        return owners, in_block

    def _inside(self, points: FloatArray) -> BoolArray:
        return holds(self._part.bounds, points)

    def _box(self, margin: float) -> shapely.Geometry:
        return shapely.buffer(shapely.box(*self._part.bounds), margin, join_style="mitre")


def _places(sites: Sites) -> FloatArray:
    """The points that place sites, P x 2, metres: just behind the middles of their fronts."""
    places: FloatArray = sites.fronts.mean(axis=1) + _INTO * sites.normals.mean(axis=1)
    return places
