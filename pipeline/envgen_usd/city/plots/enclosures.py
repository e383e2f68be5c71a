"""Hedges, fences and walls along the borders of plots."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from envgen_usd.city.city_scene import Scene
from envgen_usd.city.plots.strip_bodies import as_polygons, post_body, strip_body
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.attribute_values import Attribute
from envgen_usd.models.city_model import CityObject
from envgen_usd.models.environment_profile import EnclosureRules
from envgen_usd.models.landuse import Plot
from envgen_usd.seeds import Draws

_INSET = 0.3
"""Distance from the plot's border, metres; a larger value moves enclosures inwards."""
_STEP = 3.0
"""Distance between samples of the ground height, metres; fences have a post at each."""
_LEAST_LENGTH = 0.8
_LEAST_STEP = 0.6
_CLEARANCE = 0.15
"""Least distance from houses and roads, metres; a larger value shortens enclosures."""
_BELOW = 0.2
_NEIGHBOUR = 0.6
"""Largest distance of a neighbouring plot that encloses a shared side, metres.

A larger value leaves more sides to neighbours.
"""
_WIDTHS = {"hedge": 0.5, "wall": 0.2, "fence": 0.05}
_POST, _RAIL = 0.08, 0.06
# SIG3D code list CityFurniture_function: fence.
_FENCE = "1440"


@dataclass(frozen=True)
class Enclosed:
    """A plot with its house.

    Attributes:
        plot: The plot.
        house: Outline of the house in plan.
        gates: Centres of doors and gates, each 2, metres.
    """

    plot: Plot
    house: shapely.Polygon
    gates: tuple[FloatArray, ...]


def place_enclosures(
    scene: Scene, plots: Sequence[Enclosed], around: Sequence[Plot], rules: EnclosureRules
) -> tuple[CityObject, ...]:
    """Returns the enclosures of plots as ``PlantCover`` or ``CityFurniture``.

    Args:
        scene: Scene of the chunk.
        plots: Plots with houses in the chunk.
        around: All plots near them: a side that two plots share is enclosed once.
        rules: Enclosure rules of the environment.
    """
    tree = shapely.STRtree([shapely.Polygon(plot.polygon) for plot in around])
    features = []
    for enclosed in plots:
        draws = Draws(scene.seed, "city", "enclosure", enclosed.plot.id)
        kind = draws.choice("kind", rules.kinds)
        height = round(draws.within("height", rules.height), 2)
        if kind == "none":
            continue
        lines = _lines(enclosed, around, tree, scene, rules)
        if lines:
            faces = [face for line in lines for face in _bodies(kind, height, line, scene)]
            material = draws.choice("material", rules.materials.get(kind, {"concrete": 1.0}))
            features.append(_feature(f"{kind}_{enclosed.plot.id}", kind, height, material, faces))
    return tuple(features)


def _lines(
    enclosed: Enclosed,
    around: Sequence[Plot],
    tree: shapely.STRtree,
    scene: Scene,
    rules: EnclosureRules,
) -> list[FloatArray]:
    """Lines of the enclosures: polylines, N_i x 2, with a point at every step."""
    inner = shapely.Polygon(enclosed.plot.polygon).buffer(-_INSET, join_style="mitre")
    if inner.is_empty or inner.geom_type != "Polygon":
        return []
    taken = [enclosed.house.buffer(_CLEARANCE, join_style="mitre")]
    feet = shapely.points(
        np.array([_foot(enclosed, gate) for gate in enclosed.gates]).reshape(-1, 2)
    )
    taken += shapely.buffer(feet, rules.gate / 2).tolist()
    taken += scene.taken.grown(inner, _CLEARANCE)
    for side in _shared(enclosed.plot, around, tree):
        taken.append(side.buffer(_INSET + 0.1, cap_style="flat"))
    left = inner.exterior.difference(shapely.union_all(taken))
    left = shapely.line_merge(left) if left.geom_type == "MultiLineString" else left
    lines = []
    for part in shapely.get_parts(left):
        if part.length >= _LEAST_LENGTH:
            open_line = shapely.get_coordinates(part.segmentize(_STEP))
            # An uninterrupted enclosure ends a step before its start.
            line = _simplified(open_line[:-1] if part.is_closed else open_line)
            if len(line) > 1 and not scene.road.near(line, _CLEARANCE).any():
                lines.append(line)
    return lines


def _foot(enclosed: Enclosed, gate: FloatArray) -> FloatArray:
    """Point on the frontage before a gate."""
    start, end = enclosed.plot.frontage
    along = (end - start) / np.hypot(*(end - start))
    into = np.array([-along[1], along[0]])
    foot: FloatArray = start + along * ((gate - start) @ along) + into * _INSET
    return foot


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


def _simplified(line: FloatArray) -> FloatArray:
    """Drops points so near to the previous point that the sides of a hedge would cross."""
    kept = [line[0]]
    for place in line[1:-1]:
        if min(np.hypot(*(place - kept[-1])), np.hypot(*(place - line[-1]))) > _LEAST_STEP:
            kept.append(place)
    return np.array([*kept, line[-1]])


def _feature(
    name: str, kind: str, height: float, material: str, faces: list[FloatArray]
) -> CityObject:
    facts: dict[str, Attribute] = {"template": kind, "material": material}
    geometry = {"lod2MultiSurface": as_polygons(faces)}
    if kind == "hedge":
        return CityObject(name, "PlantCover", {"averageHeight": height, **facts}, geometry=geometry)
    facts = {"function": _FENCE, "height": height, **facts}
    return CityObject(name, "CityFurniture", facts, geometry=geometry)


def _bodies(kind: str, height: float, line: FloatArray, scene: Scene) -> list[FloatArray]:
    ground = scene.ground.heights(line)
    if kind != "fence":
        return strip_body(line, _WIDTHS[kind], ground - _BELOW, ground + height)
    faces = []
    for share in (0.35, 0.9):
        rail = ground + share * height
        faces += strip_body(line, _WIDTHS[kind], rail, rail + _RAIL)
    for place, z in zip(line, ground.tolist(), strict=True):
        faces += post_body(place, _POST, z - _BELOW, z + height)
    return faces
