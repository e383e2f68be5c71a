"""Landuse by rules (the article's generator of ground truth)."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import shapely

from envgen_usd.chunks import Chunk
from envgen_usd.geometry.road_outline import Outline
from envgen_usd.landuse.blocks.block_filling import Filled, fill_blocks
from envgen_usd.landuse.blocks.plot_depths import shared_depths
from envgen_usd.landuse.blocks.town_squares import with_squares
from envgen_usd.landuse.end_streets import EndLand, land_behind_ends
from envgen_usd.landuse.land_layout import LandDrawing, LandLayout, Shapes
from envgen_usd.landuse.land_part import LandPart, PartBlocks
from envgen_usd.landuse.outer_land import rows_outside
from envgen_usd.landuse.plot_sites import Sites, draw_sites
from envgen_usd.landuse.road_stubs import road_ends
from envgen_usd.landuse.roadside import Roadside, find_roadsides
from envgen_usd.landuse.site_fitting import fit_sites
from envgen_usd.models.environment_profile import Profile
from envgen_usd.models.land_rules import BlockRules
from envgen_usd.models.landuse import LanduseMap
from envgen_usd.models.road_surface import RoadSurface


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
        layout = lay_out(surface, profile, seed)
        drawing = LandDrawing(layout, Outline.of(surface), profile, seed)
        return {chunk: drawing.of(chunk) for chunk in chunks}


def lay_out(
    surface: RoadSurface, profile: Profile, seed: int, part: LandPart | None = None
) -> LandLayout:
    """Lays out the land beside the road.

    Args:
        surface: The whole road, or that in a part of the map and around it.
        profile: The environment.
        seed: The user's seed.
        part: The part of the map; `None` lays out all of it.

    Returns:
        What belongs to the part, and all verges.
    """
    outline = Outline.of(surface)
    blocks = PartBlocks(surface, part) if part else None
    frame = blocks.frame if blocks is not None else None
    roadsides = all_sides = find_roadsides(surface, profile.plots, seed)
    if blocks is not None:
        roadsides = blocks.near(all_sides)
    sites = fitted_sites(surface, roadsides, profile, seed, blocks)
    sites, squares = with_squares(sites, profile.squares, seed)
    filled = fill_blocks(sites, roadsides, surface, profile, seed, frame, squares)
    layout = _layout(outline, all_sides, sites, filled, profile)
    ends = road_ends(surface)
    land = list(land_behind_ends(ends, surface, layout, profile, seed))
    if blocks is None or part is None:
        return _with_ends(layout, land, profile, 1)
    # All that lies behind an end belongs to the part that has the end.
    own_land = [one for one, end in zip(land, ends, strict=True) if blocks.has(end.middle)]
    return _with_ends(blocks.own(layout, sites), own_land, profile, part.first)


def _with_ends(
    layout: LandLayout, found: Sequence[EndLand], profile: Profile, first: int
) -> LandLayout:
    """Adds what lies behind the ends of roads; the first of all plots has a given number."""
    if not found:
        return layout
    plots = np.concatenate([part.plots for part in found])
    first += len(layout.plots)
    return replace(
        layout,
        plots=np.concatenate([layout.plots, plots]),
        numbers=np.append(layout.numbers, first + np.arange(len(plots))),
        landuse=np.append(layout.landuse, np.full(len(plots), profile.plots.landuse, np.uint8)),
        driveways=np.concatenate([layout.driveways, *(part.driveways for part in found)]),
        ends=np.concatenate([part.ways for part in found]),
        walks=np.concatenate([part.walks for part in found]),
    )


def fitted_sites(
    surface: RoadSurface,
    roadsides: Sequence[Roadside],
    profile: Profile,
    seed: int,
    blocks: PartBlocks | None = None,
) -> Sites:
    """Sites of plots along the streets, with the depths that their blocks leave them.

    Args:
        surface: The whole road.
        roadsides: Roadsides of the whole map.
        profile: Environment.
        seed: The user's seed.
        blocks: The blocks of the part that is laid out; `None` means all of the map.
    """
    rules = profile.plots
    several = replace(rules, rows=rows_outside(profile))
    drawn = draw_sites(roadsides, several, seed)
    if blocks is not None:
        kept = np.flatnonzero(blocks.candidates(drawn))
        drawn = drawn.take(kept, np.ones(len(kept)))
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
    outline = Outline.of(surface)
    # Networks are told the roads as they are, so theirs end where the file's do.
    layout = _layout(outline, roadsides, fitting, filled, profile)
    drawing = LandDrawing(layout, outline, profile, seed)
    return {chunk: drawing.of(chunk) for chunk in chunks}


def _layout(
    outline: Outline,
    roadsides: Sequence[Roadside],
    sites: Sites,
    filled: Filled,
    profile: Profile,
) -> LandLayout:
    ways = np.concatenate([sites.driveways(profile.buildings.setback[1], outline), filled.ways])
    return LandLayout(
        filled.shapes,
        np.arange(len(filled.shapes)) + 1,
        filled.landuse,
        shapely.polygons(ways),
        np.concatenate([shapely.polygons(sites.lanes()), filled.lanes]),
        filled.greens,
        verges_of(roadsides),
    )


def verges_of(roadsides: Sequence[Roadside]) -> Shapes:
    """The strips between the borders of roads and the plots along them."""
    verges: Shapes = shapely.polygons(
        np.concatenate([np.empty((0, 4, 2)), *(side.verges() for side in roadsides)])
    )
    return verges
