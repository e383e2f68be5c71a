"""Lays out blocks as a whole, the faces that roads enclose, and the strips along other streets.

The table of contents of `fill_blocks`. It works on polygons of the whole map, so that chunks agree.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray

from envgen_usd.landuse.blocks.gap_plots import gap_plots
from envgen_usd.landuse.blocks.inner_plots import inner_plots
from envgen_usd.landuse.blocks.laid_plot import LaidPlot
from envgen_usd.landuse.blocks.land_areas import largest, union, without
from envgen_usd.landuse.blocks.leftover_land import share_out
from envgen_usd.landuse.blocks.plot_depths import deepened
from envgen_usd.landuse.blocks.street_land import MapFrame, StreetLand
from envgen_usd.landuse.plot_sites import Sites
from envgen_usd.landuse.roadside import Roadside
from envgen_usd.models.array_types import ByteArray, FloatArray
from envgen_usd.models.environment_profile import Profile
from envgen_usd.models.road_surface import RoadSurface


@dataclass(frozen=True)
class Filled:
    """Plots with the land that they were given.

    Attributes:
        shapes: P polygons; first those of the sites, in their order.
        landuse: P, `LanduseClass` of their ground.
        ways: Q x 4 x 2, paved ways into the plots that have no site.
        lanes: L polygons, paved lanes inside of blocks.
        greens: G polygons, blocks whose free land is a common green.
    """

    shapes: NDArray[np.object_]
    landuse: ByteArray
    ways: FloatArray
    lanes: NDArray[np.object_]
    greens: NDArray[np.object_]

    @staticmethod
    def of(sites: Sites, landuse: int, squares: Sequence[LaidPlot] = ()) -> "Filled":
        """Sites and squares alone, with the class of their ground."""
        kinds = [landuse] * len(sites) + [square.landuse for square in squares]
        shapes = [*shapely.polygons(sites.polygons()), *(square.shape for square in squares)]
        return Filled(
            np.array(shapes, object),
            np.array(kinds, np.uint8),
            np.empty((0, 4, 2)),
            *(np.empty(0, object),) * 2,
        )


def fill_blocks(  # noqa: PLR0913, PLR0917 - what plots follow from
    sites: Sites,
    roadsides: Sequence[Roadside],
    surface: RoadSurface,
    profile: Profile,
    seed: int,
    frame: MapFrame | None = None,
    squares: Sequence[LaidPlot] = (),
) -> Filled:
    """Gives the free land of blocks and street fronts to plots.

    1. Land at the street, at corners and in gaps of the front, becomes plots.
    2. The plots at the street grow into the land behind them, until they meet.
    3. Land that is left inside of a block gets lanes, and plots along them (`inner_plots`).
    4. What no plot could use in a block goes to the plots beside it (`share_out`). Outside of
       blocks it stays free, and plots keep their four corners.

    Args:
        sites: Plots that fit.
        roadsides: Roadsides of the whole map.
        surface: The whole road.
        profile: The environment.
        seed: The user's seed.
        frame: The map around the part that is laid out; `None` lays out all of it.
        squares: Squares at streets, which have taken the place of sites.
    """
    rules, blocks = profile.plots, profile.blocks
    if not len(sites) or rules.infill <= 0.0:
        return Filled.of(sites, rules.landuse, squares)
    settled, has_uses = shapely.multipoints(sites.fronts[:, 0]), bool(blocks.uses)
    streets = StreetLand(roadsides, surface, rules, settled, frame, at_junctions=has_uses)
    back_lanes = union(shapely.polygons(sites.lanes()))
    land = without(streets.land, back_lanes)
    paved_squares = union([square.shape for square in squares])
    free = without(without(land, union(shapely.polygons(sites.polygons()))), paved_squares)
    in_gaps, open_land = gap_plots(free, streets, rules, blocks, seed)
    laid = [*squares, *in_gaps]
    gaps = [plot.shape for plot in laid]
    fronts = deepened(sites, free, [*gaps, *open_land], rules, has_inner=bool(blocks.uses))
    lanes: list[shapely.Geometry] = []
    if blocks.uses:
        inner = inner_plots(sites, [*fronts, *gaps], streets, rules, blocks, seed)
        lanes = list(inner.lanes)
        paved = union(lanes)
        shapes = _cut([*fronts, *gaps], paved)
        laid = [*laid, *inner.plots]
        shapes += [plot.shape for plot in inner.plots]
        rest = without(streets.inside, union([*shapes, paved, back_lanes]))
        shapes = share_out(shapes, rest)
    else:
        shapes = [*fronts, *gaps]
    ways = [plot.way for plot in laid if plot.way is not None]
    kinds = [rules.landuse] * len(sites) + [plot.landuse for plot in laid]
    return Filled(
        np.array(shapes, object),
        np.array(kinds, np.uint8),
        np.array(ways).reshape(-1, 4, 2),
        np.array(lanes, object),
        streets.blocks if blocks.uses else np.empty(0, object),
    )


def _cut(shapes: Sequence[shapely.Polygon], lanes: shapely.Geometry) -> list[shapely.Polygon]:
    """Plots without the lanes that run along their sides."""
    shapely.prepare(lanes)
    return [largest(without(s, lanes)) if lanes.intersects(s) else s for s in shapes]
