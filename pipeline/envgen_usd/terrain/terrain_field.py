"""Ground height as a function of the position, fitted once to the road."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import distance_transform_edt

from envgen_usd.geometry.road_outline import Outline
from envgen_usd.geometry.square_index import Bounds
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.ground import Heights
from envgen_usd.models.land_rules import TerrainRules
from envgen_usd.models.landuse import Plot
from envgen_usd.models.road_surface import RoadSurface
from envgen_usd.terrain.bank_slopes import limit_slopes
from envgen_usd.terrain.height_lattice import Extent, Lattice, extent_around
from envgen_usd.terrain.land_guess import guess_land, heights_on_grid
from envgen_usd.terrain.membrane import fill_membrane
from envgen_usd.terrain.plot_pads import level_plots

MARGIN = 40.0
"""Metres of lattice beyond the road."""
HILLS_MARGIN = 300.0
"""Metres of lattice beyond the road with hills or an elevation model. All chunks beside the road
need limited slopes, and banks need room to meet the land."""
EXACT = 1.5e-3
"""Metres; smaller differences are rounding to the coordinate grid."""
BANK_SHARE = 0.7
"""Share of the steepest slope that the lattice may use; the remainder is for the correction at the
road."""
FADING = 15.0
"""Metres from the road beyond which an elevation model stays unchanged, except for banks."""
STEEP_SHARE = 0.9
"""Quantile of the land's slope that banks have to reckon with; a larger value lengthens banks."""
MISMATCH_REACH = 4.0
"""Lattice steps over which the lattice's mismatch at the road fades."""


@dataclass(frozen=True)
class TerrainPart:
    """A part of a map whose ground is fitted by itself.

    Attributes:
        land: The land of the map without its roads.
        bounds: The part with its surroundings, metres.
    """

    land: Heights
    bounds: Bounds


@dataclass(frozen=True)
class TerrainField:
    """Ground height at all positions.

    Attributes:
        outline: The road's outline, where the ground meets the road.
        base: Heights without the road: its trend with hills, or an elevation model.
        correction: Difference that brings the ground to the road; `None` if the base meets the
            road already.
    """

    outline: Outline
    base: Heights
    correction: Lattice | None

    def __call__(self, points: FloatArray) -> FloatArray:
        """Evaluates heights at points (N x 2), metres."""
        return self._corrected(points, self.base(points))

    def on_grid(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Evaluates heights on a grid, len(y) x len(x), metres."""
        points = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
        base = heights_on_grid(self.base, x, y).ravel()
        return self._corrected(points, base).reshape(len(y), len(x))

    def _corrected(self, points: FloatArray, base: FloatArray) -> FloatArray:
        if self.correction is None:
            return base
        corrected: FloatArray = base + self.correction(points)
        corrected += self._mismatch(points, self.correction)
        return corrected

    def _mismatch(self, points: FloatArray, correction: Lattice) -> FloatArray:
        """Returns the lattice's mismatch at the nearest point of the road, faded by distance."""
        reach = MISMATCH_REACH * correction.extent.spacing
        distance, place = self.outline.nearest(points, reach)
        near = distance < reach
        foot, share = place[near], 1 - distance[near] / reach
        result = np.zeros(len(points))
        missing = foot[:, 2] - self.base(foot) - correction(foot)
        result[near] = missing * share * share * (3 - 2 * share)
        return result


def fit_terrain(  # noqa: PLR0913, PLR0917 - everything that moves the ground
    surface: RoadSurface,
    rules: TerrainRules,
    seed: int,
    base: Heights | None = None,
    plots: Sequence[Plot] = (),
    part: TerrainPart | None = None,
) -> TerrainField:
    """Fits the ground to the road's outline and to plots.

    1. The base is an elevation model, or the plane through the road with seeded hills. The plane
       is level along axes with little spread of the road.
    2. Between roads, a membrane interpolates the mismatch of the base at the outline. Hills
       therefore grow with the distance from the road.
    3. The slope of the sum is limited to the bank slope.
    4. On hills and elevation models, plots become planes with banks around them.

    Args:
        surface: Road; its outline and, for hills, its turning are used.
        rules: Relief and slopes.
        seed: The user's seed.
        base: Elevation model; `None` derives the land from the road.
        plots: Plots of the whole map.
        part: The part of the map that is fitted; `None` means all of it.
    """
    outline = Outline.of(surface)
    if part is not None:
        outline = outline.near(part.bounds, MARGIN)
    land = base or (part.land if part else guess_land(surface, rules, seed))
    built_on = plots if base is not None or rules.relief > 0.0 else ()
    samples, _ = outline.samples(1.0)
    missing = float(np.max(np.abs(samples[:, 2] - land(samples)), initial=0.0))
    if not len(outline) or (missing < EXACT and not built_on):
        return TerrainField(outline, land, None)
    margin = HILLS_MARGIN if rules.relief and base is None else MARGIN
    if base is not None:
        rise = max((float(np.ptp(land(plot.polygon))) for plot in built_on), default=0.0)
        margin = min(MARGIN + 4 * (missing + rise) / rules.bank_slope, HILLS_MARGIN)
    corners = [samples[:, :2], *(plot.polygon for plot in built_on)]
    extent = extent_around(np.concatenate(corners), margin, part.bounds if part else None)
    slope = max(BANK_SHARE * rules.bank_slope, _steepness(samples))
    start = heights_on_grid(land, *extent.axes())
    road = _at_the_road(outline, samples, extent)
    ground = _bring_to(start, road, extent.spacing, slope, base is not None)
    if built_on:
        pads = level_plots(Lattice(extent, ground), built_on)
        built = np.where(np.isnan(road), pads, road)
        ground = _bring_to(ground, built, extent.spacing, slope, True)
    return TerrainField(outline, land, Lattice(extent, ground - start))


def _bring_to(
    ground: FloatArray, built: FloatArray, spacing: float, slope: float, fading: bool
) -> FloatArray:
    """Adapts the ground to built heights, with banks around them.

    Args:
        ground: H x W, metres.
        built: H x W, metres; NaN at nodes without a built height.
        spacing: Distance between nodes, metres.
        slope: Steepest slope, metres per metre.
        fading: Whether ground beyond the banks stays unchanged.
    """
    change = built - ground
    if fading:
        most = float(np.nanmax(np.abs(change), initial=0.0))
        rises = np.hypot(np.diff(ground, axis=1)[1:], np.diff(ground, axis=0)[:, 1:])
        steep = float(np.quantile(rises, STEEP_SHARE)) / spacing
        reach = FADING + most / max(0.9 * slope - steep, slope / 5)
        change[distance_transform_edt(np.isnan(built)) * spacing > reach] = 0.0
        change[[0, -1]] = change[:, [0, -1]] = 0.0
    filled, fixed = fill_membrane(change), ~np.isnan(change)
    filled += ground
    del change
    return limit_slopes(filled, fixed, spacing, slope)


def _steepness(samples: FloatArray) -> float:
    """Returns a slope that the road rarely exceeds, metres per metre."""
    step = np.diff(samples, axis=0)
    length = np.hypot(step[:, 0], step[:, 1])
    along = (length > 0.3) & (length <= 1.0)
    return float(np.quantile(np.abs(step[along, 2]) / length[along], 0.99)) if along.any() else 0.0


def _at_the_road(outline: Outline, samples: FloatArray, extent: Extent) -> FloatArray:
    """Returns the road's heights at the nodes beside its outline, H x W; NaN elsewhere."""
    around = np.stack(np.meshgrid([-1, 0, 1, 2], [-1, 0, 1, 2]), axis=-1).reshape(-1, 1, 2)
    cells = np.unique(np.floor(samples[:, :2] / extent.spacing).astype(np.int64), axis=0)
    nodes = np.unique((cells + around).reshape(-1, 2), axis=0)
    distance, place = outline.nearest(nodes * extent.spacing, extent.spacing)
    places = nodes - extent.first
    inside = np.all((places >= 0) & (places < extent.shape[::-1]), axis=1)
    close = inside & (distance <= 0.75 * extent.spacing)
    heights = np.full(extent.shape, np.nan)
    column, row = places[close].T
    heights[row, column] = place[close, 2]
    return heights
