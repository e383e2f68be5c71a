"""The side of the road on which a map's traffic drives."""

from collections.abc import Sequence

import numpy as np
from scipy.spatial import cKDTree

from envgen_usd.errors import EnvgenError
from envgen_usd.models.array_types import FloatArray
from envgen_usd.places.osm_streets import Bounds, StreetExtract
from envgen_usd.places.street_tags import is_one_way

SIDES = ("auto", "right", "left")
"""What the user may say."""
_RINGS = frozenset({"roundabout", "circular"})
_APART = 25.0
"""Largest distance of the carriageways of a street, metres."""
_STEP = 10.0
"""Distance of the points at which they are compared, metres."""
_LEAST_POINTS = 10
"""Points beside an opposite carriageway from which they tell the side."""
_MAJORITY = 0.75
"""Least share of the roundabouts, or of such points, that agree."""
_METRES = 111_177.0
"""Length of a degree of latitude."""
_LEFT: Sequence[Bounds] = (
    (-11.0, 51.0, 1.78, 61.0),  # Great Britain, Ireland
    (-6.5, 49.8, 0.8, 51.0),
    (130.0, 30.0, 140.0, 39.0),  # Japan
    (139.3, 39.0, 145.8, 45.6),
    (123.0, 24.0, 132.0, 29.0),
    (112.0, -44.0, 154.5, -10.0),  # Australia
    (166.0, -47.5, 179.0, -34.0),  # New Zealand
    (12.0, -35.0, 36.0, -18.0),  # southern Africa
    (32.0, -11.5, 41.0, 3.0),  # Kenya, Tanzania
    (67.0, 6.0, 88.5, 27.5),  # India, Pakistan, Sri Lanka, Bangladesh
    (99.7, 1.2, 102.0, 17.0),  # Thailand, Malaysia
    (102.0, 1.15, 104.4, 6.0),
    (95.0, -11.0, 141.0, 1.15),  # Indonesia
    (32.2, 34.5, 34.6, 35.75),  # Cyprus
    (14.1, 35.7, 14.6, 36.1),  # Malta
    (-78.4, 17.7, -76.1, 18.6),  # Jamaica
    (113.83, 22.15, 114.4, 22.5),  # Hong Kong
    (113.52, 22.1, 113.6, 22.217),  # Macau
)
"""Boxes within countries with traffic on the left, degrees: no neighbour with traffic on the right
lies in any. What they leave out is decided by the map's streets."""


def left_hand_reason(extract: StreetExtract, said: str = "auto") -> str:
    """Why traffic drives on the left; empty where it drives on the right.

    1. What the user says.
    2. The tag ``driving_side`` of streets.
    3. The direction of roundabouts, then the sides of opposite carriageways.
    4. The place on Earth.

    Args:
        extract: The streets.
        said: One of `SIDES`.

    Raises:
        EnvgenError: It is none.
    """
    if said not in SIDES:
        raise EnvgenError(f"--driving-side {said}: unknown; choose from {', '.join(SIDES)}")
    if said != "auto":
        return "as --driving-side says" if said == "left" else ""
    tagged = [way.tags["driving_side"] for way in extract.ways if "driving_side" in way.tags]
    lefts = tagged.count("left")
    if 2 * lefts > len(tagged):
        return f"{lefts} streets have driving_side=left"
    rings, points = _roundabouts(extract), _carriageways(extract)
    for votes, least, what in (
        (rings, 1, "roundabouts lead clockwise"),
        (
            points,
            _LEAST_POINTS,
            "points of one-way streets have opposite traffic on their right",
        ),
    ):
        right, left = votes
        if right + left >= least and max(votes) >= _MAJORITY * (right + left):
            return f"{left} {what}" if left > right else ""
    west, south, east, north = extract.bounds
    lon, lat = (west + east) / 2.0, (south + north) / 2.0
    inside = any(w <= lon <= e and s <= lat <= n for w, s, e, n in _LEFT)
    return "as in the country at this place" if inside and not tagged else ""


def _metric(extract: StreetExtract, places: Sequence[tuple[float, float]]) -> FloatArray:
    """Places of a way in metres, true in shape."""
    scale = np.cos(np.radians((extract.bounds[1] + extract.bounds[3]) / 2.0))
    points: FloatArray = np.array(places, float) * [_METRES * scale, _METRES]
    return points


def _roundabouts(extract: StreetExtract) -> tuple[int, int]:
    """Number of roundabouts that lead counter-clockwise, as on the right, and clockwise."""
    counts = [0, 0]
    for way in extract.ways:
        if way.tags.get("junction") not in _RINGS or len(way.places) < 4:
            continue
        line = _metric(extract, way.places)
        steps = np.diff(line, axis=0)
        crosses = steps[:-1, 0] * steps[1:, 1] - steps[:-1, 1] * steps[1:, 0]
        turn = float(np.arctan2(crosses, (steps[:-1] * steps[1:]).sum(1)).sum())
        turn *= is_one_way(way.tags)
        if abs(turn) > np.pi / 4.0:
            counts[int(turn < 0.0)] += 1
    return counts[0], counts[1]


def _carriageways(extract: StreetExtract) -> tuple[int, int]:
    """Points of one-way streets with opposite traffic on their left, and on their right."""
    places, heads = [], []
    for way in extract.ways:
        flow = is_one_way(way.tags)
        if not flow or way.tags.get("junction") in _RINGS:
            continue
        line = _metric(extract, way.places)[::flow]
        steps = np.diff(line, axis=0)
        lengths = np.linalg.norm(steps, axis=1)
        ends = np.append(0.0, np.cumsum(lengths))
        at = np.arange(_STEP / 2.0, ends[-1], _STEP)
        segment = np.clip(np.searchsorted(ends, at, "right") - 1, 0, len(steps) - 1)
        ahead = steps[segment] / np.maximum(lengths[segment], 1e-9)[:, None]
        places.append(line[segment] + (at - ends[segment])[:, None] * ahead)
        heads.append(ahead)
    if not places:
        return 0, 0
    points, ways = np.concatenate(places), np.concatenate(heads)
    first, second = cKDTree(points).query_pairs(_APART, output_type="ndarray").reshape(-1, 2).T
    away = points[second] - points[first]
    across = ways[first, 0] * away[:, 1] - ways[first, 1] * away[:, 0]
    opposite = ((ways[first] * ways[second]).sum(1) < -0.8) & (np.abs(across) > 2.0)
    on_left, on_right = (np.unique(first[opposite & side]) for side in (across > 0.0, across < 0.0))
    both = np.intersect1d(on_left, on_right)
    return len(on_left) - len(both), len(on_right) - len(both)
