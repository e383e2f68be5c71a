"""An endless, seeded stream of ground truth by rules."""

from dataclasses import dataclass, replace
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from envgen_usd.chunks import CELL_SIZE, LANDUSE_CELLS, Chunk
from envgen_usd.environment_files import read_profile
from envgen_usd.landuse.landuse_rules import draw_landuse
from envgen_usd.landuse.network.data.class_channels import to_channels
from envgen_usd.landuse.network.data.environment_conditions import blend, describe
from envgen_usd.landuse.network.data.known_fields import RAW, StreetIndex, index_streets, raw_fields
from envgen_usd.landuse.network.data.road_layouts import KINDS, draw_layout
from envgen_usd.landuse.network.data.street_conditions import (
    draw_streets,
    fit_streets,
    street_sites,
    unknown_streets,
)
from envgen_usd.landuse.network.data.training_sample import Sample
from envgen_usd.landuse.plot_sites import draw_sites
from envgen_usd.landuse.roadside import find_roadsides
from envgen_usd.models.array_types import ByteArray
from envgen_usd.models.environment_profile import Profile
from envgen_usd.models.landuse import LanduseMap
from envgen_usd.models.road_surface import RoadSurface
from envgen_usd.seeds import generator

Split = Literal["train", "untold", "determined", "random"]

TILES = tuple(Chunk(x, y) for y in (0, 1) for x in (0, 1))
"""Chunks of a sample, row by row from the south."""
ENVIRONMENTS = (
    ("1", "industrial"),
    ("1", "residential"),
    ("2", "industrial"),
    ("2", "residential"),
)
"""Environments of the samples. Fixed, since shipped weights and their figures rest on them."""
HELD_OUT = frozenset(
    {
        ("tee", "1", "residential"),
        ("winding", "2", "industrial"),
        ("cross", "1", "industrial"),
        ("curve", "2", "residential"),
    }
)
"""Combinations of layout and environment that training never sees."""
TOLD, BLENDED = 0.75, 0.1
"""Shares of training samples with street fields, and of blended environments.

"""


@dataclass(frozen=True)
class LanduseSample(Sample):
    """Ground truth of four chunks, or of a raster.

    Attributes:
        classes: S x S `LanduseClass` values; row 0 is the south.
        plots: S x S plot numbers, 0 without a plot.
    """

    classes: ByteArray
    plots: NDArray[np.int32]
    CELLS: ClassVar[tuple[str, ...]] = ("classes", "plots")
    VECTOR: ClassVar[tuple[int, int]] = (RAW.index("normal_x"), RAW.index("normal_y"))

    @property
    def channels(self) -> ByteArray:
        """The network's channel of each cell."""
        return to_channels(self.classes, self.plots)


@dataclass(frozen=True)
class Scene:
    """Roads and environment of a sample.

    Attributes:
        surface: Roads.
        profile: Environment.
        kind: Kind of layout.
        told: True if the fields hold the requested plots of each street.
    """

    surface: RoadSurface
    profile: Profile
    kind: str
    told: bool


def make_scene(split: Split, number: int, seed: int) -> Scene:
    """Draws roads and environment of a sample; splits never share roads.

    The evaluation splits alternate between seen and held-out combinations. ``train`` and ``untold``
    are for training; the fields of ``untold`` never hold requested plots.
    """
    rng = generator(seed, "landuse", "sample", split, number)
    every = ENVIRONMENTS
    training = split in ("train", "untold")
    wanted = not training and number % 2 == 1
    while True:
        kind, environment = KINDS[rng.integers(len(KINDS))], every[rng.integers(len(every))]
        if ((kind, *environment) in HELD_OUT) == wanted:
            break
    profile = read_profile(*environment)
    if training and rng.uniform() < BLENDED:
        others = [read_profile(*every[n]) for n in rng.integers(len(every), size=2)]
        profile = blend((profile, others[0], others[1]))
    told = split == "determined" or (split == "train" and bool(rng.uniform() < TOLD))
    return Scene(draw_layout(kind, rng), profile, kind, told)


def make_sample(split: Split, number: int, seed: int, again: int = 0) -> LanduseSample:
    """Generates a sample.

    Args:
        split: Stream.
        number: Position in the stream.
        seed: Seed of the stream.
        again: Draw the rules again on the same roads, if they are random.
    """
    scene = make_scene(split, number, seed)
    times = 0 if scene.told else again
    draw = int(generator(seed, "landuse", "rules", split, number, times).integers(2**31))
    maps = _landuse(scene, draw)
    classes, plots = (
        np.block([[getattr(maps[tile], name) for tile in row] for row in (TILES[:2], TILES[2:])])
        for name in ("classes", "plots")
    )
    fields = sample_fields(scene, draw)
    return LanduseSample(fields, describe(scene.profile), classes, plots.astype(np.int32))


def sample_fields(scene: Scene, draw: int) -> NDArray[np.float16]:
    """Fields of a sample, with or without requested plots, `RAW` x 255 x 255."""
    middles = (2 * np.arange(LANDUSE_CELLS, dtype=np.float64) + 1) * CELL_SIZE
    return raw_fields(fields_index(scene, draw), middles, middles)


def fields_index(scene: Scene, draw: int) -> StreetIndex:
    """Index for the fields of a map.

    Without requested plots, roadsides keep the middle of the verge's range.
    """
    plots = scene.profile.plots
    if scene.told:
        asked = draw_streets(find_roadsides(scene.surface, plots, draw), plots, draw)
        streets = fit_streets(asked, scene.surface, plots)
    else:
        verge = sum(plots.verge) / 2
        sides = find_roadsides(scene.surface, replace(plots, verge=(verge, verge)), draw)
        streets = unknown_streets(sides, plots)
    return index_streets(scene.surface, streets, scene.told, (plots.wood, draw))


def _landuse(scene: Scene, draw: int) -> dict[Chunk, LanduseMap]:
    surface, profile = scene.surface, scene.profile
    sides = find_roadsides(surface, profile.plots, draw)
    # Blocks that are filled follow from all of the map, which a window does not see.
    if scene.told:
        sites = street_sites(draw_streets(sides, profile.plots, draw))
    else:
        sites = draw_sites(sides, profile.plots, draw)
    return draw_landuse(surface, TILES, profile, draw, (sides, sites))
