"""Recipes of the commands `envgen-usd landuse ...` for networks of landuse."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

from envgen_usd.errors import EnvgenError, Issue
from envgen_usd.landuse.network.data.landuse_scenes import LanduseSample, Split, make_sample
from envgen_usd.landuse.network.data.sample_cache import read_samples
from envgen_usd.landuse.network.hole_filling import PASSES, schedule
from envgen_usd.landuse.network.model.network_config import (
    NetworkConfig,
    TrainConfig,
    article,
    diffusion,
    small,
)
from envgen_usd.landuse.network.tasks.height_task import HEIGHT_GAIN, HEIGHT_RATE
from envgen_usd.landuse.network.tasks.known_tasks import inputs_of
from envgen_usd.landuse.network.tasks.network_task import Target
from envgen_usd.landuse.network.tasks.place_task import PLACE_RATE
from envgen_usd.landuse.network.training.baselines import by_distance, by_majority, by_rules
from envgen_usd.landuse.network.training.landuse_evaluation import (
    Fill,
    Window,
    by_network,
    evaluation_windows,
    score,
    table,
)
from envgen_usd.landuse.network.training.weights_file import read_network

SCATTERED = 0.85
"""Share of the windows of masked diffusion with scattered known cells; the others are those of its
first pass. A larger value learns the first cells more slowly."""
HEIGHT_BATCH = 16
"""Windows of heights in a step; a larger value learns more steadily, in fewer steps."""
Progress = Callable[[str, int, int], None]


def network_sizes(name: str, target: Target, *, streets: bool) -> NetworkConfig:
    """Returns the layer sizes of a network architecture.

    Args:
        name: ``small``, ``article``, ``unet`` or ``diffusion``.
        target: ``landuse``, ``height`` or ``place``.
        streets: True if the training maps hold street fields; rasters do not.

    Raises:
        EnvgenError: The architecture does not support heights.
    """
    if name == "diffusion" and target == "height":
        raise EnvgenError("--network diffusion: generates classes, not heights")
    make = {"article": article, "diffusion": diffusion}.get(name, small)
    streets = streets and target == "landuse"
    sizes = replace(make(*inputs_of(target)), streets=streets, target=target)
    if target == "height":
        sizes = replace(sizes, output_gain=HEIGHT_GAIN)
    return replace(sizes, kind="unet") if name == "unet" else sizes


def training_figures(
    sizes: NetworkConfig, wished: Mapping[str, float | None], size: int, seed: int
) -> TrainConfig:
    """Returns the training hyperparameters for a network of these sizes.

    Args:
        sizes: Layer sizes of the network.
        wished: The user's hyperparameters; `None` means the default.
        size: Largest side of a window, cells.
        seed: Random seed of the run.
    """
    given = {name: value for name, value in wished.items() if value is not None}
    if sizes.target == "height":
        # A square of cells of heights is small, and its course follows from all of its streets.
        batch = min(HEIGHT_BATCH, int(given.get("images", HEIGHT_BATCH)))
        given |= {"rate": HEIGHT_RATE, "small": 0.0, "batch": batch, "scattered": 0.0}
    if sizes.target == "place":
        given["rate"] = PLACE_RATE
    if sizes.passes > 1:
        # Each smoothed class would be sampled now and then, as a speck.
        given |= {"scattered": SCATTERED, "smoothing": 0.0}
    return TrainConfig(size=size // 64 * 64, seed=seed, **given)  # type: ignore[arg-type]


def drawn_landuse(  # noqa: PLR0913, PLR0917 - what samples follow from
    cache: Path,
    sizes: NetworkConfig,
    count: int,
    seed: int,
    progress: Progress,
    warn: Callable[[Issue], None],
) -> list[LanduseSample]:
    """Ground truth by rules for a network of these sizes; cached in a folder."""
    stream: Split = "train" if sizes.passes == 1 else "untold"
    samples, make = [], partial(make_sample, stream, seed=seed)
    name, numbers = f"{stream}_{seed}", range(count)
    for sample in read_samples(cache, name, numbers, LanduseSample, make, warn):
        samples.append(sample)
        progress("samples", len(samples), count)
    return samples


def landuse_scores(
    weights: Path,
    split: Split,
    counts: tuple[int, int, int],
    rows: tuple[bool, bool],
    progress: Progress,
) -> str:
    """Measures a network on a split; returns a Markdown table.

    Args:
        weights: Weights file of the network.
        split: Split of the windows.
        counts: Number of windows, number of draws, and random seed of the windows.
        rows: Whether the table lists the baselines, and each layout.
        progress: Called with the progress of each step.

    Raises:
        EnvgenError: The weights cannot be read.
    """
    windows, draws, seed = counts
    network = read_network(weights, "landuse")
    passes = network.config.passes
    if passes > 1 and split == "determined":
        return "Masked diffusion takes no street fields, so it has no determined split."
    provider = by_network(network, schedule(passes), ask=passes == 1)
    truth = evaluation_windows(split, windows, seed)
    ways: dict[str, tuple[Fill, int]] = {"network": (provider, draws)}
    if split == "random" and passes == 1:
        ways["network, no requested plots"] = (by_network(network, PASSES, ask=False), 2)
    if rows[0]:
        ways = {**_baselines(len(truth), seed), **ways}
    scores = {}
    for done, (name, (way, count)) in enumerate(ways.items()):
        scores[name] = score(truth, way, count)
        progress(split, done + 1, len(ways))
    if rows[1]:
        scores |= {kind: score(those, provider, 1) for kind, those in _by_layout(truth).items()}
    return table(scores)


def _by_layout(truth: Sequence[Window]) -> dict[str, list[Window]]:
    kinds = sorted({one.scene.kind for one in truth})
    return {kind: [one for one in truth if one.scene.kind == kind] for kind in kinds}


def _baselines(count: int, seed: int) -> dict[str, tuple[Fill, int]]:
    maps = [make_sample("train", number, seed) for number in range(count)]
    return {
        "rules, drawn again": (by_rules, 2),
        "majority class": (by_majority(maps), 1),
        "lookup by distance": (by_distance(maps), 1),
    }
