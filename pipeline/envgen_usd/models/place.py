"""A real or generated place in plan: buildings, streets, and what stands between them."""

from dataclasses import dataclass, field, replace

import numpy as np
import shapely
from numpy.typing import NDArray

from envgen_usd.errors import Issue
from envgen_usd.models.array_types import BoolArray, FloatArray, IntArray
from envgen_usd.models.frozen_model import Model

Shapes = NDArray[np.object_]
"""Array of shapely geometries."""
Words = NDArray[np.str_]


EDGE = 50.0
"""Land around the buildings of a place whose streets belong to it, metres."""


@dataclass(frozen=True, repr=False, eq=False)
class Houses(Model):
    """Buildings.

    Attributes:
        footprints: B polygons, metres.
        heights: B, metres from the ground to the top; NaN where unknown.
        storeys: B, storeys from the underside up to the roof; NaN where unknown.
        kinds: B, value of the tag ``building``, or the CityGML function; empty where unknown.
        landuse: B, ``residential``, ``industrial``, or empty for others and unknown ones.
        roofs: B, roof shape as in `building_rules.Roof`; empty where unknown.
        walls: B, family of the facade's material, e.g. ``brick``; empty where unknown.
        roofing: B, family of the roof's material; empty where unknown.
        bottoms: B, metres from the ground to the underside; 0 for what stands on it. Empty: all do.
        roof_heights: B, metres from the eaves to the top; NaN where unknown. Empty: all unknown.
        groups: B, equal for the bodies of a building of several; -1 for all others. Empty: no
            building has several.
    """

    footprints: Shapes
    heights: FloatArray
    storeys: FloatArray
    kinds: Words
    landuse: Words
    roofs: Words
    walls: Words
    roofing: Words
    bottoms: FloatArray = field(default_factory=lambda: np.empty(0))
    roof_heights: FloatArray = field(default_factory=lambda: np.empty(0))
    groups: IntArray = field(default_factory=lambda: np.empty(0, int))

    def __post_init__(self) -> None:
        """Completes figures that were left empty, and makes the arrays read-only."""
        for name, value in (("bottoms", 0.0), ("roof_heights", np.nan), ("groups", -1)):
            if len(getattr(self, name)) != len(self.footprints):
                object.__setattr__(self, name, np.full(len(self.footprints), value))
        super().__post_init__()

    def __len__(self) -> int:
        """Number of buildings."""
        return len(self.footprints)

    def vertical_range(self) -> FloatArray:
        """Underside and top of each above the ground, B x 2, metres; unknown tops are infinite."""
        tops = np.where(np.isfinite(self.heights), self.heights, np.inf)
        return np.column_stack([self.bottoms, tops])

    def take(self, chosen: BoolArray | IntArray) -> "Houses":
        """The chosen buildings."""
        return Houses(**{name: value[chosen] for name, value in vars(self).items()})

    def joined(self, others: "Houses") -> "Houses":
        """These buildings and others."""
        return Houses(**{n: np.concatenate([v, getattr(others, n)]) for n, v in vars(self).items()})


@dataclass(frozen=True, repr=False, eq=False)
class BuildingParts(Model):
    """Parts of buildings of a map (wiki.openstreetmap.org/wiki/Simple_3D_Buildings).

    Attributes:
        bodies: The parts, with the figures of their building where their own tags say nothing.
        outlines: P, number of the building that each belongs to; -1 without any.
    """

    bodies: Houses
    outlines: IntArray

    def __len__(self) -> int:
        """Number of parts."""
        return len(self.outlines)


@dataclass(frozen=True, repr=False, eq=False)
class Streets(Model):
    """Streets with access to plots.

    Attributes:
        lines: S lines along their middle, metres.
        widths: S, width of the carriageway, metres.
        tagged: S, true where the width was stated and not derived from the kind of street.
        lanes: S, number of lanes; NaN where unknown.
        sidewalks: S, width of a sidewalk, metres; NaN where unknown.
    """

    lines: Shapes
    widths: FloatArray
    tagged: BoolArray
    lanes: FloatArray
    sidewalks: FloatArray

    def __len__(self) -> int:
        """Number of streets."""
        return len(self.lines)

    def within(self, area: shapely.Geometry) -> "Streets":
        """The streets' parts in an area."""
        cut = shapely.intersection(self.lines, area)
        parts, of = shapely.get_parts(cut, return_index=True)
        is_line = shapely.length(parts) > 0.0
        rest = {name: value[of[is_line]] for name, value in vars(self).items() if name != "lines"}
        return Streets(parts[is_line], **rest)


@dataclass(frozen=True, repr=False, eq=False)
class Place(Model):
    """Buildings and streets of a place, in metres of a plan.

    Attributes:
        source: Name of the file, for messages.
        houses: Buildings.
        streets: Streets.
        trees: T x 2, trees, metres.
        lamps: L x 2, street lights, metres.
        barriers: Lines of hedges, fences and walls.
        barrier_kinds: Kind of each: ``hedge``, ``fence`` or ``wall``.
        crs: Coordinate reference system, as a PROJ string or WKT; empty where unknown.
        issues: What was left out or guessed.
        shops: S x 2, shops, cafés and others with a shop front, metres.
        parts: Parts of the buildings; `None` without any, and for a part of the place.
    """

    source: str
    houses: Houses
    streets: Streets
    trees: FloatArray
    lamps: FloatArray
    barriers: Shapes
    barrier_kinds: Words
    crs: str = ""
    issues: tuple[Issue, ...] = ()
    shops: FloatArray = field(default_factory=lambda: np.empty((0, 2)))
    parts: BuildingParts | None = None

    def bounds(self) -> tuple[float, float, float, float]:
        """West, south, east and north end of the buildings, metres."""
        low_x, low_y, high_x, high_y = shapely.total_bounds(self.houses.footprints).tolist()
        return low_x, low_y, high_x, high_y

    def within(self, bounds: tuple[float, float, float, float]) -> "Place":
        """The part of the place in a box; buildings belong where their centroid lies."""
        box = shapely.box(*bounds)
        x, y = shapely.get_coordinates(shapely.centroid(self.houses.footprints)).T
        inside = (x >= bounds[0]) & (x < bounds[2]) & (y >= bounds[1]) & (y < bounds[3])
        reached = shapely.intersects(box, self.barriers)
        return replace(
            self,
            houses=self.houses.take(inside),
            streets=self.streets.within(box),
            trees=self.trees[shapely.contains_xy(box, *self.trees.T)],
            lamps=self.lamps[shapely.contains_xy(box, *self.lamps.T)],
            shops=self.shops[shapely.contains_xy(box, *self.shops.T)],
            barriers=self.barriers[reached],
            barrier_kinds=self.barrier_kinds[reached],
            parts=None,
        )

    def halves(self) -> tuple["Place", "Place"]:
        """The western and the eastern half, cut in the middle of the buildings' extent."""
        west, south, east, north = self.bounds()
        middle = (west + east) / 2.0
        west, south, east, north = west - EDGE, south - EDGE, east + EDGE, north + EDGE
        return self.within((west, south, middle, north)), self.within((middle, south, east, north))
