"""Cranes of harbours: on rails along straight quays, their jibs to the water."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
import shapely
from scipy import ndimage

from envgen_usd.chunks import CELL_SIZE, CHUNK_SIZE, snap
from envgen_usd.city.city_scene import Scene
from envgen_usd.city.headings import heading_of
from envgen_usd.city.plots.land_rows import at_points
from envgen_usd.city.plots.plot_frame import is_unoccupied, rectangle_at
from envgen_usd.city.plots.strip_bodies import as_polygons, strip_body
from envgen_usd.models.array_types import BoolArray, FloatArray, IntArray
from envgen_usd.models.city_model import CityObject, Placement
from envgen_usd.models.environment_profile import Profile, PropRules
from envgen_usd.models.figure_types import Weights
from envgen_usd.models.landuse import LanduseClass, LanduseMap
from envgen_usd.seeds import Draws

TEMPLATE = "crane"
"""Kind of their assets; the attribute ``design`` names a variant."""
GAUGES: Mapping[str, tuple[float, float]] = {
    "portal": (6.0, 7.8),
    "portal_large": (10.5, 11.3),
    "gantry": (15.0, 15.3),
}
"""Distance of the rails, and length along them, of each design, metres."""
RAIL = 2.9
"""Distance of the rail at the water from it, metres."""
_BESIDE = 0.5
"""Room beside the middle of a rail, metres; bollards stand nearer to the water."""
_TRACK = 40.0
"""Length of the rails of a crane, metres, where the quay is straight so far."""
_LEAST_TRACK = 16.0
"""Least length of straight quay at a crane, metres."""
_STEP = 2.0
"""Distance of places along the quay that are looked at, metres."""
_BEND = 0.9
"""Largest difference of a rail from its distance to the water, metres: cells are 0.8 m wide."""
_HEAD = 0.1
"""Width of a rail, metres."""
_RAIL_HEIGHTS = (-0.1, 0.025)
"""Heights of a rail's underside and top above the ground, metres; it lies in the pavement."""
_SMOOTH = 3.0
"""Deviation of the mean over which the direction of the water is taken, cells."""
_CLEAR = 0.6
"""Least slope of the distance from the water where its direction is clear."""
FUNCTION = "1540"
"""Code of the SIG3D list CityFurniture_function: other."""


@dataclass(frozen=True)
class HarbourCranes:
    """Cranes of a chunk.

    Attributes:
        features: Cranes and rails, as ``CityFurniture``.
        tracks: What they need in plan.
    """

    features: tuple[CityObject, ...]
    tracks: tuple[shapely.Polygon, ...]


@dataclass(frozen=True)
class _Quay:
    """The quays of a chunk: which cells they are, and their distance from the water, metres."""

    landuse: LanduseMap
    cells: BoolArray
    away: FloatArray

    def distances(self, points: FloatArray) -> FloatArray:
        """Distance from the water of points (N x 2) on the quay; NaN elsewhere."""
        chunk = self.landuse.chunk
        inside = np.all((points > chunk.bounds[:2]) & (points < chunk.bounds[2:]), axis=-1)
        inside &= at_points(self.cells.astype(np.int64), points, chunk) > 0
        return np.where(inside, at_points(self.away, points, chunk), np.nan)


def place_cranes(scene: Scene, landuse: LanduseMap, profile: Profile) -> HarbourCranes:
    """Returns the cranes on a chunk's quays, each of a design that has room, with its rails.

    Args:
        scene: Scene of the chunk.
        landuse: Landuse of the chunk.
        profile: The environment; gives the distance of cranes and the weights of designs.
    """
    spacing, weights = profile.yard.cranes, _weights(profile)
    cells = landuse.classes == LanduseClass.QUAY
    water = landuse.classes == LanduseClass.WATER
    if spacing <= 0.0 or not cells.any() or not water.any():
        return HarbourCranes((), ())
    away = (ndimage.distance_transform_edt(~water) - 0.5) * CELL_SIZE
    quay = _Quay(landuse, cells, away)
    numbers, points, inland = _places(quay, spacing / 4.0)
    features: list[CityObject] = []
    taken: list[shapely.Polygon] = []
    # Room for a track is looked for only where no crane stands nearby.
    is_open = np.ones(len(points), dtype=bool)
    for n, number in enumerate(numbers.tolist()):
        if not is_open[n]:
            continue
        place, land = points[n], inland[n]
        tracks = {
            design: track
            for design, track in _tracks(quay, scene, place, land).items()
            if weights.get(design, 0.0) > 0.0
        }
        if not tracks:
            continue
        is_open &= np.linalg.norm(points - place, axis=1) > spacing
        draws = Draws(scene.seed, "city", "cranes", scene.chunk.name, number)
        design = draws.choice("design", {each: weights[each] for each in sorted(tracks)})
        track = _between(tracks[design])
        if not any(track.intersects(other) for other in taken):
            taken.append(track)
            name = f"{scene.chunk.prim_name}_{number}"
            features += _crane(scene, name, design, place, land, tracks[design])
    return HarbourCranes(tuple(features), tuple(taken))


def _places(quay: _Quay, margin: float) -> tuple[IntArray, FloatArray, FloatArray]:
    """Places of rails at the water: their numbers (N), points (N x 2) and directions of the land.

    Args:
        quay: The quays of a chunk.
        margin: Least distance from the chunk's border, metres.
    """
    row, column = np.nonzero(quay.cells & (np.abs(quay.away - RAIL) < CELL_SIZE / 2.0))
    beside = (np.stack([column, row], axis=1).astype(np.float64) + 0.5) * CELL_SIZE
    smooth = ndimage.gaussian_filter(quay.away, _SMOOTH)
    slopes = np.stack([np.gradient(smooth, axis=axis) for axis in (1, 0)])
    inland: FloatArray = slopes[:, row, column].T
    # Between two waters no direction is that of the land.
    steep = np.linalg.norm(inland, axis=1)
    own = np.all((beside > margin) & (beside < CHUNK_SIZE - margin), axis=1)
    numbers = np.flatnonzero(own & (steep > _CLEAR * CELL_SIZE))
    points = beside[numbers] + quay.landuse.chunk.origin
    directions: FloatArray = inland[numbers] / steep[numbers, None]
    return numbers, points, directions


def is_crane(feature: CityObject) -> bool:
    """True for a crane, e.g. of a map, beside which none are generated."""
    return feature.placement is not None and feature.placement.template == TEMPLATE


def crane_ground(crane: CityObject) -> shapely.Polygon:
    """The ground between the wheels of a crane in plan; of the smallest, if its design is open."""
    assert crane.placement is not None
    gauge, length = GAUGES[str(crane.attributes.get("design", "portal"))]
    heading = crane.placement.heading
    inland = -np.array([np.cos(heading), np.sin(heading)])
    along = np.array([-inland[1], inland[0]])
    return rectangle_at(crane.placement.position[:2], along, length, gauge + 2.0 * _BESIDE)


def design_at(away: float, profile: Profile, draws: Draws) -> str:
    """A design for a crane of a map whose rails have room before the water.

    Args:
        away: Distance of the middle of the crane from the water, metres.
        profile: The environment; gives the weights of designs.
        draws: Draws of the crane.
    """
    weights = _weights(profile)
    fitting = {
        design: weights.get(design, 0.0)
        for design, (gauge, _) in GAUGES.items()
        if away >= gauge / 2.0 + _BESIDE
    }
    return draws.choice("design", fitting) if any(fitting.values()) else next(iter(GAUGES))


def _weights(profile: Profile) -> Weights:
    """Weights of designs."""
    variants = profile.props.get(TEMPLATE, PropRules()).variants
    return variants.get("design") or dict.fromkeys(GAUGES, 1.0)


def _tracks(
    quay: _Quay, scene: Scene, place: FloatArray, inland: FloatArray
) -> dict[str, FloatArray]:
    """Ends of the rails (2 x 2 x 2: at the water and inland) of the designs with room at a place.

    The rails reach as far along the quay as it is straight.
    """
    along = np.array([-inland[1], inland[0]])
    steps = np.arange(0.0, _TRACK / 2.0 + 0.1, _STEP)
    reach = []
    for side in (-1.0, 1.0):
        distances = quay.distances(place + side * steps[:, None] * along)
        bad = ~(np.abs(distances - RAIL) < _BEND)
        reach.append(
            side * float(steps[max(int(np.argmax(bad)) - 1, 0)] if bad.any() else steps[-1])
        )
    found: dict[str, FloatArray] = {}
    if reach[1] - reach[0] < _LEAST_TRACK or min(-reach[0], reach[1]) < _LEAST_TRACK / 2.0:
        return found
    ends = place + np.array(reach)[:, None] * along
    for design, (gauge, length) in GAUGES.items():
        if min(-reach[0], reach[1]) < length / 2.0:
            continue
        rails = np.stack([ends, ends + gauge * inland])
        shares = np.linspace(0.0, 1.0, round((reach[1] - reach[0]) / _STEP) + 1)
        back = rails[1, 0] + shares[:, None] * (rails[1, 1] - rails[1, 0])
        if np.isnan(quay.distances(back + _BESIDE * inland)).any():
            continue
        low, high = scene.ground.range_under(rails[[0, 0, 1, 1], [0, 1, 1, 0]])
        if high - low < 2.0 * _RAIL_HEIGHTS[1] and is_unoccupied(_between(rails), scene):
            found[design] = rails
    return found


def _between(rails: FloatArray) -> shapely.Polygon:
    """The ground of a track in plan."""
    along = rails[0, 1] - rails[0, 0]
    length, gauge = float(np.hypot(*along)), float(np.hypot(*(rails[1, 0] - rails[0, 0])))
    middle = rails.mean(axis=(0, 1))
    return rectangle_at(middle, along / length, length, gauge + 2.0 * _BESIDE)


def _crane(  # noqa: PLR0913, PLR0917 - a crane and its place
    scene: Scene,
    name: str,
    design: str,
    place: FloatArray,
    inland: FloatArray,
    rails: FloatArray,
) -> Iterator[CityObject]:
    """A crane in the middle between its rails, and the rails."""
    foot = snap(place + GAUGES[design][0] / 2.0 * inland)
    position = np.append(foot, snap(scene.ground.heights(foot[None]))[0])
    placement = Placement(position, heading_of(-inland), np.zeros(3), TEMPLATE)
    facts = {"class": "1000", "function": FUNCTION, "design": design}
    yield CityObject(f"crane_{name}", "CityFurniture", facts, placement=placement)
    faces = []
    for rail in rails:
        land = scene.ground.heights(rail)
        faces += strip_body(rail, _HEAD, land + _RAIL_HEIGHTS[0], land + _RAIL_HEIGHTS[1])
    yield CityObject(
        f"crane_rails_{name}",
        "CityFurniture",
        {"function": FUNCTION, "template": "rail", "material": "metal_dark"},
        geometry={"lod2MultiSurface": as_polygons(faces)},
    )
