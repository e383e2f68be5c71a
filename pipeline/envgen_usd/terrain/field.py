"""Height of the ground as a function of the place alone, fitted once to the road."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import distance_transform_edt

from envgen_usd.geometry.outline import Outline
from envgen_usd.models.arrays import FloatArray
from envgen_usd.models.ground import Heights
from envgen_usd.models.landuse import Plot
from envgen_usd.models.profile import TerrainRules
from envgen_usd.models.surface import RoadSurface
from envgen_usd.terrain.land import guess_land, heights_on_grid
from envgen_usd.terrain.lattice import Extent, Lattice, extent_around
from envgen_usd.terrain.membrane import fill_membrane
from envgen_usd.terrain.pads import level_plots
from envgen_usd.terrain.slopes import limit_slopes

MARGIN = 40.0
"""Metres of lattice beyond the road."""
HILLS_MARGIN = 300.0
"""The same where there are hills or a real terrain: on all chunks beside the road their slopes are
to be limited, or banks have to come up to them."""
EXACT = 1.5e-3
"""Metres; smaller differences come from the grid of coordinates."""
BANK_SHARE = 0.7
"""Share of the steepest slope that the lattice may use; the rest is for the correction that makes
the ground meet the road exactly."""
FADING = 15.0
"""Metres from the road beyond which a real terrain is left alone, more where banks need it."""
STEEP_SHARE = 0.9
"""Share of the land that is less steep than what banks have to reckon with to come up to it."""
MISMATCH_REACH = 4.0
"""Steps of the lattice over which its mismatch at the road fades."""


@dataclass(frozen=True)
class TerrainField:
    """Ground height everywhere.

    Attributes:
        outline: Where the ground meets the road.
        base: Heights without regard to the road: its trend with hills, or a real terrain.
        correction: What is added so that the ground comes up or down to the road; none where
            the base meets it already.
    """

    outline: Outline
    base: Heights
    correction: Lattice | None

    def __call__(self, points: FloatArray) -> FloatArray:
        """Heights at places (N x 2), metres."""
        return self._corrected(points, self.base(points))

    def on_grid(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Heights at the places of a grid, len(y) x len(x), metres."""
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
        """What the lattice misses at the nearest place of the road, fading with distance."""
        reach = MISMATCH_REACH * correction.extent.spacing
        distance, place = self.outline.nearest(points, reach)
        near = distance < reach
        foot, share = place[near], 1 - distance[near] / reach
        result = np.zeros(len(points))
        missing = foot[:, 2] - self.base(foot) - correction(foot)
        result[near] = missing * share * share * (3 - 2 * share)
        return result


def fit_terrain(
    surface: RoadSurface,
    rules: TerrainRules,
    seed: int,
    base: Heights | None = None,
    plots: Sequence[Plot] = (),
) -> TerrainField:
    """Fits the ground to the road's outline and to plots.

    1. The base is given (a real terrain), or it is the plane through the road, as far as the road
       spreads enough to tell one, with seeded hills.
    2. What the base misses at the outline is interpolated between roads by a membrane; so hills
       grow with the distance from the road.
    3. The sum rises nowhere faster than the bank slope.
    4. On land that is not the road's own plane, plots become planes with banks around them.

    Args:
        surface: Road; only its outline and, for hills, its windings count.
        rules: Relief and slopes.
        seed: The user's seed.
        base: Heights to start from.
        plots: Of the whole map.
    """
    outline = Outline.of(surface)
    land = base or guess_land(surface, rules, seed)
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
    extent = extent_around(np.concatenate(corners), margin)
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
    """Brings ground to what is built, with banks around it.

    Args:
        ground: H x W, metres.
        built: H x W, metres; NaN where nothing is built.
        spacing: Distance between nodes, metres.
        slope: Steepest slope, metres a metre.
        fading: Whether ground beyond the banks stays as it is.
    """
    change = built - ground
    if fading:
        most = float(np.nanmax(np.abs(change), initial=0.0))
        rises = np.hypot(np.diff(ground, axis=1)[1:], np.diff(ground, axis=0)[:, 1:])
        steep = float(np.quantile(rises, STEEP_SHARE)) / spacing
        reach = FADING + most / max(0.9 * slope - steep, slope / 5)
        change[distance_transform_edt(np.isnan(built)) * spacing > reach] = 0.0
        change[[0, -1]] = change[:, [0, -1]] = 0.0
    filled = ground + fill_membrane(change)
    return limit_slopes(filled, ~np.isnan(change), spacing, slope)


def _steepness(samples: FloatArray) -> float:
    """Slope that the road itself hardly ever exceeds, metres a metre."""
    step = np.diff(samples, axis=0)
    length = np.hypot(step[:, 0], step[:, 1])
    along = (length > 0.3) & (length <= 1.0)
    return float(np.quantile(np.abs(step[along, 2]) / length[along], 0.99)) if along.any() else 0.0


def _at_the_road(outline: Outline, samples: FloatArray, extent: Extent) -> FloatArray:
    """Heights of the road at the nodes beside its outline, H x W; NaN elsewhere."""
    around = np.stack(np.meshgrid([-1, 0, 1, 2], [-1, 0, 1, 2]), axis=-1).reshape(-1, 1, 2)
    cells = np.unique(np.floor(samples[:, :2] / extent.spacing).astype(np.int64), axis=0)
    nodes = np.unique((cells + around).reshape(-1, 2), axis=0)
    distance, place = outline.nearest(nodes * extent.spacing, extent.spacing)
    close = distance <= 0.75 * extent.spacing
    heights = np.full(extent.shape, np.nan)
    column, row = (nodes[close] - extent.first).T
    heights[row, column] = place[close, 2]
    return heights
