"""What is known everywhere: where a cell lies seen from the road."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from torch import Tensor

from envgen_usd.geometry.outline import Outline
from envgen_usd.landuse.roadside import Roadside
from envgen_usd.models.arrays import FloatArray
from envgen_usd.models.profile import PlotRules
from envgen_usd.models.surface import RoadSurface

RAW = (
    "along",
    "phase",
    "left",
    "offset",
    "depth",
    "distance",
    "normal_x",
    "normal_y",
    "bend",
    "height",
    "open",
)
"""Fields as they are stored.

along: metres along the nearest roadside. phase: the same, in plots of middle width. left: plots of
middle width from here to the roadside's end. offset: metres behind the roadside, to the land.
depth: the same, in plots of middle depth. distance: metres to the road's outline. normal: unit
vector from the road to the land. bend: curvature of the roadside in 1/m, positive where it turns
towards the land. height: metres above the middle of the road. open: 1 where plots may be.
"""
WAVELENGTHS = (8.0, 16.0, 32.0, 64.0, 128.0, 256.0)
"""Metres, of the sines and cosines of the place along the roadside."""
FIELDS = 2 * len(WAVELENGTHS) + 13
"""Channels that `expand` makes."""
SPACING = 1.0
"""Metres between the places of a roadside that are searched."""


@dataclass(frozen=True)
class RoadsideIndex:
    """All roadsides of a map, sampled for nearest-place queries.

    Attributes:
        tree: Over the samples.
        values: S x 8: x, y, normal x, normal y, along, length, bend, open.
        outline: Where road and ground meet.
        road: Search tree of the reference lines' points, with their heights.
        heights: Metres.
        rules: Plots of the environment.
    """

    tree: cKDTree
    values: FloatArray
    outline: Outline
    road: cKDTree
    heights: FloatArray
    rules: PlotRules


def index_roadsides(
    surface: RoadSurface, roadsides: Sequence[Roadside], rules: PlotRules
) -> RoadsideIndex:
    """Prepares a map for `raw_fields`; there must be a roadside."""
    values = np.concatenate([_samples(side) for side in roadsides])
    points = np.concatenate([line.points for line in surface.roads])
    return RoadsideIndex(
        cKDTree(values[:, :2]),
        values,
        Outline.of(surface),
        cKDTree(points[:, :2]),
        points[:, 2],
        rules,
    )


def raw_fields(index: RoadsideIndex, x: FloatArray, y: FloatArray) -> NDArray[np.float32]:
    """Fields at a grid of places.

    Args:
        index: The map.
        x: W, metres, road frame.
        y: H, metres.

    Returns:
        `RAW` x H x W; row 0 is the south.
    """
    places = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    near = np.asarray(index.tree.query(places)[1])
    sample = index.values[near]
    away, normal = places - sample[:, :2], sample[:, 2:4]
    along = sample[:, 4] + away[:, 0] * normal[:, 1] - away[:, 1] * normal[:, 0]
    offset = np.sum(away * normal, axis=1)
    rules = index.rules
    frontage, depth = sum(rules.frontage) / 2, sum(rules.depth) / 2
    distance = index.outline.nearest(places)[0]
    height = index.heights[index.road.query(places)[1]] - np.median(index.heights)
    fields = [along, along / frontage, (sample[:, 5] - along) / frontage, offset, offset / depth]
    stacked = np.stack([*fields, distance, *normal.T, sample[:, 6], height, sample[:, 7]])
    return stacked.reshape(len(RAW), len(y), len(x)).astype(np.float32)


def expand(raw: Tensor) -> Tensor:
    """Turns stored fields into the network's input: B x `RAW` x H x W to B x `FIELDS` x H x W."""
    part = dict(zip(RAW, raw.unbind(1), strict=True))
    turns = [part["along"] / wavelength for wavelength in WAVELENGTHS] + [part["phase"]]
    waves = [f(2 * torch.pi * turn) for turn in turns for f in (torch.sin, torch.cos)]
    rest = [
        part["left"].clamp(0.0, 2.0) - 1,
        (part["offset"] / 50).clamp(-1.0, 2.0),
        torch.tanh(part["offset"] / 4),
        part["depth"].clamp(-1.0, 3.0) - 1,
        (part["distance"] / 50).clamp(0.0, 2.0),
        torch.exp(-part["distance"] / 3),
        part["normal_x"],
        part["normal_y"],
        (part["bend"] * 50).clamp(-1.0, 1.0),
        (part["height"] / 10).clamp(-1.0, 1.0),
        part["open"],
    ]
    return torch.stack([*waves, *rest], dim=1)


def _samples(side: Roadside) -> FloatArray:
    """S x 8 values along one roadside, see `RoadsideIndex`."""
    count = max(2, int(side.length / SPACING) + 1)
    along = np.linspace(0.0, side.length, count)
    points, normals = side.at(along)
    angle = np.unwrap(np.arctan2(normals[:, 1], normals[:, 0]))
    bend = np.gradient(angle, along)
    rest = np.broadcast_to([side.length, float(side.open)], (count, 2))
    return np.column_stack([points, normals, along, rest[:, 0], bend, rest[:, 1]])
