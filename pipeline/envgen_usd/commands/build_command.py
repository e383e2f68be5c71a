"""The command `build`."""

from pathlib import Path
from typing import Annotated

import typer

from envgen_usd.commands.option_types import (
    Address,
    Area,
    CityOffset,
    Country,
    Environments,
    ExecutorName,
    GivenCity,
    Heightmap,
    Landuse,
    LanduseNetwork,
    Library,
    Seed,
    Strict,
    TerrainNetwork,
    Tolerance,
    numbers,
)
from envgen_usd.commands.terminal_output import print_issues, shell_command, shown_progress
from envgen_usd.errors import EnvgenError, refuse_issues
from envgen_usd.recipe.build_options import ROAD_FILE, BuildOptions, demo_road


def build(
    road: Annotated[
        Path | None, typer.Argument(help="OpenDRIVE file (.xodr, .xodr.gz, .xodr.bz2).")
    ] = None,
    *,
    country: Country,
    area: Area,
    out: Annotated[Path, typer.Option(help="Output folder of the environment.")],
    seed: Seed = 0,
    osm: Annotated[
        Path | None,
        typer.Option(
            help="OpenStreetMap extract (.osm, .osm.gz, .osm.bz2, .pbf) whose streets become"
            " OUT/road.xodr, instead of ROAD."
        ),
    ] = None,
    lanelet2: Annotated[
        Path | None,
        typer.Option(
            help="Lanelet2 map (.osm, .osm.gz, .osm.bz2) whose lanelets become OUT/road.xodr,"
            " instead of ROAD."
        ),
    ] = None,
    bbox: Annotated[
        str,
        typer.Option(metavar="W,S,E,N", help="Part of --osm, degrees; default: all of it."),
    ] = "",
    max_area: Annotated[
        float,
        typer.Option(min=0.0, help="Largest extent of the streets of --osm or --lanelet2, km²."),
    ] = 25.0,
    fill: Annotated[
        str,
        typer.Option(
            help="What is generated beside --osm: 'missing' what the map lacks, 'all' plots and"
            " houses as without a map, 'none' nothing."
        ),
    ] = "missing",
    driving_side: Annotated[
        str,
        typer.Option(
            help="Side on which traffic of --osm drives: 'right', 'left', or 'auto' as tags,"
            " roundabouts, carriageways and the country say."
        ),
    ] = "auto",
    demo: Annotated[
        bool, typer.Option("--demo", help="Build the shipped town road instead of ROAD.")
    ] = False,
    tolerance: Tolerance = 0.02,
    workers: Annotated[
        int,
        typer.Option(
            min=0, help="Number of parallel processes, or of Slurm's jobs; 0 uses all processors."
        ),
    ] = 0,
    executor: ExecutorName = "local",
    address: Address = "auto",
    embed_assets: Annotated[
        bool,
        typer.Option(
            help="Copy the used assets beside the stage, so that the folder can be moved."
        ),
    ] = True,
    metadata_only: Annotated[
        bool,
        typer.Option(
            "--metadata-only",
            help="Write props without geometry: poses, variants, labels, sizes, paths of assets.",
        ),
    ] = False,
    actors: Annotated[
        bool,
        typer.Option(help="Park vehicles and let people stand where the environment says so."),
    ] = True,
    landuse: Landuse = "rules",
    landuse_network: LanduseNetwork = None,
    heightmap: Heightmap = None,
    terrain_network: TerrainNetwork = None,
    city: GivenCity = None,
    city_offset: CityOffset = "",
    environments: Environments = None,
    library: Library = None,
    pictures: Annotated[
        bool, typer.Option(help="Show pictures of the town in the report; needs OpenGL.")
    ] = True,
    shard: Annotated[
        str,
        typer.Option(
            help="Build only part i/n of the chunks, e.g. 2/8, beside others into one --out; the "
            "same command without --shard then composes the stage."
        ),
    ] = "",
    strict: Strict = False,
) -> None:
    """Builds the environment of a road: terrain, landuse, city, props and the stage."""
    from envgen_usd.output_folder import REPORT_FILE
    from envgen_usd.recipe.dataset_plan import parse_shard
    from envgen_usd.recipe.environment_build import build as run
    from envgen_usd.recipe.environment_build import build_shard
    from envgen_usd.recipe.report_pictures import add_pictures

    if (road is not None) + demo + (osm is not None) + (lanelet2 is not None) != 1:
        raise EnvgenError(
            "build: name an OpenDRIVE file, or give --demo, --osm FILE or --lanelet2 FILE without"
            " one; these exclude each other"
        )
    options = BuildOptions(
        road=road or (out / ROAD_FILE if osm or lanelet2 else demo_road()),
        country=country,
        area=area,
        out=out,
        seed=seed,
        tolerance=tolerance,
        workers=workers,
        executor=executor,
        address=address,
        embed_assets=embed_assets,
        metadata_only=metadata_only,
        actors=actors,
        landuse=landuse,
        landuse_network=landuse_network,
        heightmap=heightmap,
        terrain_network=terrain_network,
        city=city,
        city_offset=numbers(city_offset, "--city-offset"),
        environments=environments,
        library=library,
        osm=osm,
        bbox=numbers(bbox, "--bbox"),
        max_area=max_area,
        fill=fill,
        driving_side=driving_side,
        lanelet2=lanelet2,
    )
    if shard:
        with shown_progress() as progress:
            part = build_shard(options, parse_shard(shard), progress)
        print(f"chunks: {part.built} built, {part.kept} kept")
        print("next:   the same command without --shard, when all parts are built")
        return
    with shown_progress() as progress:
        result = run(options, progress)
        report = result.stage.parent / REPORT_FILE
        missing = add_pictures(result.stage, report, progress) if pictures else ""
    if strict:
        refuse_issues(result.issues)
    print_issues(result.issues)
    print(f"chunks: {result.built} built, {result.kept} kept")
    print(
        "made:   " + ", ".join(f"{number} {kind}" for kind, number in sorted(result.counts.items()))
    )
    print(f"stage:  {result.stage}")
    print(f"report: {report}" + (f" (no pictures: {missing})" if missing else ""))
    print(f"next:   {shell_command('render', result.stage, '--frames', 20)}")
