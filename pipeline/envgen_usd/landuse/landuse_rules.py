"""Landuse by rules (the article's generator of ground truth)."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import shapely

from envgen_usd.chunks import Chunk
from envgen_usd.geometry.road_outline import Outline
from envgen_usd.landuse.blocks.block_filling import Filled, fill_blocks
from envgen_usd.landuse.blocks.plot_depths import shared_depths
from envgen_usd.landuse.outer_land import outer_land, rows_outside
from envgen_usd.landuse.plot_sites import Sites, draw_sites
from envgen_usd.landuse.road_stubs import road_stubs
from envgen_usd.landuse.roadside import Roadside, find_roadsides
from envgen_usd.landuse.shape_cells import cells_of_shapes
from envgen_usd.landuse.site_fitting import fit_sites
from envgen_usd.landuse.woodland import draw_wood, near_road
from envgen_usd.models.array_types import BoolArray, ByteArray, FloatArray, IntArray
from envgen_usd.models.environment_profile import Profile
from envgen_usd.models.land_rules import BlockRules
from envgen_usd.models.landuse import LanduseClass, LanduseMap
from envgen_usd.models.road_surface import RoadSurface

WOOD_DISTANCE = 5.0
"""Distance between wood and plots, metres; a larger value leaves wider clearings."""


class RuleProvider:
    """Plots along both sides of the roads and in all of their blocks; woods and grass elsewhere.

    Plots are laid out along the roads of the whole map, in (s, t) of each roadside, and blocks are
    filled as a whole. All are then drawn into the cells of each chunk, so that chunks agree at
    their borders.
    """

    def generate(
        self, surface: RoadSurface, chunks: Sequence[Chunk], profile: Profile, seed: int
    ) -> dict[Chunk, LanduseMap]:
        """See `LanduseProvider.generate`."""
        roadsides = find_roadsides(surface, profile.plots, seed)
        sites = fitted_sites(surface, roadsides, profile, seed)
        filled = fill_blocks(sites, roadsides, surface, profile, seed)
        outline, stubs = Outline.of(surface), road_stubs(surface)
        layout = _lay_out(outline, roadsides, sites, filled, profile, stubs)
        return {chunk: _draw(chunk, layout, profile, seed) for chunk in chunks}


def fitted_sites(
    surface: RoadSurface, roadsides: Sequence[Roadside], profile: Profile, seed: int
) -> Sites:
    """Sites of plots along the streets, with the depths that their blocks leave them.

    Args:
        surface: The whole road.
        roadsides: Roadsides of the whole map.
        profile: Environment.
        seed: The user's seed.
    """
    rules = profile.plots
    several = replace(rules, rows=rows_outside(profile))
    drawn = draw_sites(roadsides, several, seed)
    if several.rows > rules.rows:
        drawn = _first_rows_in_blocks(drawn, surface, rules.rows)
    drawn = shared_depths(drawn, Outline.of(surface), rules)
    return fit_sites(drawn, surface, rules, shallow=True)


def _first_rows_in_blocks(sites: Sites, surface: RoadSurface, rows: int) -> Sites:
    """Sites without further rows that reach into a block; rows in front take precedence."""
    rings = [shapely.linearrings(loop[:, :2]) for loop in surface.outline_loops() if len(loop) > 2]
    inside = [shapely.make_valid(shapely.Polygon(r)) for r in rings if not shapely.is_ccw(r)]
    lost = np.zeros(len(sites), bool)
    shapes = shapely.polygons(sites.polygons())
    lost[shapely.STRtree(inside).query(shapes, "intersects")[0]] = True
    kept = np.flatnonzero(~lost | (sites.rows < rows))
    order = kept[np.argsort(sites.rows[kept], kind="stable")]
    return sites.take(order, np.ones(len(order)))


def draw_landuse(
    surface: RoadSurface,
    chunks: Sequence[Chunk],
    profile: Profile,
    seed: int,
    places: tuple[Sequence[Roadside], Sites],
) -> dict[Chunk, LanduseMap]:
    """Draws the landuse of candidate sites; only sites that fit become plots.

    Blocks and the land behind the outermost plots stay as without `BlockRules`: networks draw in
    windows and know neither.

    Args:
        surface: The whole road.
        chunks: Tiles.
        profile: Environment.
        seed: The user's seed; it decides the places of woods.
        places: Roadsides of the whole map, and candidate sites along them.
    """
    roadsides, sites = places
    profile = replace(profile, blocks=BlockRules())
    fitting = fit_sites(sites, surface, profile.plots)
    filled = Filled.of(fitting, profile.plots.landuse)
    # Networks are told the roads as they are, so theirs end where the file's do.
    none = np.empty((0, 4, 2))
    layout = _lay_out(Outline.of(surface), roadsides, fitting, filled, profile, none)
    return {chunk: _draw(chunk, layout, profile, seed) for chunk in chunks}


class _Shapes:
    """Shapes of the whole map, rasterised into the cells of a chunk."""

    def __init__(self, shapes: Any) -> None:  # noqa: ANN401 - an array of geometries
        self._shapes = shapes
        self._tree = shapely.STRtree(shapes)

    def cells(self, chunk: Chunk) -> IntArray:
        """1 + index of the shape at each cell, 255 x 255; 0 without a shape."""
        near = np.sort(self._tree.query(shapely.box(*chunk.bounds)))
        return cells_of_shapes(chunk, zip(self._shapes[near], near + 1, strict=True))


@dataclass(frozen=True)
class _Layout:
    """Layout of the whole map."""

    outline: Outline
    verges: _Shapes
    plots: _Shapes
    landuse: ByteArray
    around_plots: shapely.STRtree
    driveways: _Shapes
    lanes: _Shapes
    greens: _Shapes


def _lay_out(  # noqa: PLR0913, PLR0917 - what the layout follows from
    outline: Outline,
    roadsides: Sequence[Roadside],
    sites: Sites,
    filled: Filled,
    profile: Profile,
    stubs: FloatArray,
) -> _Layout:
    verges = [np.empty((0, 4, 2)), *(side.verges() for side in roadsides)]
    ways = np.concatenate([sites.driveways(profile.buildings.setback[1], outline), filled.ways])
    paved = np.concatenate([sites.lanes(), stubs])
    return _Layout(
        outline,
        _Shapes(shapely.polygons(np.concatenate(verges))),
        _Shapes(filled.shapes),
        np.concatenate([np.zeros(1, np.uint8), filled.landuse]),
        shapely.STRtree(shapely.buffer(filled.shapes, WOOD_DISTANCE, join_style="mitre")),
        _Shapes(shapely.polygons(ways)),
        _Shapes(np.concatenate([shapely.polygons(paved), filled.lanes])),
        _Shapes(filled.greens),
    )


def _draw(chunk: Chunk, layout: _Layout, profile: Profile, seed: int) -> LanduseMap:
    """Draws a chunk; later shapes cover earlier shapes."""
    rules = profile.plots
    road = layout.outline.encloses_grid(*chunk.cell_centres())
    plots = np.where(road, 0, layout.plots.cells(chunk))
    classes = np.full(plots.shape, LanduseClass.GRASS, dtype=np.uint8)
    if rules.wood > 0.0 and not profile.blocks.forest:
        wood = draw_wood(chunk, layout.outline, layout.around_plots, rules.wood, seed)
        classes[wood] = LanduseClass.WOOD
    taken = layout.around_plots
    for kind, cells in outer_land(chunk, layout.outline, profile, seed).items():
        classes[cells & ~_near_plots(chunk, taken)] = kind
    classes[layout.greens.cells(chunk) > 0] = LanduseClass.PARK
    verge = near_road(chunk, layout.outline, rules.verge[0]) | (layout.verges.cells(chunk) > 0)
    classes[verge] = LanduseClass.VERGE
    classes[layout.lanes.cells(chunk) > 0] = LanduseClass.ACCESS
    classes = np.where(plots > 0, layout.landuse[plots], classes)
    classes[layout.driveways.cells(chunk) > 0] = LanduseClass.ACCESS
    classes[road] = LanduseClass.ROAD
    return LanduseMap(chunk, classes, plots)


def _near_plots(chunk: Chunk, around: shapely.STRtree) -> BoolArray:
    """Cells of a chunk near plots, 255 x 255."""
    shapes = around.geometries[around.query(shapely.box(*chunk.bounds))]
    near: BoolArray = cells_of_shapes(chunk, ((shape, 1) for shape in shapes)) > 0
    return near
