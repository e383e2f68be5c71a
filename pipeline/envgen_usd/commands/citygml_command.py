"""The command `citygml`."""

from pathlib import Path
from typing import Annotated

import typer

from envgen_usd.commands.option_types import (
    Area,
    CityOffset,
    Country,
    Environments,
    GivenCity,
    Heightmap,
    Landuse,
    LanduseNetwork,
    Library,
    RoadFile,
    Seed,
    Strict,
    TerrainNetwork,
    Tolerance,
    numbers,
)
from envgen_usd.commands.terminal_output import print_issues, shown_progress
from envgen_usd.errors import EnvgenError, refuse_issues
from envgen_usd.idle_options import refuse_idle
from envgen_usd.output_files import check_output_file
from envgen_usd.recipe.build_options import LandOptions
from envgen_usd.whole_files import refuse_own_input

CITY_ENDINGS = (".gml", ".xml", ".json")


def citygml(
    road: RoadFile,
    *,
    out: Annotated[
        Path, typer.Option(help="File to write: CityGML (.gml, .xml) or CityJSON (.json).")
    ],
    country: Country = "1",
    area: Area = "residential",
    tolerance: Tolerance = 0.02,
    version: Annotated[str, typer.Option(help="CityGML version: 3.0 or 2.0.")] = "3.0",
    lod: Annotated[
        str | None, typer.Option(help="Add buildings, trees and furniture in this LoD, 0.0 to 3.3.")
    ] = None,
    interiors: Annotated[
        bool,
        typer.Option("--interiors", help="Add rooms to the buildings; needs --lod 2.0 or finer."),
    ] = False,
    land: Annotated[bool, typer.Option("--land", help="Add landuse and relief (TIN).")] = False,
    solids: Annotated[
        bool, typer.Option(help="Add the free space above each lane as a solid.")
    ] = True,
    lines: Annotated[
        bool, typer.Option(help="Add reference lines and lane borders as curves.")
    ] = True,
    seed: Seed = 0,
    landuse: Landuse = "rules",
    landuse_network: LanduseNetwork = None,
    heightmap: Heightmap = None,
    terrain_network: TerrainNetwork = None,
    city: GivenCity = None,
    city_offset: CityOffset = "",
    environments: Environments = None,
    library: Library = None,
    strict: Strict = False,
) -> None:
    """Writes the roads, and optionally their surroundings, as CityGML or CityJSON."""
    from envgen_usd.city.buildings.level_of_detail import (
        Modelling,
        level_of,
    )
    from envgen_usd.city.roads.traffic_spaces import RoadDetail
    from envgen_usd.recipe.whole_city import CityOptions, write_whole_city

    check_output_file(out, *CITY_ENDINGS)
    refuse_own_input(out, road, city)
    if interiors and lod is None:
        raise EnvgenError("citygml: --interiors needs buildings; give --lod 2.0 or finer")
    if lod is None and not land and city is None:
        given = {
            "--landuse": landuse != LandOptions.landuse,
            "--landuse-network": landuse_network,
            "--heightmap": heightmap,
            "--terrain-network": terrain_network,
        }
        refuse_idle(given, "without --lod, --land or --city")
    buildings = Modelling(level_of(lod), rooms=interiors) if lod is not None else None
    options = LandOptions(
        road,
        country,
        area,
        seed=seed,
        tolerance=tolerance,
        landuse=landuse,
        landuse_network=landuse_network,
        heightmap=heightmap,
        terrain_network=terrain_network,
        city=city,
        city_offset=numbers(city_offset, "--city-offset"),
        environments=environments,
        library=library,
    )
    model = CityOptions(RoadDetail(solids, lines), buildings, land, version)
    with shown_progress() as progress:
        issues = write_whole_city(options, model, out, progress)
    if strict:
        refuse_issues(issues)
    print_issues(issues)
    print(f"city: {out}")
