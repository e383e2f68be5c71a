"""Sheets of landuse along random roads."""

from collections.abc import Sequence

from PIL import Image

from envgen_usd.environment_files import known_environments, read_profile
from envgen_usd.errors import EnvgenError
from envgen_usd.landuse.landuse_preview import draw_landuse, draw_sheet
from envgen_usd.landuse.landuse_provider import LanduseProvider
from envgen_usd.landuse.network.data.landuse_scenes import TILES
from envgen_usd.landuse.network.data.road_layouts import KINDS, draw_layout
from envgen_usd.landuse.network.training.training_run import Progress
from envgen_usd.seeds import generator

Environment = tuple[str, str]
"""Country and area type."""


def environments(country: str | None, area: str | None) -> list[Environment]:
    """Environments of a country and an area type, or all environments.

    Raises:
        EnvgenError: There is no such environment.
    """
    every = [(c, a) for c, areas in known_environments().items() for a in areas]
    chosen = [(c, a) for c, a in every if country in (None, c) and area in (None, a)]
    if not chosen:
        names = ", ".join(f"{c} {a}" for c, a in every)
        raise EnvgenError(f"no environment {country or ''} {area or ''}; choose from {names}")
    return chosen


def preview_sheet(
    provider: LanduseProvider,
    chosen: Sequence[Environment],
    samples: int,
    seed: int,
    progress: Progress = lambda *_: None,
) -> Image.Image:
    """Draws landuse along roads of all layouts, with a row for each environment.

    Args:
        provider: Landuse source.
        chosen: Environments.
        samples: Number of maps of 2 x 2 chunks for each environment.
        seed: Random seed of roads and landuse.
        progress: Called with the progress of each step.
    """
    pictures = []
    for country, area in chosen:
        for number in range(samples):
            rng = generator(seed, "landuse", "preview", country, area, number)
            kind = KINDS[(number + int(rng.integers(len(KINDS)))) % len(KINDS)]
            surface = draw_layout(kind, rng)
            maps = provider.generate(surface, TILES, read_profile(country, area), seed + number)
            pictures.append((f"Country {country}, {area}: {kind}", draw_landuse(maps)))
            progress("maps", len(pictures), samples * len(chosen))
    return draw_sheet(pictures, samples)
