"""Landuse of a generated place with plots that are straight and right-angled to their streets."""

import numpy as np
import shapely
from numpy.typing import NDArray

from envgen_usd.geometry.road_outline import Outline
from envgen_usd.landuse.place_fitting import Fitted, fit_places
from envgen_usd.landuse.place_landuse import WHOLE, PlaceLand, with_whole_plots
from envgen_usd.landuse.place_sites import place_sites
from envgen_usd.landuse.plot_territories import BARRIERS
from envgen_usd.landuse.roadside import find_roadsides
from envgen_usd.landuse.shape_cells import cells_of_box
from envgen_usd.landuse.specks import remove_specks
from envgen_usd.models.array_types import BoolArray, ByteArray, IntArray
from envgen_usd.models.environment_profile import Profile
from envgen_usd.models.landuse import LanduseClass
from envgen_usd.models.road_surface import RoadSurface

LEAST_AREA = 150
"""Least number of connected cells of a class beside plots: about 90 m². A larger value removes
larger remains of ways."""
LONGEST_WAY = 6.0
"""Longest way inside of a plot, metres."""
_GROUNDS = (LanduseClass.LAWN, LanduseClass.RUBBLE)


def with_straight_plots(
    land: PlaceLand, corner: tuple[int, int], surface: RoadSurface, profile: Profile, seed: int
) -> PlaceLand:
    """Replaces plots around buildings by straight ones along the streets, with ways into them.

    1. Each plot is laid along its street (`place_sites`), and kept if it is clear of roads and of
       the plots before it (`fit_places`).
    2. The ground of plots that are not kept is grass, and verges lie along the road.
    3. Parks, car parks and allotments remain whole plots.

    Args:
        land: Cells of the whole map.
        corner: Column and row of its first cell on the map's lattice.
        surface: The whole road.
        profile: Verges, length of ways, least depth of plots.
        seed: The user's seed; it decides the width of verges.
    """
    rules, outline = profile.plots, Outline.of(surface)
    fitted = straight_plots(land, corner, surface, profile, seed)
    size = land.classes.shape

    def drawn(shapes: NDArray[np.object_]) -> IntArray:
        return cells_of_box(corner, size, zip(shapes, range(1, len(shapes) + 1), strict=True))

    plots = drawn(fitted.shapes)
    inside = min(profile.buildings.setback[1], LONGEST_WAY)
    ways = drawn(shapely.polygons(fitted.sites.driveways(inside, outline))) > 0
    edges = shapely.linestrings(np.stack([outline.start[:, :2], outline.end[:, :2]], axis=1))
    verge = drawn(shapely.buffer(edges, rules.verge[0], quad_segs=4)) > 0
    return _painted(land, plots, ways, verge)


def straight_plots(
    land: PlaceLand, corner: tuple[int, int], surface: RoadSurface, profile: Profile, seed: int
) -> Fitted:
    """Plots of buildings along the streets; see rule 1 of `with_straight_plots`."""
    roadsides = find_roadsides(surface, profile.plots, seed)
    candidates = place_sites(land, corner, roadsides, profile.plots)
    return fit_places(candidates, surface, profile.plots)


def _painted(land: PlaceLand, plots: IntArray, ways: BoolArray, verge: BoolArray) -> PlaceLand:
    """Cells with new plots; later rules cover earlier ones."""
    given = np.isin(land.classes, BARRIERS)
    plots = np.where(given, 0, plots)
    ground = _ground(land.classes, plots)
    beside = np.isin(land.classes, (*_GROUNDS, LanduseClass.VERGE))
    classes = np.where(beside, np.uint8(LanduseClass.GRASS), land.classes)
    smooth = remove_specks(classes, LEAST_AREA)
    classes = np.where(np.isin(smooth, BARRIERS), classes, smooth)
    classes[verge & ~np.isin(classes, WHOLE)] = LanduseClass.VERGE
    classes = np.where(plots > 0, ground[plots], classes)
    classes[ways] = LanduseClass.ACCESS
    classes = np.where(given, land.classes, classes).astype(np.uint8)
    return PlaceLand(classes, with_whole_plots(plots, classes), land.built & (plots > 0))


def _ground(classes: ByteArray, plots: IntArray) -> ByteArray:
    """Ground of each plot by number: what most of its cells of either ground have."""
    count = int(plots.max(initial=0)) + 1
    lawn, rubble = (np.bincount(plots[classes == kind], minlength=count) for kind in _GROUNDS)
    ground: ByteArray = np.where(rubble > lawn, *_GROUNDS[::-1]).astype(np.uint8)
    return ground
