"""Plots inside of blocks: rows of houses at lanes, courts, car parks, parks and allotments."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import shapely

from envgen_usd.landuse.blocks.inner_lanes import (
    LANE,
    Entries,
    Entry,
    Frame,
    Row,
    connected_lanes,
    least_row,
    rows_of,
)
from envgen_usd.landuse.blocks.laid_plot import LEAST_USE, LaidPlot, drawn_use, way_into
from envgen_usd.landuse.blocks.land_areas import common, largest, opened, union, without
from envgen_usd.landuse.blocks.street_land import StreetLand, inside_of
from envgen_usd.landuse.plot_rectangles import holds_rectangle, least_rectangle
from envgen_usd.landuse.plot_sites import Sites
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.distribution import mean_of
from envgen_usd.models.land_rules import BlockRules, PlotRules
from envgen_usd.models.landuse import LanduseClass
from envgen_usd.seeds import Draws

BAND = 0.8
"""Distance of inner land from streets, in least depths of the rules' plots."""
LEAST_LAND = 250.0
"""Least area of inner land with plots of its own, m²; smaller land goes to the plots around it."""
LEAST_FRONT = 4.0
"""Least length in metres of a plot's side at its lane."""
LONGEST = 70.0
"""Largest length of a whole plot with a use, metres; longer rows are divided."""
JITTER = 0.12
"""Largest shift of the border between two plots, as a share of their mean width."""
_JOINT = 0.1
"""Distance from a lane within which a plot lies at it, metres."""


@dataclass(frozen=True)
class Inner:
    """Plots and lanes inside of all blocks.

    Attributes:
        plots: Inner plots.
        lanes: Lanes, from the streets to the plots; they cut the plots at the street.
    """

    plots: list[LaidPlot]
    lanes: list[shapely.Geometry]


def inner_plots(  # noqa: PLR0913, PLR0917 - what inner plots follow from
    sites: Sites,
    shapes: Sequence[shapely.Polygon],
    streets: StreetLand,
    rules: PlotRules,
    blocks: BlockRules,
    seed: int,
) -> Inner:
    """Lays out the land that plots at the street leave inside of blocks.

    1. A lane leads into it from a street, where plots lose the least.
    2. Lanes run along its longer side, and rows of plots along both of their sides (`rows_of`).
    3. A row holds houses with a share of `BlockRules.inner`; others are whole plots with a use.
    4. Land that is too narrow for a row becomes a court: a whole plot with a use.

    Args:
        sites: Sites of the plots at the street.
        shapes: All plots at the street, with the land that they were given.
        streets: Streets of the map.
        rules: Sizes of plots.
        blocks: Shares and uses.
        seed: The user's seed.
    """
    lanes = union(shapely.polygons(sites.lanes()))
    behind = without(streets.land, streets.first_row(BAND * rules.depth[0]))
    free = opened(without(without(behind, union(shapes)), lanes))
    entries = Entries(sites, shapes)
    inner = Inner([], [])
    faces = shapely.STRtree(streets.blocks)
    row = least_row(rules)
    broad = opened(free, row)
    narrow = opened(without(free, shapely.buffer(broad, row / 2.0)))
    for land in (*inside_of(streets.blocks, broad), *inside_of(streets.blocks, narrow)):
        face = faces.query(land.representative_point(), "within")
        if land.area < LEAST_LAND or not len(face):
            continue
        found = entries.into(land, streets.blocks[face[0]])
        if not found:
            continue
        x, y = shapely.get_coordinates(shapely.centroid(land))[0]
        draws = Draws(seed, "landuse", "inner", f"{x:.0f} {y:.0f}")
        share = blocks.inner * streets.density(np.array([x, y]), blocks.falloff)
        entries.use(_lay_out(land, found, rules, (share, blocks), draws, inner))
    return inner


def _lay_out(  # noqa: PLR0913, PLR0917 - what a piece of land follows from
    land: shapely.Polygon,
    entries: Sequence[Entry],
    rules: PlotRules,
    shares: tuple[float, BlockRules],
    draws: Draws,
    inner: Inner,
) -> Entry:
    """Adds the plots and lanes of a piece of inner land; returns the entry that leads to them."""
    frame = Frame.of(land)
    local = frame.to_local(land)
    for entry in entries:
        place = np.stack([entry.place, entry.direction]) @ frame.axes.T
        rows, lanes = rows_of(local, place[0], rules)
        way = frame.to_local(entry.shape)
        lane = connected_lanes(local, lanes, place, way)
        if lane.area > way.area + LANE**2:
            break
    else:
        entry = entries[0]
        inner.lanes.append(entry.shape)
        inner.plots.append(_court(land, entry, shares[1], draws))
        return entry
    inner.lanes.append(frame.to_map(lane))
    rest = without(local, lane)
    seed = draws.whole("rows", (0, 2**30))
    for number, row in enumerate(rows):
        u0, _, u1, _ = local.bounds
        strip = common(rest, shapely.box(u0 - 1.0, row.low, u1 + 1.0, row.high))
        for part, run in enumerate(shapely.get_parts(opened(strip))):
            named = Draws(seed, number, part)
            for piece, kind in _pieces(run, row, rules, shares, named):
                front = _front(piece, row, lane)
                if front is not None:
                    way = way_into(front, 0.0) @ frame.axes
                    inner.plots.append(LaidPlot(frame.to_map(piece), kind, way))
    return entry


def _court(land: shapely.Polygon, entry: Entry, blocks: BlockRules, draws: Draws) -> LaidPlot:
    """Land as a whole plot at the end of a lane."""
    along = np.array([entry.direction[1], -entry.direction[0]])
    way = way_into(entry.place + np.array([[-1.0], [1.0]]) * along, 0.0)
    shape = largest(without(land, entry.shape))
    return LaidPlot(shape, drawn_use(blocks.uses, shape.area, "use", draws, at_street=False), way)


def _pieces(
    run: shapely.Polygon,
    row: Row,
    rules: PlotRules,
    shares: tuple[float, BlockRules],
    draws: Draws,
) -> Iterator[tuple[shapely.Polygon, LanduseClass]]:
    """A run of a row as plots with the class of their ground."""
    houses, blocks = shares
    u0, _, u1, _ = run.bounds
    is_built = draws.happens("houses", houses)
    if is_built:
        width, kind = mean_of(rules.frontage), rules.landuse
    else:
        area = run.area / (int((u1 - u0) / LONGEST) + 1)
        width = LONGEST
        kind = drawn_use(blocks.uses, area, "use", draws, at_street=False)
    count = max(1, round((u1 - u0) / width)) if is_built else int((u1 - u0) / width) + 1
    stops = np.linspace(u0, u1, count + 1)
    shifts = [draws.within(f"border {n}", (-JITTER, JITTER)) for n in range(count - 1)]
    stops[1:-1] += np.array(shifts) * (u1 - u0) / count
    for left, right in pairwise(stops.tolist()):
        piece = largest(common(run, shapely.box(left, row.low - 1.0, right, row.high + 1.0)))
        if _holds_house(piece, rules) if is_built else piece.area >= LEAST_USE:
            yield piece, kind


def _holds_house(piece: shapely.Polygon, rules: PlotRules) -> bool:
    """True if a piece of a row, in its frame, holds the least plot with a house."""
    corners = shapely.get_coordinates(piece.exterior)[:-1]
    along = np.array([1.0, 0.0])
    return len(corners) > 2 and holds_rectangle(corners, along, least_rectangle(rules))


def _front(piece: shapely.Polygon, row: Row, lane: shapely.Polygon) -> FloatArray | None:
    """The side of a plot at its lane, 2 x 2, in the direction of a counter-clockwise border."""
    inwards = _JOINT if row.lane_below else -_JOINT
    u0, _, u1, _ = piece.bounds
    line = shapely.LineString([(u0 - 1.0, row.front + inwards), (u1 + 1.0, row.front + inwards)])
    on = shapely.intersection(line, piece)
    at_lane = shapely.intersection(on, shapely.buffer(lane, 2.0 * _JOINT))
    parts = [part for part in shapely.get_parts(at_lane) if part.length >= LEAST_FRONT]
    if not parts:
        return None
    left, _, right, _ = max(parts, key=shapely.length).bounds
    ends = (left, right) if row.lane_below else (right, left)
    return np.array([[end, row.front] for end in ends])
