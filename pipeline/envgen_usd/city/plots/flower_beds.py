"""Flower beds in front gardens: before the house, and behind the fence of deep gardens."""

from collections.abc import Iterator, Sequence

import numpy as np
import shapely

from envgen_usd.chunks import snap
from envgen_usd.city.city_scene import Scene
from envgen_usd.city.headings import heading_of
from envgen_usd.city.plots.enclosed_plots import Enclosed
from envgen_usd.city.plots.plot_frame import PlotFrame, is_unoccupied, rectangle_at, widened
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.city_model import AVENUE, CityObject, Placement
from envgen_usd.models.environment_profile import GardenRules
from envgen_usd.seeds import Draws

_LENGTH, _DEPTH = 2.4, 0.9
"""Room of a bed along and across the frontage, metres; a larger value gives fewer beds."""
_GAP = 0.5
"""Metres between neighbouring beds; a larger value gives fewer beds."""
_WALL = 0.35
"""Metres between a bed and the house."""
_FENCE = 0.65
"""Metres between a bed and the frontage, where the fence stands."""
_DOOR = 0.5
"""Metres between a bed and the way to a door; a larger value gives fewer beds."""
_DEEP = 4.0
"""Least depth in metres of a front garden with beds at the fence, too."""
_CLEARANCE = 0.3
"""Least distance of a bed from what stands already, metres."""
_PLANTED = 0.75
"""Share of the rooms for beds that have a bed, in a garden with beds."""
# SIG3D code list CityFurniture_function: other.
_OTHER = "1540"


def place_flower_beds(
    scene: Scene, plots: Sequence[Enclosed], rules: GardenRules
) -> tuple[CityObject, ...]:
    """Returns the flower beds of a chunk as ``CityFurniture``; they face the street.

    Args:
        scene: Scene of the chunk.
        plots: Plots with houses in the chunk.
        rules: Share of the front gardens with beds.
    """
    beds: list[CityObject] = []
    for enclosed in plots:
        draws = Draws(scene.seed, "city", "garden", enclosed.plot.id)
        if draws.happens("beds", rules.flower_beds):
            beds += _of_garden(enclosed, draws, scene)
    return tuple(beds)


def _of_garden(enclosed: Enclosed, draws: Draws, scene: Scene) -> Iterator[CityObject]:
    garden = PlotFrame.of(enclosed.plot)
    heading = heading_of(-garden.into)
    facts = {"class": "1000", "function": _OTHER, AVENUE: f"garden_{enclosed.plot.id}"}
    for number, (along, behind) in enumerate(_rooms(enclosed, garden)):
        place = garden.place(along, behind)
        wanted = draws.happens(f"bed {number}", _PLANTED)
        if wanted and _is_free(place, garden, enclosed, scene):
            height = snap(scene.ground.heights(place[None]))[0]
            placement = Placement(
                np.append(snap(place), height), heading, np.zeros(3), "flower_bed"
            )
            name = f"flower_bed_{enclosed.plot.id}_{number}"
            yield CityObject(name, "CityFurniture", facts, placement=placement)


def _rooms(enclosed: Enclosed, garden: PlotFrame) -> Iterator[tuple[float, float]]:
    """Middles of the rooms for beds, by their distances along and behind the frontage."""
    house = garden.inside(shapely.get_coordinates(enclosed.house))
    (left, front), right = house.min(axis=0).tolist(), float(house[:, 0].max())
    lines = []
    if front - _WALL - _DEPTH >= _FENCE:
        lines.append((left, right, front - _WALL - _DEPTH / 2))
    if front >= _DEEP:
        corners = garden.inside(enclosed.plot.polygon)[:, 0]
        ends = float(corners.min()) + _FENCE, float(corners.max()) - _FENCE
        lines.append((*ends, _FENCE + _DEPTH / 2))
    doors = [
        (float(garden.inside(gate.place[None])[0, 0]), gate.width / 2 + _DOOR)
        for gate in enclosed.gates
    ]
    for start, end, behind in lines:
        count = int((end - start + _GAP) / (_LENGTH + _GAP))
        for at in (start + (end - start) * (np.arange(count) + 0.5) / max(count, 1)).tolist():
            if all(abs(at - door) >= room + _LENGTH / 2 for door, room in doors):
                yield at, behind


def _is_free(place: FloatArray, garden: PlotFrame, enclosed: Enclosed, scene: Scene) -> bool:
    """True for a bed inside of its plot that touches neither roads nor objects."""
    bed = rectangle_at(place, garden.along, _LENGTH, _DEPTH)
    if not shapely.Polygon(enclosed.plot.polygon).covers(bed):
        return False
    return is_unoccupied(widened(bed, _CLEARANCE), scene)
