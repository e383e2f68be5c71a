"""The command `landuse train`."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from envgen_usd.commands.option_types import Seed
from envgen_usd.commands.terminal_output import print_issues, shell_command, shown_progress
from envgen_usd.errors import EnvgenError, Issue
from envgen_usd.idle_options import refuse_idle
from envgen_usd.output_files import check_output_folder

if TYPE_CHECKING:
    from envgen_usd.landuse.network.data.training_sample import Sample
    from envgen_usd.landuse.network.tasks.network_task import Target

NETWORKS = ("small", "article", "unet", "diffusion")
"""Network architectures for training."""
TARGETS = ("landuse", "height")
"""Quantities that a network learns."""


def train(
    *,
    out: Annotated[
        Path,
        typer.Option(
            help="Run folder for weights, training state, curves and images; resumes a run."
        ),
    ],
    target: Annotated[
        str, typer.Option(help=f"Quantity to learn: {', '.join(TARGETS)}.")
    ] = "landuse",
    network: Annotated[str, typer.Option(help=f"Architecture: {', '.join(NETWORKS)}.")] = "small",
    images: Annotated[int | None, typer.Option(min=1, help="Training windows in total.")] = None,
    size: Annotated[
        int | None, typer.Option(min=64, help="Side length of a window, cells.")
    ] = None,
    adversarial: Annotated[
        float | None,
        typer.Option(min=0.0, help="Weight of the adversarial loss; 0 trains without a critic."),
    ] = None,
    samples: Annotated[
        int | None,
        typer.Option(
            min=1, help="Generated maps; default: 700 of 2 x 2 chunks, heights: 1000 of 4 x 4."
        ),
    ] = None,
    cache: Annotated[
        Path | None, typer.Option(help="Folder that caches the generated maps.")
    ] = None,
    data: Annotated[
        Path | None, typer.Option(help="Train on the label rasters (heights: DEMs) of this folder.")
    ] = None,
    places: Annotated[
        list[Path] | None,
        typer.Option(help="Train on a file of `landuse places`; several are joined."),
    ] = None,
    classes: Annotated[
        Path | None, typer.Option(help="TOML file that maps raster values to class names.")
    ] = None,
    seed: Seed = 0,
) -> None:
    """Trains a network; the same command resumes an interrupted run."""
    from envgen_usd.landuse.network.data.place_sample import read_place_samples
    from envgen_usd.landuse.network.data.raster_samples import read_raster_samples
    from envgen_usd.landuse.network.training.training_run import Run
    from envgen_usd.landuse.network.training.training_run import train as run
    from envgen_usd.recipe.landuse_runs import (
        drawn_landuse,
        network_sizes,
        training_figures,
    )

    _check(target, network)
    if classes and (not data or target == "height"):
        raise EnvgenError("landuse train: --classes needs --data with label rasters")
    if places and (data or target == "height"):
        raise EnvgenError("landuse train: --places takes neither --data nor --target height")
    if places or data:
        maps_given = places or target == "landuse"
        idle = {"--cache": cache, "--samples": samples if maps_given else None}
        refuse_idle(idle, "with --places" if places else "with --data")
    check_output_folder(out)
    wanted: Target = "place" if places else "height" if target == "height" else "landuse"
    sizes = network_sizes(network, wanted, streets=not data)
    issues: list[Issue] = []
    with shown_progress() as progress:
        folder = cache or out / "samples"
        maps: Sequence[Sample]
        if target == "height":
            from envgen_usd.recipe.height_runs import drawn_heights

            maps = drawn_heights(folder, data, samples or 1000, seed, progress, issues.append)
        elif places:
            maps = [one for path in places for one in read_place_samples(path)]
        elif data:
            maps = read_raster_samples(data, classes)
        else:
            maps = drawn_landuse(folder, sizes, samples or 700, seed, progress, issues.append)
        side = min(one.side for one in maps)
        wished = {"images": images, "adversarial": adversarial}
        figures = training_figures(sizes, wished, min(size or 256, side), seed)
        weights = run(Run(out), maps, sizes, figures, progress, issues.append)
    print_issues(tuple(issues))
    print(f"weights: {weights}")
    if not places:
        print(f"next:    {shell_command('landuse', 'eval', weights)}")


def _check(target: str, network: str) -> None:
    if target not in TARGETS:
        raise EnvgenError(f"--target {target}: unknown; choose from {', '.join(TARGETS)}")
    if network not in NETWORKS:
        raise EnvgenError(f"--network {network}: unknown; choose from {', '.join(NETWORKS)}")
