"""Hedges, fences and walls along the borders of plots, and the gates in them."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import shapely
from shapely.geometry.polygon import orient

from envgen_usd.city.city_scene import Scene
from envgen_usd.city.ground_heights import Ground
from envgen_usd.city.plots.enclosed_plots import Enclosed, Gate
from envgen_usd.city.plots.fence_panels import fence_panels, gate_feature
from envgen_usd.city.plots.given_buildings import chunk_of
from envgen_usd.city.plots.strip_bodies import as_polygons, strip_body
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.attribute_values import Attribute
from envgen_usd.models.city_model import CityObject
from envgen_usd.models.distribution import Range
from envgen_usd.models.environment_profile import EnclosureRules
from envgen_usd.models.landuse import LanduseClass, Plot
from envgen_usd.seeds import Draws

_INSET = 0.3
"""Distance from the plot's border, metres; a larger value moves enclosures inwards."""
_STEP = 3.0
"""Distance between samples of the ground height along hedges and walls, metres."""
_LEAST_LENGTH = 0.8
_LEAST_STEP = 0.6
_STRAIGHT = 0.02
"""Largest distance of a straight run from its chord, metres."""
_CLEARANCE = 0.15
"""Least distance from houses and roads, metres; a larger value shortens enclosures."""
_MITRE = 0.05
"""Farthest corner of a body from its sides, metres; a larger value cuts more lines beside roads."""
_BELOW = 0.2
_NEIGHBOUR = 0.6
"""Largest distance of a neighbouring plot that encloses a shared side, metres.

A larger value leaves more sides to neighbours.
"""
_AT_ROAD = 3.0
"""Farthest side of a plot from the road that looks at it, metres."""
_WIDTHS = {"hedge": 0.5, "wall": 0.2}
_WAY = 0.4
"""Room of a gate beside the door it leads to, metres; a larger value widens gaps."""
_USE_HEIGHT: Range = (0.8, 1.2)
"""Height of enclosures around parks, allotments and car parks, metres."""
_USE_GATE = 2.5
"""Width of the way into a plot with a use, metres."""
_ENCLOSED_USES = frozenset((LanduseClass.PARK, LanduseClass.ALLOTMENT, LanduseClass.PARKING))
_MEETS = 0.1
"""Largest distance of a gate's post from the end of an enclosure, metres.

A larger value puts gates into gaps that are wider than they are.
"""
# SIG3D code list CityFurniture_function: fence.
_FENCE = "1440"


@dataclass(frozen=True)
class _Gap:
    """A gap in the enclosure: its middle (2) on the enclosure's line, and its width, metres."""

    middle: FloatArray
    width: float


def enclosed_uses(scene: Scene, plots: Sequence[Plot]) -> tuple[Enclosed, ...]:
    """The parks, allotments and car parks of a chunk, with the way into each.

    Args:
        scene: Scene of the chunk.
        plots: Plots in and around the chunk.
    """
    found = []
    for plot in plots:
        if plot.landuse not in _ENCLOSED_USES:
            continue
        if chunk_of(shapely.Polygon(plot.polygon)) == scene.chunk:
            way = plot.access
            gates = () if way is None else (Gate(way, way, _USE_GATE),)
            found.append(Enclosed(plot, shapely.Polygon(), gates, is_use=True))
    return tuple(found)


def place_enclosures(
    scene: Scene, plots: Sequence[Enclosed], around: Sequence[Plot], rules: EnclosureRules
) -> tuple[CityObject, ...]:
    """Returns the enclosures of plots as ``PlantCover`` or ``CityFurniture``.

    Hedges and walls are bodies. A fence is a row of panels, and a gate fills the gap before a
    door: both are placements of assets.

    Args:
        scene: Scene of the chunk.
        plots: Plots with houses or uses in the chunk.
        around: All plots near them: a side that two plots share is enclosed once.
        rules: Enclosure rules of the environment.
    """
    tree = shapely.STRtree([shapely.Polygon(plot.polygon) for plot in around])
    features: list[CityObject] = []
    for enclosed in plots:
        draws = Draws(scene.seed, "city", "enclosure", enclosed.plot.id)
        kinds, limits = rules.kinds, rules.height
        if enclosed.is_use:
            kinds = {kind: share for kind, share in kinds.items() if kind != "none"} or kinds
            limits = _USE_HEIGHT
        kind = draws.choice("kind", kinds)
        height = round(draws.within("height", limits), 2)
        if kind == "none":
            continue
        gaps = [_gap(enclosed.plot, gate, rules) for gate in enclosed.gates]
        lines = _lines(enclosed, gaps, around, tree, scene, _WIDTHS.get(kind, 0.0))
        if kind == "fence":
            features += fence_panels(enclosed.plot.id, lines, height, scene.ground)
        elif lines:
            material = draws.choice("material", rules.materials.get(kind, {"concrete": 1.0}))
            features.append(
                enclosure_body(
                    f"{kind}_{enclosed.plot.id}", kind, height, material, lines, scene.ground
                )
            )
        if draws.share("gates") < rules.gates:
            features += _gates(enclosed.plot, gaps, lines, kind, height, scene)
    return tuple(features)


def _gap(plot: Plot, gate: Gate, rules: EnclosureRules) -> _Gap:
    """The gap on the line of the enclosure before a door."""
    start, end = plot.frontage
    along = (end - start) / np.hypot(*(end - start))
    into = np.array([-along[1], along[0]])
    foot: FloatArray = start + along * ((gate.place - start) @ along) + into * _INSET
    return _Gap(foot, max(rules.gate, gate.width + _WAY))


def _gates(  # noqa: PLR0913, PLR0917 - what gates follow from
    plot: Plot,
    gaps: Sequence[_Gap],
    lines: Sequence[FloatArray],
    kind: str,
    height: float,
    scene: Scene,
) -> list[CityObject]:
    """Gates in the gaps that the enclosure reaches on both sides."""
    if not lines:
        return []
    start, end = plot.frontage
    along = (end - start) / np.hypot(*(end - start))
    ends = np.array([place for line in lines for place in (line[0], line[-1])])
    found = []
    for number, gap in enumerate(gaps):
        posts = gap.middle + np.array([[-0.5], [0.5]]) * gap.width * along
        away = np.linalg.norm(posts[:, None] - ends[None], axis=2).min(axis=1)
        if (away <= _MEETS).all():
            name = f"gate_{plot.id}_{number}"
            found.append(gate_feature(name, plot.id, kind, posts, height, scene.ground))
    return found


def _lines(  # noqa: PLR0913, PLR0917 - what lines follow from
    enclosed: Enclosed,
    gaps: Sequence[_Gap],
    around: Sequence[Plot],
    tree: shapely.STRtree,
    scene: Scene,
    width: float,
) -> list[FloatArray]:
    """Lines of enclosures of a width: polylines, N_i x 2, with a point at every step."""
    inner = shapely.Polygon(enclosed.plot.polygon).buffer(-_INSET, join_style="mitre")
    if inner.is_empty or inner.geom_type != "Polygon":
        return []
    taken = [enclosed.house.buffer(_CLEARANCE, join_style="mitre"), enclosed.beside_barriers]
    feet = shapely.points(np.array([gap.middle for gap in gaps]).reshape(-1, 2))
    taken += shapely.buffer(feet, [gap.width / 2 for gap in gaps]).tolist()
    taken += scene.taken.grown(inner, _CLEARANCE)
    left_open = _at_road(enclosed.plot, scene) if enclosed.open_front else []
    for side in (*left_open, *_shared(enclosed.plot, around, tree)):
        taken.append(side.buffer(_INSET + 0.1, cap_style="flat"))
    # Anticlockwise, so that the outside lies to the right of each line.
    left = orient(inner).exterior.difference(shapely.union_all(taken))
    if left.geom_type == "MultiLineString":
        left = shapely.line_merge(left, directed=True)
    lines = []
    for part in shapely.get_parts(left):
        if part.length >= _LEAST_LENGTH:
            open_line = shapely.get_coordinates(without_stubs(part).segmentize(_STEP))
            # An uninterrupted enclosure ends a step before its start.
            line = spaced_line(open_line[:-1] if part.is_closed else open_line)
            lines += _off_road(line, max(width / 2.0 + _MITRE, _CLEARANCE), scene)
    return lines


def _off_road(line: FloatArray, room: float, scene: Scene) -> list[FloatArray]:
    """Runs of the pieces of a line (N x 2) that keep room to roads on either side, metres."""
    runs = [[line[0]]]
    for start, end in pairwise(line):
        # Square ends cover the corners of bends.
        piece = shapely.LineString([start, end]).buffer(room, cap_style="square")
        if scene.road.touches(piece):
            runs.append([end])
        else:
            runs[-1].append(end)
    return [np.array(run) for run in runs if len(run) > 1]


def _at_road(plot: Plot, scene: Scene) -> list[shapely.LineString]:
    """The sides of a plot that lie at a road."""
    sides = np.stack([plot.polygon, np.roll(plot.polygon, -1, axis=0)], axis=1)
    near = scene.road.near(sides.mean(axis=1), _AT_ROAD)
    return [shapely.LineString(side) for side in (plot.frontage, *sides[near])]


def _shared(plot: Plot, around: Sequence[Plot], tree: shapely.STRtree) -> list[shapely.LineString]:
    """Sides of a plot that a neighbour with a smaller id encloses."""
    sides = []
    corners = plot.polygon
    for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        side = shapely.LineString([start, end])
        near = tree.query(side.interpolate(0.5, normalized=True), "dwithin", _NEIGHBOUR)
        if any(around[i].id < plot.id for i in near.tolist()):
            sides.append(side)
    return sides


def without_stubs(part: shapely.LineString) -> shapely.LineString:
    """Returns a line without ends around a corner that are too short for a body."""
    if part.is_closed:
        return part
    corners = shapely.get_coordinates(part.simplify(_STRAIGHT))
    while len(corners) > 2 and np.hypot(*(corners[1] - corners[0])) < _LEAST_STEP:
        corners = corners[1:]
    while len(corners) > 2 and np.hypot(*(corners[-1] - corners[-2])) < _LEAST_STEP:
        corners = corners[:-1]
    return shapely.LineString(corners)


def spaced_line(line: FloatArray) -> FloatArray:
    """Returns a line (N x 2 or 3) without points so near to others that sides would cross."""
    kept = [line[0]]
    for place in line[1:-1]:
        if min(np.linalg.norm(place - end) for end in (kept[-1], line[-1])) > _LEAST_STEP:
            kept.append(place)
    return np.array([*kept, line[-1]])


def enclosure_body(  # noqa: PLR0913, PLR0917 - what a body follows from
    name: str,
    kind: str,
    height: float,
    material: str,
    lines: Sequence[FloatArray],
    ground: Ground,
) -> CityObject:
    """Returns a hedge or a wall.

    Args:
        name: Id of the feature.
        kind: ``hedge`` or ``wall``.
        height: Height above the ground, metres.
        material: Name in the material library.
        lines: Its lines, N_i x 2, metres.
        ground: Heights of the ground.
    """
    faces = []
    for line in lines:
        land = ground.heights(line)
        faces += strip_body(line, _WIDTHS[kind], land - _BELOW, land + height)
    facts: dict[str, Attribute] = {"template": kind, "material": material}
    geometry = {"lod2MultiSurface": as_polygons(faces)}
    if kind == "hedge":
        return CityObject(name, "PlantCover", {"averageHeight": height, **facts}, geometry=geometry)
    facts = {"function": _FENCE, "height": height, **facts}
    return CityObject(name, "CityFurniture", facts, geometry=geometry)
