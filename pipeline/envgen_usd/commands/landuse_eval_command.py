"""The command `landuse eval`."""

from pathlib import Path
from typing import Annotated

import typer

from envgen_usd.commands.terminal_output import shown_progress
from envgen_usd.idle_options import refuse_idle
from envgen_usd.landuse.network.shipped_weights import find_weights

_DRAWS = 8
"""Samples of each window; a larger value measures the diversity more exactly."""


def evaluate(
    weights: Annotated[
        Path | None, typer.Argument(help="Weights (.safetensors); default: the shipped weights.")
    ] = None,
    *,
    windows: Annotated[int, typer.Option(min=1, help="Windows to evaluate in each split.")] = 10,
    draws: Annotated[int, typer.Option(min=1, help="Samples drawn for each window.")] = _DRAWS,
    baselines: Annotated[
        bool, typer.Option(help="Also measure the baselines: rules, majority class and lookup.")
    ] = True,
    by_layout: Annotated[
        bool, typer.Option("--by-layout", help="Also list the scores of each road layout.")
    ] = False,
    seed: Annotated[int, typer.Option(help="Random seed of the windows.")] = 0,
) -> None:
    """Measures a network on unseen roads and prints the scores as Markdown."""
    from envgen_usd.landuse.network.training.landuse_evaluation import SPLITS
    from envgen_usd.landuse.network.training.weights_file import read_target
    from envgen_usd.recipe.landuse_runs import landuse_scores

    path = find_weights(weights)
    with shown_progress() as progress:
        if read_target(path) == "height":
            from envgen_usd.recipe.height_runs import height_scores

            given = {"--draws": draws != _DRAWS, "--by-layout": by_layout}
            refuse_idle(given, "with a network of heights")
            print(f"\nheights, {windows} windows\n")
            print(height_scores(path, windows, seed, baselines, progress))
            return
        for split in SPLITS:
            counts = (windows, draws, seed)
            scores = landuse_scores(path, split, counts, (baselines, by_layout), progress)
            print(f"\n{split} split, {windows} windows, best and diversity of {draws} draws\n")
            print(scores)
