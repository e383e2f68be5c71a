"""Town squares: trees in pits, lamps, benches and planters around what stands in the middle."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import shapely

from envgen_usd.chunks import snap
from envgen_usd.city.city_scene import Scene
from envgen_usd.city.headings import heading_of
from envgen_usd.city.plots.given_buildings import chunk_of
from envgen_usd.city.plots.largest_rectangle import largest_rectangle
from envgen_usd.city.plots.plot_frame import PlotFrame, is_unoccupied, rectangle_at, widened
from envgen_usd.city.plots.street_furniture import FUNCTIONS as AT_STREETS
from envgen_usd.city.plots.street_lights import FUNCTION as LIGHT_FUNCTION
from envgen_usd.city.plots.street_trees import KIND as TREE
from envgen_usd.city.plots.trees import TRUNK, tree_feature
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.city_model import AVENUE, CityObject, Placement
from envgen_usd.models.environment_profile import Profile
from envgen_usd.models.land_rules import Centre
from envgen_usd.models.landuse import LanduseClass, Plot
from envgen_usd.seeds import Draws

FUNCTIONS = {
    "fountain": "1500",
    "monument": "1450",
    "planter": "1540",
    "tree_pit": "1540",
    "street_light": LIGHT_FUNCTION,
    **{kind: AT_STREETS[kind] for kind in ("bench", "bollard")},
}
"""Code of the SIG3D list CityFurniture_function of each template."""
_LEAST = 8.0
"""Least length and width of a square with furniture, metres."""
_CLEARANCE = 0.3
"""Least distance between objects of a square, metres; a larger value leaves out more."""
_MIDDLE = 5.0
"""Least free width around what stands in the middle, metres."""
_SPREAD = (0.88, 1.0 / 0.88)
"""Range of the trees of a square around their mean."""


@dataclass(frozen=True)
class _Item:
    """A kind of object of a square: template, its extent along x and y, metres."""

    template: str
    extent: tuple[float, float]


_CENTRES = {"fountain": _Item("fountain", (5.2, 5.2)), "monument": _Item("monument", (4.0, 4.0))}
_TREE = _Item(TREE, (1.7, 1.7))
_LAMP = _Item("street_light", (0.4, 0.4))
_BENCH = _Item("bench", (0.8, 2.0))
_PLANTER = _Item("planter", (1.4, 1.4))
_BOLLARD = _Item("bollard", (0.3, 0.3))
_INSETS = {TREE: 4.0, "street_light": 1.6, "bench": 6.0, "planter": 1.8, "bollard": 0.5}
"""Distance of each kind from the border of the square, metres."""


@dataclass(frozen=True)
class _Spot:
    """A place for an object: the kind, a point (2) and the direction (2) that it faces."""

    item: _Item
    place: FloatArray
    facing: FloatArray


def place_squares(
    scene: Scene, plots: Sequence[Plot], profile: Profile, standing: Sequence[CityObject] | None
) -> tuple[CityObject, ...]:
    """Returns what stands on the squares of a chunk.

    1. A fountain or a monument stands in the middle.
    2. Trees in pits, lamps and benches surround it; benches face the middle.
    3. Planters and bollards stand at the street.

    A square of a map keeps its middle as it is, and gets no kind that the map has there.

    Args:
        scene: Scene of the chunk.
        plots: Plots in and around the chunk.
        profile: The environment; `Profile.squares` gives the distances.
        standing: What stands there on a map; `None` without a map.
    """
    placed: list[CityObject] = []
    for plot in plots:
        shape = shapely.Polygon(plot.polygon)
        if plot.landuse == LanduseClass.SQUARE and chunk_of(shape) == scene.chunk:
            kinds = None if standing is None else _kinds(shape, standing)
            placed += _of_square(plot, scene, profile, kinds)
    return tuple(placed)


def _kinds(shape: shapely.Polygon, standing: Sequence[CityObject]) -> frozenset[str]:
    """Templates of what stands on a square; trees of a map count as those of a square."""
    placements = [each.placement for each in standing if each.placement is not None]
    if not placements:
        return frozenset()
    points = np.array([placement.position[:2] for placement in placements])
    inside = shapely.contains_xy(shape, points)
    found = {placements[n].template for n in np.flatnonzero(inside).tolist()}
    return frozenset(found | ({TREE} if "tree" in found else set()))


def _of_square(
    plot: Plot, scene: Scene, profile: Profile, kinds: frozenset[str] | None
) -> Iterator[CityObject]:
    draws = Draws(scene.seed, "city", "square", plot.id)
    maker = _Maker(plot, scene, profile, draws)
    for spot in _spots(plot, profile, draws, has_centre=kinds is None):
        if spot.item.template not in (kinds or ()) and maker.is_free(spot):
            yield from maker.objects(spot)


def _spots(plot: Plot, profile: Profile, draws: Draws, *, has_centre: bool) -> Iterator[_Spot]:
    """Places by precedence: what comes first keeps its place."""
    frame, rules = PlotFrame.of(plot), profile.squares
    ground = _Ground(frame, largest_rectangle(frame.inside(plot.polygon)))
    if min(ground.size) < _LEAST:
        return
    centres: Mapping[Centre, float] = rules.centres or {"none": 1.0}
    centre = draws.choice("centre", centres)
    room = 2.0 * _INSETS["bench"] + _MIDDLE
    if has_centre and centre in _CENTRES and min(ground.size) >= room:
        yield ground.middle(_CENTRES[centre])
    around, at_street = ("back", "left", "right"), ("front",)
    yield from ground.along(_TREE, rules.trees, around)
    yield from ground.along(_LAMP, rules.lamps, (*at_street, *around))
    yield from ground.along(_PLANTER, rules.planters, at_street)
    yield from ground.along(_BENCH, rules.benches, around)
    yield from ground.along(_BOLLARD, rules.bollards, at_street)


@dataclass(frozen=True)
class _Ground:
    """The largest rectangle of a square in the frame of its street side.

    Attributes:
        frame: Axes of the plot.
        box: Least distance along and behind the front, and the largest ones, metres.
    """

    frame: PlotFrame
    box: tuple[float, float, float, float]

    @property
    def size(self) -> tuple[float, float]:
        """Extent along the street and away from it, metres."""
        left, front, right, back = self.box
        return right - left, back - front

    def middle(self, item: _Item) -> _Spot:
        """The spot in the middle; the front faces the street."""
        left, front, right, back = self.box
        place = self.frame.place((left + right) / 2.0, (front + back) / 2.0)
        return _Spot(item, place, -self.frame.into)

    def along(self, item: _Item, apart: float, sides: Sequence[str]) -> Iterator[_Spot]:
        """Spots along sides, at even distances; they face the middle.

        Args:
            item: Kind of object.
            apart: Distance of the spots, metres, or a little more; 0 for none.
            sides: Names of the sides: front, right, back and left.
        """
        inset = _INSETS[item.template]
        left, front, right, back = self.box
        left, front, right, back = left + inset, front + inset, right - inset, back - inset
        if apart <= 0.0 or left >= right or front >= back:
            return
        ends = {
            "front": ((left, front), (right, front), self.frame.into),
            "right": ((right, front), (right, back), -self.frame.along),
            "back": ((right, back), (left, back), -self.frame.into),
            "left": ((left, back), (left, front), self.frame.along),
        }
        for side in sides:
            start, end, facing = ends[side]
            a, b = np.array(start), np.array(end)
            count = max(int(np.hypot(*(b - a)) / apart), 1)
            for share in ((np.arange(count) + 0.5) / count).tolist():
                yield _Spot(item, self.frame.place(*(a + share * (b - a)).tolist()), facing)


@dataclass
class _Maker:
    """Makes the objects of a square, and remembers where they stand."""

    plot: Plot
    scene: Scene
    profile: Profile
    draws: Draws
    beside: list[shapely.Polygon] = field(default_factory=list)

    def __post_init__(self) -> None:
        """Draws what the trees and lamps of a square have in common."""
        self._shape = shapely.Polygon(self.plot.polygon)
        trees, lights = self.profile.street_trees, self.profile.street_lights
        self._tall = self.draws.within("height", trees.height)
        self._crown = self.draws.within("crown", trees.crown)
        self._mast = round(self.draws.within("mast", lights.height), 2)

    def is_free(self, spot: _Spot) -> bool:
        """True for a spot on the square that touches neither roads nor objects."""
        shape = rectangle_at(spot.place, spot.facing, *spot.item.extent)
        wide = widened(shape, _CLEARANCE)
        if not self._shape.covers(shape) or any(wide.intersects(each) for each in self.beside):
            return False
        return is_unoccupied(wide, self.scene)

    def objects(self, spot: _Spot) -> Iterator[CityObject]:
        """The object of a spot; a tree stands in its pit."""
        number = len(self.beside)
        self.beside.append(rectangle_at(spot.place, spot.facing, *spot.item.extent))
        place = snap(spot.place)
        position = np.append(place, snap(self.scene.ground.heights(place[None]))[0])
        heading = heading_of(spot.facing)
        if spot.item is _TREE:
            yield self._feature("tree_pit", number, position, heading, np.zeros(3))
            yield self._tree(number, position)
            return
        height = self._mast if spot.item is _LAMP else 0.0
        size = np.array([0.0, 0.0, height])
        yield self._feature(spot.item.template, number, position, heading, size)

    def _feature(
        self, template: str, number: int, position: FloatArray, heading: float, size: FloatArray
    ) -> CityObject:
        facts = {
            "class": "1000",
            "function": FUNCTIONS[template],
            AVENUE: f"square_{self.plot.id}",
        }
        placement = Placement(position, heading, size, template)
        name = f"{template}_{self.plot.id}_square_{number}"
        return CityObject(name, "CityFurniture", facts, placement=placement)

    def _tree(self, number: int, position: FloatArray) -> CityObject:
        height = self._tall * self.draws.within(f"tree {number}", _SPREAD)
        # The crown stays within the square.
        crown = min(height * self._crown, 2.0 * _INSETS[TREE])
        trunk = height * self.draws.within(f"trunk {number}", TRUNK)
        turn = self.draws.within(f"turn {number}", (-np.pi, np.pi))
        name = f"{TREE}_{self.plot.id}_square_{number}"
        tree = tree_feature(name, TREE, position, np.array([height, crown, trunk]), turn)
        return replace(tree, attributes={**tree.attributes, AVENUE: f"square_{self.plot.id}"})
