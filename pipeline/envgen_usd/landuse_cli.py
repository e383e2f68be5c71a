"""The commands `envgen-usd landuse ...`: ground truth, training, evaluation, sampling."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from envgen_usd.errors import EnvgenError
from envgen_usd.landuse.network.weights import find_weights
from envgen_usd.printing import Bars, progress_bars

if TYPE_CHECKING:
    from PIL import Image

    from envgen_usd.landuse.network.sample import Sample
    from envgen_usd.landuse.provider import LanduseProvider

app = typer.Typer(
    name="landuse",
    help="Landuse: ground truth by rules, and the network that learns from it.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)
Seed = Annotated[int, typer.Option(help="Every random draw follows from it.")]
Country = Annotated[str | None, typer.Option(help="Country; default: all environments.")]
Area = Annotated[str | None, typer.Option(help="Area type; default: all environments.")]
Samples = Annotated[int, typer.Option(min=1, help="Maps of each environment.")]
NETWORKS = ("small", "article", "unet", "diffusion")
"""Networks that can be trained."""
TARGETS = ("landuse", "height")
"""What they can be trained to make."""


@app.command()
def rules(
    *,
    preview: Annotated[Path, typer.Option(help="Picture to draw, .png.")],
    country: Country = None,
    area: Area = None,
    samples: Samples = 2,
    seed: Seed = 0,
) -> None:
    """Draws a sheet of landuse by rules: the ground truth."""
    from envgen_usd.landuse.rules import RuleProvider  # noqa: PLC0415 - starts fast without it

    _draw_sheet(RuleProvider(), preview, (country, area), samples, seed)


@app.command()
def sample(  # noqa: PLR0913 - one for each option
    weights: Annotated[Path | None, typer.Argument(help="Weights; default: those shipped.")] = None,
    *,
    preview: Annotated[Path, typer.Option(help="Picture to draw, .png.")],
    country: Country = None,
    area: Area = None,
    samples: Samples = 2,
    seed: Seed = 0,
) -> None:
    """Draws a sheet of landuse by a trained network, on the roads of `rules`; or of heights."""
    from envgen_usd.landuse.network.checkpoint import read_target  # noqa: PLC0415

    path = find_weights(weights)
    if read_target(path) == "height":
        from envgen_usd.height_commands import height_preview  # noqa: PLC0415

        if country or area:
            raise EnvgenError("landuse sample: heights know no --country and no --area")
        with progress_bars() as progress:
            _save(height_preview(path, samples, seed, Bars(progress)), preview)
        return
    from envgen_usd.landuse.network.provider import NetworkProvider  # noqa: PLC0415

    _draw_sheet(NetworkProvider(path), preview, (country, area), samples, seed)


@app.command()
def train(  # noqa: PLR0913 - one for each option
    *,
    out: Annotated[Path, typer.Option(help="Folder for weights, state, curves and pictures.")],
    target: Annotated[str, typer.Option(help=f"One of {', '.join(TARGETS)}.")] = "landuse",
    network: Annotated[str, typer.Option(help=f"One of {', '.join(NETWORKS)}.")] = "small",
    images: Annotated[int | None, typer.Option(min=1, help="Windows to see.")] = None,
    size: Annotated[int | None, typer.Option(min=64, help="Cells a side of a window.")] = None,
    adversarial: Annotated[
        float | None, typer.Option(min=0.0, help="Weight of the critic's loss.")
    ] = None,
    samples: Annotated[
        int | None, typer.Option(min=1, help="Maps of 2 x 2 chunks; default: 700, heights: 220.")
    ] = None,
    cache: Annotated[Path | None, typer.Option(help="Folder for the maps that are drawn.")] = None,
    data: Annotated[
        Path | None, typer.Option(help="Folder of label rasters (heights: DEMs), not rules.")
    ] = None,
    classes: Annotated[Path | None, typer.Option(help="TOML naming their values.")] = None,
    seed: Seed = 0,
) -> None:
    """Trains a network; started again, it goes on where it stopped."""
    from envgen_usd.landuse.network.rasters import read_raster_samples  # noqa: PLC0415
    from envgen_usd.landuse.network.train import Run  # noqa: PLC0415
    from envgen_usd.landuse.network.train import train as run  # noqa: PLC0415
    from envgen_usd.landuse_commands import (  # noqa: PLC0415
        drawn_landuse,
        network_sizes,
        training_figures,
    )

    if target not in TARGETS:
        raise EnvgenError(f"--target {target}: is none of {', '.join(TARGETS)}")
    if network not in NETWORKS:
        raise EnvgenError(f"--network {network}: is none of {', '.join(NETWORKS)}")
    if classes and (not data or target == "height"):
        raise EnvgenError("landuse train: --classes belongs to --data with label rasters")
    sizes = network_sizes(network, target, streets=not data)
    with progress_bars() as progress:
        bars, folder = Bars(progress), cache or out / "samples"
        maps: Sequence[Sample]
        if target == "height":
            from envgen_usd.height_commands import drawn_heights  # noqa: PLC0415

            maps = drawn_heights(folder, data, samples or 220, seed, bars)
        elif data:
            maps = read_raster_samples(data, classes)
        else:
            maps = drawn_landuse(folder, sizes, samples or 700, seed, bars)
        side = min(one.side for one in maps)
        wished = {"images": images, "adversarial": adversarial}
        figures = training_figures(sizes, wished, min(size or 256, side), seed)
        weights = run(Run(out), maps, sizes, figures, bars)
    print(f"weights: {weights}")
    print(f"next:    envgen-usd landuse eval {weights}")


@app.command(name="eval")
def evaluate(  # noqa: PLR0913 - one for each option
    weights: Annotated[Path | None, typer.Argument(help="Weights; default: those shipped.")] = None,
    *,
    windows: Annotated[int, typer.Option(min=1, help="Windows of each split.")] = 10,
    draws: Annotated[int, typer.Option(min=1, help="Draws of each window.")] = 8,
    baselines: Annotated[bool, typer.Option(help="Rules, majority and lookup too.")] = True,
    by_layout: Annotated[bool, typer.Option("--by-layout", help="Each layout apart.")] = False,
    seed: Annotated[int, typer.Option(help="Seed of the windows.")] = 0,
) -> None:
    """Measures a network on roads that it has never seen; prints Markdown."""
    from envgen_usd.landuse.network.checkpoint import read_target  # noqa: PLC0415
    from envgen_usd.landuse.network.evaluate import SPLITS  # noqa: PLC0415
    from envgen_usd.landuse_commands import landuse_scores  # noqa: PLC0415

    path = find_weights(weights)
    with progress_bars() as progress:
        bars = Bars(progress)
        if read_target(path) == "height":
            from envgen_usd.height_commands import height_scores  # noqa: PLC0415

            print(f"\nheights, {windows} windows\n")
            print(height_scores(path, windows, seed, baselines, bars))
            return
        for split in SPLITS:
            counts = (windows, draws, seed)
            scores = landuse_scores(path, split, counts, (baselines, by_layout), bars)
            print(f"\n{split} split, {windows} windows, best and diversity of {draws} draws\n")
            print(scores)


@app.command(name="from-osm")
def from_osm(
    extract: Annotated[Path, typer.Argument(help="OpenStreetMap extract, .osm or .pbf.")],
    *,
    out: Annotated[Path, typer.Option(help="Folder for one GeoTIFF for each 200 m chunk.")],
) -> None:
    """Makes class rasters with road masks from an extract, to train on."""
    from envgen_usd.landuse.osm import rasterise_osm, read_osm  # noqa: PLC0415
    from envgen_usd.landuse.write import write_landuse_map  # noqa: PLC0415

    read = read_osm(extract)
    out.mkdir(parents=True, exist_ok=True)
    count = 0
    for made in rasterise_osm(read):
        write_landuse_map(made, out / f"{made.chunk.name}.tif", read.crs)
        count += 1
    print(f"rasters: {count} in {out}")
    print(f"next:    envgen-usd landuse train --data {out} --out FOLDER")


def _draw_sheet(
    provider: "LanduseProvider",
    path: Path,
    environment: tuple[str | None, str | None],
    samples: int,
    seed: int,
) -> None:
    from envgen_usd.landuse.network.preview import environments, preview_sheet  # noqa: PLC0415

    with progress_bars() as progress:
        sheet = preview_sheet(provider, environments(*environment), samples, seed, Bars(progress))
    _save(sheet, path)


def _save(sheet: "Image.Image", path: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    sheet.save(path)
    print(f"sheet: {path}")
