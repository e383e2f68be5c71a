"""What stands in gardens and on allotments: terraces, sheds, clothes lines, beds, fruit trees."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from envgen_usd.chunks import snap
from envgen_usd.city.city_scene import Scene
from envgen_usd.city.headings import heading_of
from envgen_usd.city.plots.enclosed_plots import Enclosed
from envgen_usd.city.plots.given_buildings import chunk_of
from envgen_usd.city.plots.orchards import TEMPLATE, fruit_tree_kind
from envgen_usd.city.plots.plot_frame import PlotFrame, is_unoccupied, rectangle_at, widened
from envgen_usd.city.plots.trees import TRUNK, tree_feature
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.city_model import AVENUE, CityObject, Placement
from envgen_usd.models.environment_profile import GardenRules, Profile
from envgen_usd.models.landuse import LanduseClass, Plot
from envgen_usd.seeds import Draws

_CLEARANCE = 0.25
"""Least distance of what stands in a garden from the plot's border and from objects, metres."""
_FENCE = 0.75
"""Distance of sheds from the border of their plot, metres."""
_WALL = 0.1
"""Distance between a terrace and the house, metres."""
_SHED_ROOM = 6.0
"""Least depth of a garden behind the house with a shed, metres."""
_LINE_ROOM = 9.0
"""Least depth of a garden behind the house with a clothes line, metres."""
_PARCEL = (12.0, 17.0)
"""Width and depth of an allotment garden, metres; the German law on allotments (BKleingG, 3) allows
400 m². Larger values give fewer sheds."""
_BED_STEP = 1.6
"""Distance between the beds of an allotment garden, metres."""
_BED_COLUMNS = (7.6, 10.3)
"""Middles of the two columns of beds, metres from the side of a parcel where its shed stands; lawn
is between them and the shed."""
# SIG3D code list CityFurniture_function: other.
_OTHER = "1540"


@dataclass(frozen=True)
class _Item:
    """A kind of object in gardens: template, size (x, y, z) in metres; its x leads outwards."""

    template: str
    size: tuple[float, float, float]


_TERRACE = _Item("terrace", (3.0, 3.6, 0.9))
_SHED = _Item("shed", (1.8, 2.4, 2.2))
_LINE = _Item("clothes_line", (1.0, 4.1, 1.9))
_BED = _Item("flower_bed", (0.9, 2.4, 0.6))
_FRUIT_TREE = _Item(TEMPLATE, (3.2, 3.2, 4.0))


def place_garden_contents(
    scene: Scene, houses: Sequence[Enclosed], plots: Sequence[Plot], profile: Profile
) -> tuple[CityObject, ...]:
    """Returns what stands in the gardens and allotments of a chunk.

    1. A terrace adjoins the back of the house.
    2. A shed stands in a back corner of the garden, a clothes line between it and the house.
    3. Allotments are divided into parcels, back to back, with a shed, beds and a fruit tree each.

    Fruit trees are ``SolitaryVegetationObject``, all else is ``CityFurniture``. What finds no room,
    because of trees, fences or the shape of the plot, is left out.

    Args:
        scene: Scene of the chunk.
        houses: Plots with houses in the chunk.
        plots: Plots in and around the chunk.
        profile: The environment; ``gardens`` has the shares, ``props.orchard_tree`` says what the
            fruit trees are.
    """
    placed: list[CityObject] = []
    rules = profile.gardens
    fruit = fruit_tree_kind(profile)
    wanted = [_behind_house(house, rules, scene.seed) for house in houses]
    own = (plot for plot in plots if chunk_of(shapely.Polygon(plot.polygon)) == scene.chunk)
    if rules.allotments:
        allotments = (plot for plot in own if plot.landuse == LanduseClass.ALLOTMENT)
        wanted += [_on_allotment(plot, scene.seed) for plot in allotments]
    for objects in wanted:
        # Plots do not overlap, so only objects of the same plot can.
        beside: list[shapely.Polygon] = []
        for plot, item, place, outwards in objects:
            pose = place, outwards
            if _is_free(plot, item, pose, scene, beside):
                ending = f"{plot.id}_garden_{len(beside)}"
                if item is _FRUIT_TREE:
                    placed.append(_fruit_tree(f"{fruit}_{ending}", fruit, pose, scene))
                else:
                    placed.append(_feature(f"{item.template}_{ending}", plot, item, pose, scene))
                beside.append(_shape(item, pose))
    return tuple(placed)


_Wanted = Iterator[tuple[Plot, _Item, FloatArray, FloatArray]]


def _behind_house(house: Enclosed, rules: GardenRules, seed: int) -> _Wanted:
    """Objects of a garden: plot, item, place, and the direction in which it faces."""
    draws = Draws(seed, "city", "garden contents", house.plot.id)
    frame = PlotFrame.of(house.plot)
    corners = frame.inside(shapely.get_coordinates(house.house))
    (left, _), (right, back) = corners.min(axis=0).tolist(), corners.max(axis=0).tolist()
    border = frame.inside(house.plot.polygon)
    end = float(border[:, 1].max())
    share = draws.share("place")
    if draws.happens("terrace", rules.terraces):
        length, width, _ = _TERRACE.size
        room = max(right - left - width, 0.0)
        along = left + min(width, right - left) / 2.0 + share * room
        place = frame.place(along, back + _WALL + length / 2.0)
        yield house.plot, _TERRACE, place, frame.into
    if end - back >= _SHED_ROOM and draws.happens("shed", rules.sheds):
        depth, width, _ = _SHED.size
        far = border[border[:, 1] > back]
        low, high = far[:, 0].min() + _FENCE + width / 2, far[:, 0].max() - _FENCE - width / 2
        side = low if draws.share("corner") < 0.5 else high
        for step in (0.0, 1.5, 3.0):
            place = frame.place(float(side), end - _FENCE - step - depth / 2)
            yield house.plot, _SHED, place, -frame.into
    if end - back >= _LINE_ROOM and draws.happens("line", rules.clothes_lines):
        along = (left + right) / 2.0 + (share - 0.5) * 2.0
        place = frame.place(along, (back + end) / 2.0 + 1.0)
        yield house.plot, _LINE, place, frame.along if right - left < 6.0 else frame.into


@dataclass(frozen=True)
class _Parcel:
    """An allotment garden; `at` counts from its path, and from the side where its shed stands."""

    frame: PlotFrame
    corner: tuple[float, float]
    is_mirrored: bool
    is_turned: bool

    @property
    def into(self) -> FloatArray:
        """Direction away from the path."""
        return -self.frame.into if self.is_turned else self.frame.into

    def at(self, across: float, along: float) -> FloatArray:
        width, depth = _PARCEL
        x = width - across if self.is_mirrored else across
        y = depth - along if self.is_turned else along
        return self.frame.place(self.corner[0] + x, self.corner[1] + y)


def _on_allotment(plot: Plot, seed: int) -> _Wanted:
    """Objects of the parcels of an allotment; every other row of parcels is turned around."""
    draws = Draws(seed, "city", "allotment", plot.id)
    frame = PlotFrame.of(plot)
    border = frame.inside(plot.polygon)
    low, high = border.min(axis=0), border.max(axis=0)
    width, depth = _PARCEL
    for column, x in enumerate(np.arange(low[0], high[0] - width / 2, width).tolist()):
        for row, y in enumerate(np.arange(low[1], high[1] - depth / 2, depth).tolist()):
            name = f"{column} {row}"
            is_mirrored = draws.happens(f"mirror {name}", 0.5)
            parcel = _Parcel(frame, (x, y), is_mirrored, is_turned=row % 2 > 0)
            yield plot, _SHED, parcel.at(1.9, depth - 1.7), -parcel.into
            tree = parcel.at(2.8, draws.within(f"tree {name}", (4.5, depth - 7.0)))
            yield plot, _FRUIT_TREE, tree, parcel.into
            for number in range(draws.whole(f"beds {name}", (4, 8))):
                for column_of_beds in _BED_COLUMNS:
                    bed = parcel.at(column_of_beds, 1.8 + _BED_STEP * number)
                    yield plot, _BED, bed, parcel.into


def _shape(item: _Item, pose: tuple[FloatArray, FloatArray]) -> shapely.Polygon:
    """The rectangle of an object in plan."""
    place, outwards = pose
    length, width, _ = item.size
    return rectangle_at(place, outwards, length, width)


def _is_free(
    plot: Plot,
    item: _Item,
    pose: tuple[FloatArray, FloatArray],
    scene: Scene,
    beside: Sequence[shapely.Polygon],
) -> bool:
    """True for an object inside of its plot that touches neither roads nor objects."""
    shape = _shape(item, pose)
    wide = widened(shape, _CLEARANCE)
    if not shapely.Polygon(plot.polygon).covers(wide):
        return False
    if item is _TERRACE:
        wide = widened(shape, _WALL / 2.0)
    if any(wide.intersects(other) for other in beside):
        return False
    return is_unoccupied(wide, scene)


def _feature(
    name: str, plot: Plot, item: _Item, pose: tuple[FloatArray, FloatArray], scene: Scene
) -> CityObject:
    place, outwards = pose
    size = np.zeros(3) if item is _BED else np.array(item.size)
    placement = Placement(_position(place, scene), heading_of(outwards), size, item.template)
    facts = {"class": "1000", "function": _OTHER, AVENUE: f"garden_{plot.id}"}
    return CityObject(name, "CityFurniture", facts, placement=placement)


def _fruit_tree(
    name: str, template: str, pose: tuple[FloatArray, FloatArray], scene: Scene
) -> CityObject:
    place, outwards = pose
    crown, _, tall = _FRUIT_TREE.size
    size = np.array([tall, crown, tall * sum(TRUNK) / 2.0])
    return tree_feature(name, template, _position(place, scene), size, heading_of(outwards))


def _position(place: FloatArray, scene: Scene) -> FloatArray:
    position: FloatArray = np.append(snap(place), snap(scene.ground.heights(place[None]))[0])
    return position
