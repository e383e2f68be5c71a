"""Recipes of the commands `envgen-usd landuse ...` for networks of heights."""

from collections.abc import Callable
from pathlib import Path

from PIL import Image

from envgen_usd.errors import Issue
from envgen_usd.landuse.network.data.height_sample import HEIGHT_CELL, HeightSample
from envgen_usd.landuse.network.data.sample_cache import read_samples
from envgen_usd.landuse.network.heights.height_evaluation import (
    HeightFill,
    by_followed,
    by_height_network,
    by_mean,
    by_membrane,
    by_nearest,
    height_table,
    height_windows,
    score_heights,
)
from envgen_usd.landuse.network.heights.height_preview import height_sheet
from envgen_usd.landuse.network.heights.height_raster_samples import read_height_samples
from envgen_usd.landuse.network.heights.height_scenes import make_height_sample, make_height_scene
from envgen_usd.landuse.network.heights.network_land import HeightNetwork
from envgen_usd.landuse.network.training.weights_file import read_network

Progress = Callable[[str, int, int], None]


def drawn_heights(  # noqa: PLR0913, PLR0917 - what samples follow from
    cache: Path,
    data: Path | None,
    count: int,
    seed: int,
    progress: Progress,
    warn: Callable[[Issue], None],
) -> list[HeightSample]:
    """Ground truth of heights: generated land, or windows of a folder's elevation models.

    Raises:
        EnvgenError: An elevation model cannot be used.
    """
    # A cache may hold samples of an earlier version, with other cells.
    name, numbers = f"height_{HEIGHT_CELL:g}m_train_{seed}", range(count)
    samples = (
        read_height_samples(data, count, seed)
        if data
        else read_samples(cache, name, numbers, HeightSample, _make(seed), warn)
    )
    drawn = []
    for sample in samples:
        drawn.append(sample)
        progress("samples", len(drawn), count)
    return drawn


def height_scores(
    weights: Path, windows: int, seed: int, baselines: bool, progress: Progress
) -> str:
    """Measures a network of heights on unseen roads; returns a Markdown table.

    Raises:
        EnvgenError: The weights cannot be read.
    """
    ways: dict[str, HeightFill] = {"network": by_height_network(read_network(weights, "height"))}
    if baselines:
        ways = {
            "mean of the road": by_mean,
            "nearest road": by_nearest,
            "membrane": by_membrane,
            **ways,
            "hills that the road follows": by_followed,
        }
    truth = height_windows(windows, seed)
    scores = {}
    for name, way in ways.items():
        scores[name] = score_heights(truth, way)
        progress("unseen roads", len(scores), len(ways))
    return height_table(scores)


def height_preview(weights: Path, samples: int, seed: int, progress: Progress) -> Image.Image:
    """Draws height maps by a network beside the ground truth.

    Raises:
        EnvgenError: The weights cannot be read.
    """
    return height_sheet(HeightNetwork(weights), samples, seed, progress)


def _make(seed: int) -> Callable[[int], HeightSample]:
    return lambda number: make_height_sample(make_height_scene("train", number, seed))
