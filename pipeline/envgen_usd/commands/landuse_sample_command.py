"""The command `landuse sample`."""

from pathlib import Path
from typing import Annotated

import typer

from envgen_usd.commands.landuse_sheets import (
    Samples,
    check_sheet,
    draw_landuse_sheet,
    save_sheet,
)
from envgen_usd.commands.option_types import AnyArea, AnyCountry, Seed
from envgen_usd.commands.terminal_output import shown_progress
from envgen_usd.errors import EnvgenError
from envgen_usd.landuse.network.shipped_weights import find_weights


def sample(
    weights: Annotated[
        Path | None, typer.Argument(help="Weights (.safetensors); default: the shipped weights.")
    ] = None,
    *,
    preview: Annotated[Path, typer.Option(help="Image file to write, .png.")],
    country: AnyCountry = None,
    area: AnyArea = None,
    samples: Samples = 2,
    seed: Seed = 0,
) -> None:
    """Draws a sheet of landuse or height maps by a trained network."""
    from envgen_usd.landuse.network.training.weights_file import read_target

    check_sheet(preview)
    path = find_weights(weights)
    if read_target(path) == "height":
        from envgen_usd.recipe.height_runs import height_preview

        if country or area:
            raise EnvgenError("landuse sample: networks of heights take no --country and no --area")
        with shown_progress() as progress:
            save_sheet(height_preview(path, samples, seed, progress), preview)
        return
    from envgen_usd.landuse.network.network_provider import network_provider

    draw_landuse_sheet(network_provider(path), preview, (country, area), samples, seed)
