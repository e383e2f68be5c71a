"""Fields known everywhere: a cell's position relative to the roads, and street conditions."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from torch import Tensor

from envgen_usd.geometry.road_outline import Outline
from envgen_usd.landuse.network.data.street_conditions import Street
from envgen_usd.landuse.woodland import wood_level, wood_noise
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.road_surface import RoadSurface

OWN = ("along", "phase", "left", "offset", "depth", "frontage", "verge")
RAW = (
    *OWN,
    "normal_x",
    "normal_y",
    "bend",
    "open",
    "rival_phase",
    "rival_left",
    "rival_offset",
    "rival_depth",
    "rival_first",
    "distance",
    "height",
    "wood",
    "told",
)
"""Fields as they are stored.

Of the nearest street: along: arc length along the roadside, metres, modulo `LONGEST`. phase: the
same in plots, modulo one. left: plots from here to the end of the row. offset: distance behind the
roadside, metres. depth, frontage, verge: requested lengths, metres. normal: unit vector from the
road to the land. bend: curvature of the roadside, 1/m, positive towards the land. open: 1 if plots
are allowed.

Of the next open street: phase, left, offset and depth, and first: 1 if its plots take precedence
over those of the nearest street, -1 if not, 0 without a second street.

distance: distance to the road's outline, metres. height: height above the nearest point of the
road's centre, metres. wood: noise above the wood threshold. told: 1 if phase to verge and wood are
requested values, 0 if they are the middles of the environment's ranges.
"""
WAVELENGTHS = (8.0, 16.0, 32.0, 64.0, 128.0, 256.0)
"""Wavelengths of the sines and cosines of the position along the roadside, metres."""
LONGEST = WAVELENGTHS[-1]
"""Period of `along`, metres: a multiple of all wavelengths."""
HARMONICS = (1, 2, 4)
"""Multiples of the phase for sines and cosines."""
FIELDS = 2 * len(WAVELENGTHS) + 2 * len(HARMONICS) + 29
"""Number of channels of `expand`."""
SPACING = 1.0
"""Distance between search points of a roadside, metres; a larger value is faster and coarser."""
REACH = 150.0
"""Distance at which a roadside loses its influence, metres; a larger value extends it."""
FAR = 4.0
"""Distance factor of roadsides that a cell lies before or beside, instead of behind.

A larger value favours roadsides with the cell behind them.
"""
NO_WOOD = -4.0
"""Wood level without wood."""


@dataclass(frozen=True)
class StreetIndex:
    """All streets of a map, sampled for nearest-point queries.

    Attributes:
        streets: Streets in order of precedence of their plots.
        samples: For each street S x 6: x, y, normal x, normal y, along, bend.
        trees: Search trees of the samples.
        outline: Outline of the road.
        road: Search tree of the reference lines' points.
        heights: Heights of these points, metres.
        told: True if streets hold requested values, false for middles of ranges.
        wood: Share of wood on the free land, and the seed of the noise.
    """

    streets: Sequence[Street]
    samples: Sequence[FloatArray]
    trees: Sequence[cKDTree]
    outline: Outline
    road: cKDTree
    heights: FloatArray
    told: bool
    wood: tuple[float, int]


def index_streets(
    surface: RoadSurface, streets: Sequence[Street], told: bool, wood: tuple[float, int]
) -> StreetIndex:
    """Prepares a map for `raw_fields`; see `StreetIndex` for the arguments."""
    samples = [_samples(street) for street in streets]
    points = np.concatenate([line.points for line in surface.roads])
    return StreetIndex(
        streets,
        samples,
        [cKDTree(part[:, :2]) for part in samples],
        Outline.of(surface),
        cKDTree(points[:, :2]),
        points[:, 2],
        told,
        wood,
    )


def raw_fields(index: StreetIndex, x: FloatArray, y: FloatArray) -> NDArray[np.float16]:
    """Fields at a grid of points.

    Args:
        index: Index of the map.
        x: W, metres, road frame, ascending.
        y: H, metres, ascending.

    Returns:
        `RAW` x H x W; row 0 is the south.
    """
    places = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    nearest, rival = _two_nearest(index, places)
    height = index.heights[index.road.query(places)[1]] - np.median(index.heights)
    wood = np.full(len(places), NO_WOOD)
    if index.told and index.wood[0] > 0.0:
        wood = (wood_noise(x, y, index.wood[1]) - wood_level(index.wood[0])).ravel()
    rest = (index.outline.nearest(places)[0], height, wood, np.full(len(places), index.told))
    stacked = np.stack([*nearest, *rival, *rest])
    stacked = np.clip(stacked, -LONGEST, LONGEST).reshape(len(RAW), len(y), len(x))
    fields: NDArray[np.float16] = stacked.astype(np.float16)
    return fields


def expand(raw: Tensor) -> Tensor:
    """Converts stored fields to the network's input: B x `RAW` x H x W to B x `FIELDS` x H x W."""
    part = dict(zip(RAW, raw.float().unbind(1), strict=True))
    turns = [part["along"] / wavelength for wavelength in WAVELENGTHS]
    turns += [part["phase"] * harmonic for harmonic in HARMONICS] + [part["rival_phase"]]
    waves = [f(2 * torch.pi * turn) for turn in turns for f in (torch.sin, torch.cos)]
    return torch.stack([*waves, *_site_fields(part), *_rival(part), *_rest(part)], dim=1)


def _site_fields(part: dict[str, Tensor]) -> list[Tensor]:
    back = part["depth"] - part["offset"]
    return [
        part["left"].clamp(-1.0, 2.0),
        torch.tanh(part["left"] * part["frontage"] / 4),
        (part["offset"] / 50).clamp(-1.0, 2.0),
        torch.tanh(part["offset"] / 4),
        (back / 40).clamp(-1.0, 2.0),
        torch.tanh(back / 4),
        torch.log((part["depth"] + 1) / 40),
        torch.log((part["frontage"] + 1) / 20),
        torch.log((part["verge"] + 0.2) / 2),
        part["normal_x"],
        part["normal_y"],
        (part["bend"] * 50).clamp(-1.0, 1.0),
        part["open"],
    ]


def _rival(part: dict[str, Tensor]) -> list[Tensor]:
    back = part["rival_depth"] - part["rival_offset"]
    return [
        part["rival_left"].clamp(-1.0, 2.0),
        torch.tanh(part["rival_left"] * 4),
        (part["rival_offset"] / 50).clamp(-1.0, 2.0),
        torch.tanh(part["rival_offset"] / 4),
        (back / 40).clamp(-1.0, 2.0),
        torch.tanh(back / 4),
        part["rival_first"],
    ]


def _rest(part: dict[str, Tensor]) -> list[Tensor]:
    return [
        (part["distance"] / 50).clamp(0.0, 2.0),
        torch.tanh(part["distance"] / 4),
        torch.exp(-part["distance"] / 2),
        (part["height"] / 10).clamp(-1.0, 1.0),
        part["wood"].clamp(-2.0, 2.0),
        torch.tanh(part["wood"] * 6),
        part["told"],
    ]


def _samples(street: Street) -> FloatArray:
    """S x 6 values along a roadside, see `StreetIndex`."""
    length = street.side.length
    along = np.linspace(0.0, length, max(2, int(length / SPACING) + 1))
    points, normals = street.side.at(along)
    angle = np.unwrap(np.arctan2(normals[:, 1], normals[:, 0]))
    return np.column_stack([points, normals, along, np.gradient(angle, along)])


def _two_nearest(index: StreetIndex, places: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Values of the nearest street (11 x P) and of the next open street (5 x P) of each point."""
    closest, rival = np.zeros((11, len(places))), np.zeros((5, len(places)))
    closest[3], rival[2], closest[4:7] = REACH, REACH, 1.0
    nearest = np.full((2, len(places)), np.inf)
    low, high = places.min(axis=0) - REACH, places.max(axis=0) + REACH
    for number, (street, samples) in enumerate(zip(index.streets, index.samples, strict=True)):
        if not np.any(np.all((samples[:, :2] > low) & (samples[:, :2] < high), axis=1)):
            continue
        hits = index.trees[number].query(places, distance_upper_bound=REACH)
        distance, sample = np.asarray(hits[0]), np.asarray(hits[1])
        reached = np.flatnonzero(np.isfinite(distance))
        near = samples[sample[reached]]
        far, values = _seen_from(street, near, places[reached], distance[reached])
        beaten = far < nearest[0, reached]
        # The previous nearest street becomes the rival, if plots may open onto it.
        moved = reached[beaten & (closest[10, reached] > 0)]
        rival[:, moved] = np.stack([*closest[1:5, moved], np.ones(len(moved))])
        nearest[1, moved] = nearest[0, moved]
        first = reached[beaten]
        closest[:, first], nearest[0, first] = values[:, beaten], far[beaten]
        second = ~beaten & (far < nearest[1, reached]) & street.side.open
        place = reached[second]
        rival[:, place] = np.stack([*values[1:5, second], -np.ones(len(place))])
        nearest[1, place] = far[second]
    return closest, rival


def _seen_from(
    street: Street, sample: FloatArray, places: FloatArray, distance: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Distance of a street from points, and its values at their nearest samples.

    Args:
        street: Street.
        sample: P x 6, nearest sample, see `StreetIndex`.
        places: P x 2.
        distance: P, distance to the sample, metres.

    Returns:
        P distances, larger for points that do not lie behind the roadside; 11 x P values.
    """
    away, normal = places - sample[:, :2], sample[:, 2:4]
    along = sample[:, 4] + away[:, 0] * normal[:, 1] - away[:, 1] * normal[:, 0]
    offset = np.sum(away * normal, axis=1)
    given = (street.frontage, street.side.verge, float(street.side.open))
    frontage, verge, is_open = np.broadcast_to(np.array(given)[:, None], (3, len(places)))
    values = [
        along % LONGEST,
        street.phase(along) % 1.0,
        np.clip(street.left(along), -8.0, 8.0),
        offset,
        street.depth(along),
        frontage,
        verge,
        *normal.T,
        sample[:, 5],
        is_open,
    ]
    behind = offset > 0.5 * distance
    return np.where(behind, distance, FAR * distance + 10.0), np.stack(values)
