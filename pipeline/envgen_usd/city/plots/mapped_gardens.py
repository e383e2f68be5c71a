"""Plots of the houses of a map: what encloses them, what grows there, and the ways into them."""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from envgen_usd.city.ground_heights import Ground
from envgen_usd.city.plots.enclosed_plots import Enclosed, Gate
from envgen_usd.city.plots.plot_frame import PlotFrame
from envgen_usd.errors import Issue, Severity
from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.models.city_model import CityObject
from envgen_usd.models.landuse import OPEN_USES, Plot
from envgen_usd.models.place import Shapes

_ON_PLOT = 0.6
"""Least share of a building on the plot that it belongs to."""
_LEAST_HOUSE = 30.0
"""Least footprint of a plot's house, m²."""
_BARRIER = 1.5
"""Farthest barrier of the map from a plot that it encloses, metres."""
_ENCLOSED = 0.4
"""Length of the map's barriers on a plot, by that of its border, from which it gets no others."""
_GARDEN = 3.0
"""Farthest garden of the map from its house, metres."""
_FLATS_STOREYS, _FLATS_AREA = 4, 450.0
"""Storeys or footprint (m²) from which a house is a block of flats: no fence towards streets."""
_CLOSED = 1.5
"""Depth of a front garden below which the house closes its street, metres."""
_CLOSED_SHARE = 0.4
"""Share of a street side from which a house so near to it leaves no room for a fence."""
_ASKEW = np.sin(np.radians(12.0))
"""Sine of the largest angle of a house to its street with a generated garden."""
_DOORSTEP = 1.2
"""Highest sill of a door that a way leads to, metres above the ground."""
_BEFORE = 1.6
"""Depth of eaves, porches and steps before a door, metres."""
_APART = 1.6
"""Least distance of two ways into a plot, metres; a larger value gives fewer."""
_DRIVEWAY = 2.5
"""Width of driveways, metres."""
_WAY = 1.0
"""Width of a way to a house whose door is not at the street, metres."""


@dataclass(frozen=True, eq=False)
class MapGardens:
    """What a map has between its houses.

    Attributes:
        barriers: Lines of hedges, fences and walls.
        gardens: Gardens and parks.
        garages: Footprints of garages and carports.
    """

    barriers: Shapes
    gardens: Shapes
    garages: Shapes


@dataclass(frozen=True)
class HousePlots:
    """The plots of a map's houses.

    Attributes:
        enclosed: Plots with their houses and the ways into them.
        issues: What was decided beyond the map.
    """

    enclosed: tuple[Enclosed, ...]
    issues: tuple[Issue, ...]


def enclose_houses(  # noqa: PLR0913, PLR0917 - what plots follow from
    plots: Sequence[Plot],
    buildings: Sequence[CityObject],
    footprints: Sequence[shapely.Geometry],
    of_map: MapGardens,
    ground: Ground,
    source: str = "",
) -> HousePlots:
    """Finds the house of each plot, its doors and garages, and what the map has of its garden.

    1. The largest building that stands on a plot is its house; a plot without one is left out.
    2. None is enclosed beside barriers of the map, and not at all where these are as long as 40 %
       of its border. A garden of the map at a house is its garden: none is generated. Houses askew
       to their street get no beds and sheds, which stand square to it.
    3. Blocks of flats and houses within 1.5 m of the street along 40 % of their plot's side have no
       enclosure towards streets.
    4. A straight way leads from the street to each door and each garage that it can reach. A plot
       without any opens before the middle of its house.

    Args:
        plots: Plots of the landuse; those for other uses are left out.
        buildings: Buildings on the ground.
        footprints: Footprint of each.
        of_map: What the map has there.
        ground: Heights of the ground.
        source: Name of the map, for messages.
    """
    site = _Site(buildings, footprints, of_map, ground)
    counts: Counter[str] = Counter()
    found = []
    for plot in plots:
        if plot.landuse in OPEN_USES:
            continue
        enclosed = site.enclosed(plot, counts)
        counts["plots"] += enclosed is not None
        counts["without"] += enclosed is None
        if enclosed is not None:
            found.append(enclosed)
    return HousePlots(tuple(found), tuple(_issues(counts, source)))


class _Site:
    """The buildings of a map with what lies between them, by place."""

    def __init__(
        self,
        buildings: Sequence[CityObject],
        footprints: Sequence[shapely.Geometry],
        of_map: MapGardens,
        ground: Ground,
    ) -> None:
        self._buildings, self._ground = buildings, ground
        self._shapes: Shapes = np.array([*footprints, None], object)[:-1]
        self._tree = shapely.STRtree(self._shapes)
        self._barriers = shapely.STRtree(of_map.barriers)
        self._gardens = shapely.STRtree(of_map.gardens)
        self._garages = shapely.STRtree(of_map.garages)

    def enclosed(self, plot: Plot, counts: Counter[str]) -> Enclosed | None:
        """A plot with its house; `None` without one."""
        shape = shapely.Polygon(plot.polygon)
        near = np.sort(self._tree.query(shape, predicate="intersects"))
        shared = shapely.area(shapely.intersection(self._shapes[near], shape))
        own = near[shared >= _ON_PLOT * shapely.area(self._shapes[near])]
        if not len(own) or shapely.area(self._shapes[own]).max() < _LEAST_HOUSE:
            return None
        number = int(own[np.argmax(shapely.area(self._shapes[own]))])
        house, frame = self._shapes[number], PlotFrame.of(plot)
        barriers, length = self._barriers_at(shape)
        is_fenced = length < _ENCLOSED * shape.length
        has_garden = bool(len(self._gardens.query(house, predicate="dwithin", distance=_GARDEN)))
        storeys = self._buildings[number].attributes.get("storeysAboveGround", 1)
        is_flats = house.area >= _FLATS_AREA or float(str(storeys)) >= _FLATS_STOREYS
        open_front = is_flats or _is_closed(plot, house, frame)
        counts["barriers"] += not is_fenced
        counts["gardens"] += has_garden
        counts["open"] += open_front and is_fenced
        gates = self._gates(plot, frame, house, shape, own)
        is_planted = not has_garden and not _is_askew(house, frame)
        return Enclosed(
            plot,
            house,
            gates,
            open_front=open_front,
            is_planted=is_planted,
            is_fenced=is_fenced,
            beside_barriers=shapely.buffer(barriers, _BARRIER, quad_segs=2),
        )

    def _barriers_at(self, shape: shapely.Polygon) -> tuple[shapely.Geometry, float]:
        """The map's barriers on a plot and beside it, and their length in metres."""
        near = self._barriers.query(shape, predicate="dwithin", distance=_BARRIER)
        beside = shapely.buffer(shape, _BARRIER)
        lines = shapely.union_all(shapely.intersection(self._barriers.geometries[near], beside))
        return lines, float(shapely.length(lines))

    def _gates(
        self,
        plot: Plot,
        frame: PlotFrame,
        house: shapely.Geometry,
        shape: shapely.Polygon,
        own: IntArray,
    ) -> tuple[Gate, ...]:
        """Doors and garages of a plot that a straight way from the street reaches; see rule 4."""
        width = float(np.hypot(*(plot.frontage[1] - plot.frontage[0])))
        # Garages first: of two ways side by side, the driveway remains.
        places = [*self._garage_fronts(frame, shape), *self._doors(own)]
        if plot.access is not None:
            places.insert(0, (plot.access, _DRIVEWAY))
        gates: list[Gate] = []
        for place, wide in places:
            at = float(frame.inside(place[None])[0, 0])
            gate = Gate(place, frame.place(at, 0.0), wide)
            is_apart = all(np.hypot(*(gate.foot - other.foot)) >= _APART for other in gates)
            if 0.0 < at < width and is_apart and self._is_reached(gate):
                gates.append(gate)
        return tuple(gates) or (self._before(house, frame, width),)

    def _is_reached(self, gate: Gate) -> bool:
        """True if no building stands between a door and the street, but for eaves and steps."""
        way = shapely.LineString([gate.place, gate.foot])
        near = self._tree.query(way, predicate="intersects")
        hidden = shapely.length(shapely.intersection(self._shapes[near], way))
        return bool(hidden.max(initial=0.0) <= _BEFORE)

    def _before(self, house: shapely.Geometry, frame: PlotFrame, width: float) -> Gate:
        """The way to the middle of a house without a door at the street."""
        middle = np.array(house.centroid.coords[0])
        along = float(np.clip(frame.inside(middle[None])[0, 0], min(_WAY, width / 2.0), width))
        foot = frame.place(along, 0.0)
        wall = shapely.intersection(shapely.LineString([foot, middle]), house)
        ends = shapely.get_coordinates(wall)
        gate = Gate(ends[np.argmin(frame.inside(ends)[:, 1])] if len(ends) else foot, foot, _WAY)
        return gate if self._is_reached(gate) else Gate(foot, foot, _WAY)

    def _doors(self, own: IntArray) -> Iterator[tuple[FloatArray, float]]:
        """Middles (2) and widths of the doors at the ground."""
        for number in own.tolist():
            for part in self._buildings[number].walk():
                for surface in part.surfaces:
                    for opening in surface.openings:
                        if opening.kind == "DoorSurface":
                            yield from self._door(opening.polygons.points)

    def _door(self, points: FloatArray) -> Iterator[tuple[FloatArray, float]]:
        low, high = points[:, :2].min(axis=0), points[:, :2].max(axis=0)
        middle = (low + high) / 2.0
        sill = float(points[:, 2].min() - self._ground.heights(middle[None])[0])
        if sill <= _DOORSTEP:
            yield middle, float(np.hypot(*(high - low)))

    def _garage_fronts(
        self, frame: PlotFrame, shape: shapely.Polygon
    ) -> Iterator[tuple[FloatArray, float]]:
        """Middles (2) of the garages' sides towards the street, and widths of their gates."""
        for number in np.sort(self._garages.query(shape, predicate="intersects")).tolist():
            garage = self._garages.geometries[number]
            if not shape.contains(garage.centroid):
                continue
            corners = shapely.get_coordinates(shapely.oriented_envelope(garage))[:4]
            sides = np.stack([corners, np.roll(corners, -1, axis=0)], axis=1)
            middles = sides.mean(axis=1)
            front = int(np.argmin(frame.inside(middles)[:, 1]))
            wide = float(np.hypot(*(sides[front, 1] - sides[front, 0])))
            yield middles[front], min(wide, _DRIVEWAY)


def _is_closed(plot: Plot, house: shapely.Geometry, frame: PlotFrame) -> bool:
    """True where a house leaves no front garden along much of its plot's street side."""
    width = float(np.hypot(*(plot.frontage[1] - plot.frontage[0])))
    before = shapely.box(0.0, -_CLOSED, width, _CLOSED)
    beside = shapely.intersection(shapely.transform(house, frame.inside), before)
    west, _, east, _ = shapely.bounds(beside).tolist()
    return bool(not beside.is_empty and east - west >= _CLOSED_SHARE * width)


def _is_askew(house: shapely.Geometry, frame: PlotFrame) -> bool:
    """True for a house whose walls are not parallel to its street."""
    corners = shapely.get_coordinates(shapely.oriented_envelope(house))[:4]
    sides = np.diff(corners, axis=0)[:2]
    side = sides[np.argmax(np.hypot(*sides.T))]
    turned = np.abs(side @ np.stack([frame.along, frame.into], axis=1)) / np.hypot(*side)
    return bool(turned.min() > _ASKEW)


def _issues(counts: Counter[str], source: str) -> Iterator[Issue]:
    if counts["plots"]:
        text = f"{counts['plots']} houses have plots that the map does not have"
        said = (
            ("open", "open towards streets, as blocks of flats and houses at the sidewalk are"),
            ("barriers", "enclosed by the map's barriers alone"),
            ("gardens", "with the map's gardens alone"),
        )
        text += "".join(f"; {counts[name]} are {what}" for name, what in said if counts[name])
        yield Issue("osm.plot", Severity.INFO, source, text, "gardens and enclosures generated")
    if counts["without"]:
        text = f"{counts['without']} plots hold no house: it stands on other land, or was left out"
        yield Issue("osm.plot_empty", Severity.INFO, source, text, "left out")
