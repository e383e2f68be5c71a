"""The commands of `envgen-usd`: they parse, call and print; no logic."""

import sys
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from envgen_usd.city_cli import Tolerance, citygml, validate
from envgen_usd.config import BuildOptions, demo_road
from envgen_usd.errors import EnvgenError
from envgen_usd.landuse_cli import app as landuse_app
from envgen_usd.printing import Bars, print_issues, progress_bars

app = typer.Typer(
    help="From an OpenDRIVE road to a labelled 3D environment in OpenUSD, and to images of it.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)
RoadArgument = Annotated[Path | None, typer.Argument(help="OpenDRIVE file (.xodr).")]


@app.command()
def build(
    road: RoadArgument = None,
    *,
    country: Annotated[str, typer.Option(help="Country of the environment.")],
    area: Annotated[str, typer.Option(help="Area type, e.g. residential.")],
    out: Annotated[Path, typer.Option(help="Folder for the environment.")],
    seed: Annotated[int, typer.Option(help="Every random draw follows from it.")] = 0,
    demo: Annotated[bool, typer.Option("--demo", help="Build the town that comes along.")] = False,
    tolerance: Tolerance = 0.02,
    workers: Annotated[int, typer.Option(min=0, help="Processes; 0: one for each processor.")] = 0,
    embed_assets: Annotated[bool, typer.Option(help="Copy the assets beside the stage.")] = True,
    metadata_only: Annotated[
        bool, typer.Option("--metadata-only", help="Props without geometry, for a simulator's own.")
    ] = False,
    landuse: Annotated[
        str, typer.Option(help="'rules', 'network', or a raster of landuse classes.")
    ] = "rules",
    landuse_network: Annotated[
        Path | None, typer.Option(help="Weights for --landuse network; default: ours.")
    ] = None,
    heightmap: Annotated[Path | None, typer.Option(help="Real heights, a GeoTIFF.")] = None,
    terrain_network: Annotated[
        Path | None, typer.Option(help="Weights of a network that makes the heights.")
    ] = None,
    city: Annotated[
        Path | None, typer.Option(help="CityGML or CityJSON in place of generated buildings.")
    ] = None,
    environments: Annotated[
        Path | None, typer.Option(help="Folder of environments; default: the library's.")
    ] = None,
    library: Annotated[Path | None, typer.Option(help="Folder of the asset library.")] = None,
) -> None:
    """Builds the environment of a road: terrain, landuse, city, props and the stage."""
    from envgen_usd.build import build as run  # noqa: PLC0415 - starts fast without it

    if demo == (road is not None):
        raise EnvgenError("build: name an OpenDRIVE file, or give --demo without one")
    options = BuildOptions(
        road=road or demo_road(),
        country=country,
        area=area,
        out=out,
        seed=seed,
        tolerance=tolerance,
        workers=workers,
        embed_assets=embed_assets,
        metadata_only=metadata_only,
        landuse=landuse,
        landuse_network=landuse_network,
        heightmap=heightmap,
        terrain_network=terrain_network,
        city=city,
        environments=environments,
        library=library,
    )
    with progress_bars() as bars:
        result = run(options, Bars(bars))
    print_issues(result.issues)
    print(f"chunks: {result.built} built, {result.kept} kept")
    print(
        "made:   " + ", ".join(f"{number} {kind}" for kind, number in sorted(result.counts.items()))
    )
    print(f"stage:  {result.stage}")
    print(f"report: {result.stage.parent / 'report.html'}")
    print(f"next:   envgen-usd render {result.stage} --frames 20")


@app.command()
def render(
    stage: Annotated[Path, typer.Argument(help="The composed stage, OUT/stage.usda.")],
    *,
    frames: Annotated[int, typer.Option(min=1, help="Images to make along the road.")] = 20,
    out: Annotated[Path | None, typer.Option(help="Folder; default: frames beside it.")] = None,
    seed: Annotated[int, typer.Option(help="Where the drive begins and which way it turns.")] = 0,
    rig: Annotated[str, typer.Option(help="Camera rig, a name or a file.")] = "kitti_360",
    spacing: Annotated[float, typer.Option(min=0.001, help="Metres between two images.")] = 10.0,
    full_ids: Annotated[bool, typer.Option("--full-ids", help="Number every object.")] = False,
) -> None:
    """Drives a camera along the road and writes rgb, semantic, instance, part and depth images."""
    from envgen_usd.render.export import render_frames  # noqa: PLC0415 - needs OpenGL

    folder = out or stage.parent / "frames"
    with progress_bars() as bars:
        result = render_frames(
            stage,
            folder,
            frames,
            seed=seed,
            rig=rig,
            spacing=spacing,
            full_ids=full_ids,
            progress=Bars(bars),
        )
    print_issues(result.issues)
    print(f"frames: {result.rendered} rendered, {result.kept} kept")
    if result.others:
        print(f"others: {result.others} more of this drive were there before, and are kept")
    if result.removed:
        print(f"gone:   {result.removed} of another stage, camera or drive were removed")
    print(f"images: {folder}/{{rgb,semantic,semantic_colour,instance,part,depth}}")


@app.command()
def inspect(
    road: Annotated[Path, typer.Argument(help="OpenDRIVE file (.xodr).")],
    *,
    image: Annotated[Path | None, typer.Option(help="Draw a map to this .svg or .png.")] = None,
    fixed: Annotated[Path | None, typer.Option(help="Write the mended OpenDRIVE here.")] = None,
    listed: Annotated[
        Path | None, typer.Option("--list", help="Write all issues here, one a line.")
    ] = None,
) -> None:
    """Prints what an OpenDRIVE file holds and what is odd in it."""
    from envgen_usd.opendrive.inspect import inspect_file  # noqa: PLC0415 - starts fast

    for table in inspect_file(road, image, fixed, listed):
        Console().print(table)


app.add_typer(landuse_app)
app.command()(citygml)
app.command()(validate)


@app.command()
def flatten(
    stage: Annotated[Path, typer.Argument(help="The composed stage, OUT/stage.usda.")],
    target: Annotated[Path, typer.Argument(help="File to write: .usda, .usdc or .usdz.")],
    *,
    deinstance: Annotated[bool, typer.Option("--deinstance", help="Copy instances.")] = False,
) -> None:
    """Writes a stage as one file, for readers that know no layers."""
    from envgen_usd.layers.flatten import flatten_stage  # noqa: PLC0415

    flatten_stage(stage, target, deinstance=deinstance)
    print(f"flat stage: {target}")


@app.command()
def library(
    folder: Annotated[Path | None, typer.Argument(help="Asset library; default: ours.")] = None,
) -> None:
    """Lists the assets with their variants and all that is wrong.

    Exit code 2 if files are not what their places say, 1 if something else is wrong.
    """
    from envgen_usd.assets.catalogue import scan_library  # noqa: PLC0415
    from envgen_usd.assets.check import check_library  # noqa: PLC0415

    catalogue, faults = scan_library(folder)
    for asset in catalogue.assets.values():
        sets = "; ".join(f"{name}: {', '.join(of)}" for name, of in asset.variants.items())
        print(f"{asset.kind}/{asset.name}  {sets}")
    issues = check_library(catalogue)
    lines = [f"{issue.severity}: {issue.where}: {issue.message}" for issue in issues]
    for line in (*(f"error: {fault}" for fault in faults), *lines):
        print(line, file=sys.stderr)
    print(f"{len(catalogue.assets)} assets, {len(faults) + len(issues)} findings")
    if faults or issues:
        raise typer.Exit(2 if faults else 1)
