"""Blocks that could not be filled, and why."""

from collections import defaultdict
from collections.abc import Sequence

import numpy as np
import shapely

from envgen_usd.errors import Issue, Severity
from envgen_usd.landuse.blocks.land_areas import opened
from envgen_usd.landuse.roadside import Roadside
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.land_rules import PlotRules
from envgen_usd.models.landuse import Plot
from envgen_usd.models.road_surface import RoadSurface

LEAST_BLOCK = 750.0
"""Least area of a block that is expected to hold plots, m²: roundabouts' islands are smaller."""
LEAST_SHARE = 0.5
"""Share of a block in plots below which it counts as empty."""
STEEPEST = 0.25
"""Steepest slope of the roads around a block that holds more than plots at the street.

Metres per metre; a larger value lays out steeper blocks, whose plots need higher banks.
"""
_BESIDE = 3.0
"""Largest distance of a block from a roadside that opens onto it, beyond the verge, metres."""


def slope_of(loop: FloatArray) -> float:
    """Slope of the plane that fits the roads around a block best, metres per metre.

    Args:
        loop: N x 3, the outline of the block, metres.
    """
    middle = loop.mean(axis=0)
    plane, *_ = np.linalg.lstsq(loop[:, :2] - middle[:2], loop[:, 2] - middle[2], rcond=None)
    return float(np.hypot(*plane))


def find_empty_blocks(
    surface: RoadSurface, roadsides: Sequence[Roadside], plots: Sequence[Plot], rules: PlotRules
) -> tuple[Issue, ...]:
    """Returns an issue for each reason why blocks hold few plots, with the place of the first.

    1. No street beside the block gives access, as beside motorways.
    2. The block is narrower than half of a plot's depth between its verges.
    3. The roads around it are too steep (`STEEPEST`).
    4. Its shape leaves no room for plots.

    Args:
        surface: The whole road.
        roadsides: Roadsides of the whole map.
        plots: Plots of the whole map.
        rules: Sizes of plots.
    """
    shapes = np.array([shapely.Polygon(plot.polygon) for plot in plots], object)
    tree = shapely.STRtree(shapes)
    fronts = [
        shapely.buffer(shapely.linestrings(side.points), rules.verge[1] + _BESIDE)
        for side in roadsides
        if side.open
    ]
    access = shapely.STRtree(fronts)
    found: defaultdict[str, list[shapely.Point]] = defaultdict(list)
    for loop in surface.outline_loops():
        face = shapely.Polygon(loop[:, :2])
        if face.exterior.is_ccw or face.area < LEAST_BLOCK:
            continue
        block = shapely.make_valid(face)
        inside = shapes[tree.query(block, "intersects")]
        covered = shapely.area(shapely.intersection(block, inside)).sum()
        if covered < LEAST_SHARE * block.area:
            has_street = len(access.query(block, "intersects")) > 0
            reason = _reason(block, loop, rules, has_street=has_street)
            found[reason].append(block.representative_point())
    return tuple(
        Issue(
            "landuse.empty_block",
            Severity.INFO,
            f"block[{places[0].x:.0f} {places[0].y:.0f}]",
            f"{len(places)} blocks hold few plots: {reason}",
            "their land stays green",
        )
        for reason, places in sorted(found.items())
    )


def _reason(
    block: shapely.Geometry, loop: FloatArray, rules: PlotRules, *, has_street: bool
) -> str:
    width = rules.depth[0] / 2.0
    if not has_street:
        return "no street beside them gives access"
    if opened(shapely.buffer(block, -rules.verge[1]), width).is_empty:
        return f"they are narrower than {width:.0f} m between their verges"
    if slope_of(loop) > STEEPEST:
        return f"the roads around them rise by more than {STEEPEST:.0%}"
    return "their shape leaves no room for plots"
