"""Railways on the land: two rails on sleepers, closed bodies."""

from collections.abc import Sequence

import numpy as np
import shapely

from envgen_usd.chunks import snap
from envgen_usd.city.ground_heights import Ground
from envgen_usd.city.plots.strip_bodies import as_polygons, mitres, strip_body
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.attribute_values import Attribute
from envgen_usd.models.city_model import CityObject
from envgen_usd.models.polygon_arrays import Polygons

GAUGE = 1.435
"""Distance between the heads of the rails, metres."""
_HEAD = 0.07
"""Width of a rail, metres."""
_RAIL = (0.1, 0.29)
"""Heights of a rail's foot and top above the ground, metres."""
_SLEEPER = (2.6, 0.26)
"""Length across the track and width of a sleeper, metres."""
_SLEEPER_HEIGHTS = (-0.08, 0.12)
"""Heights of a sleeper's underside and top above the ground, metres."""
SPACING = 0.65
"""Distance of sleepers, metres; a larger value gives fewer."""
_SIDES = np.array(
    [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]
)
"""Corners of a box's faces, outwards: below 0 to 3, above 4 to 7."""
# SIG3D code list CityFurniture_function: railway signal and equipment have no track of their own.
_OTHERS = "9999"


def railway(name: str, lines: Sequence[FloatArray], ground: Ground) -> tuple[CityObject, ...]:
    """Returns the rails and the sleepers of a track.

    Args:
        name: Beginning of their ids.
        lines: Middle lines, N_i x 2, metres.
        ground: Heights of the ground.
    """
    facts: dict[str, Attribute] = {"function": _OTHERS, "template": "rail"}
    rails = [face for line in lines for face in _rails(line, ground)]
    bodies = {
        "rails": (as_polygons(rails), "metal_dark"),
        "sleepers": (_sleepers(lines, ground), "concrete"),
    }
    return tuple(
        CityObject(
            f"{part}_{name}",
            "CityFurniture",
            {**facts, "material": material},
            geometry={"lod2MultiSurface": polygons},
        )
        for part, (polygons, material) in bodies.items()
    )


def _rails(line: FloatArray, ground: Ground) -> list[FloatArray]:
    """Faces of both rails; they are level across the track."""
    land = ground.heights(line)
    faces = []
    for side in (-1.0, 1.0):
        rail = line + side * (GAUGE + _HEAD) / 2.0 * mitres(line)
        faces += strip_body(rail, _HEAD, land + _RAIL[0], land + _RAIL[1])
    return faces


def _sleepers(lines: Sequence[FloatArray], ground: Ground) -> Polygons:
    """Boxes across the track."""
    middles, headings = [], []
    for line in lines:
        path = shapely.LineString(line)
        places = np.arange(SPACING / 2.0, max(path.length, SPACING), SPACING)
        ends = [
            shapely.get_coordinates(shapely.line_interpolate_point(path, places + reach))
            for reach in (-0.1, 0.1)
        ]
        middles.append((ends[0] + ends[1]) / 2.0)
        headings.append(ends[1] - ends[0])
    middle, along = np.concatenate(middles), np.concatenate(headings)
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-9)
    across = np.column_stack([-along[:, 1], along[:, 0]])
    half = _SLEEPER[0] / 2.0 * across, _SLEEPER[1] / 2.0 * along
    corners = np.stack(
        [middle + u * half[0] + v * half[1] for u, v in ((1, -1), (-1, -1), (-1, 1), (1, 1))],
        axis=1,
    )
    land = np.repeat(ground.heights(middle)[:, None], 4, axis=1)
    low, high = (
        np.concatenate([corners, (land + height)[:, :, None]], axis=2)
        for height in _SLEEPER_HEIGHTS
    )
    points = snap(np.concatenate([low, high], axis=1)[:, _SIDES].reshape(-1, 3))
    count = 6 * len(middle)
    return Polygons(
        points, np.arange(0, 4 * count + 1, 4, dtype=np.int64), np.arange(count + 1, dtype=np.int64)
    )
