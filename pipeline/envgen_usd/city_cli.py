"""The commands for city models: `citygml` and `validate`."""

from pathlib import Path
from typing import Annotated

import typer

from envgen_usd.config import TOLERANCES
from envgen_usd.errors import EnvgenError
from envgen_usd.output import check_writable
from envgen_usd.printing import print_issues

Tolerance = Annotated[
    float,
    typer.Option(min=TOLERANCES[0], max=TOLERANCES[1], help="Chord error of the road, metres."),
]
CITY_ENDINGS = (".gml", ".xml", ".json")


def citygml(  # noqa: PLR0913 - one for each option
    road: Annotated[Path, typer.Argument(help="OpenDRIVE file (.xodr).")],
    *,
    out: Annotated[
        Path, typer.Option(help="File to write: CityGML (.gml, .xml) or CityJSON (.json).")
    ],
    country: Annotated[str, typer.Option(help="Country of the environment.")] = "1",
    area: Annotated[str, typer.Option(help="Area type of the environment.")] = "residential",
    tolerance: Tolerance = 0.02,
    version: Annotated[str, typer.Option(help="Version of CityGML: 3.0 or 2.0.")] = "3.0",
    lod: Annotated[
        str | None, typer.Option(help="Buildings, trees and all else, in LoD 0.0 to 3.3.")
    ] = None,
    interiors: Annotated[bool, typer.Option("--interiors", help="Rooms in buildings.")] = False,
    land: Annotated[bool, typer.Option("--land", help="Landuse and relief (TIN).")] = False,
    solids: Annotated[bool, typer.Option(help="The room above each lane.")] = True,
    lines: Annotated[bool, typer.Option(help="Reference lines and borders of lanes.")] = True,
    seed: Annotated[int, typer.Option(help="Every random draw follows from it.")] = 0,
) -> None:
    """Writes roads, and what stands beside them, as CityGML or CityJSON."""
    from envgen_usd.city.building import Modelling  # noqa: PLC0415
    from envgen_usd.city.levels import level_of  # noqa: PLC0415
    from envgen_usd.city.traffic_spaces import RoadDetail  # noqa: PLC0415
    from envgen_usd.land import read_road  # noqa: PLC0415 - starts fast without it
    from envgen_usd.profiles import read_profile  # noqa: PLC0415
    from envgen_usd.whole_city import CityOptions, write_whole_city  # noqa: PLC0415

    if out.suffix.lower() not in CITY_ENDINGS:
        raise EnvgenError(f"{out}: choose a name that ends in {' or '.join(CITY_ENDINGS)}")
    check_writable(out.parent)
    if interiors and lod is None:
        raise EnvgenError("citygml: --interiors needs buildings; give --lod 2.0 or finer")
    buildings = Modelling(level_of(lod), rooms=interiors) if lod is not None else None
    options = CityOptions(RoadDetail(solids, lines), buildings, land, seed, version)
    profile = read_profile(country, area)
    network, surface = read_road(road, tolerance)
    out.parent.mkdir(parents=True, exist_ok=True)
    write_whole_city(surface, profile, options, out)
    print_issues((*network.issues, *surface.issues))
    print(f"city: {out}")


def validate(
    target: Annotated[Path, typer.Argument(help="An environment, a CityGML or CityJSON file.")],
    *,
    schemas: Annotated[Path | None, typer.Option(help="Folder of CityGML schemas.")] = None,
    schema: Annotated[bool, typer.Option(help="Check against the schema of CityGML.")] = True,
) -> None:
    """Checks city models against their schema and ISO 19107; exit code 1 if anything is wrong."""
    from envgen_usd.city_files import city_files, file_issues  # noqa: PLC0415

    files = city_files(target)
    found = 0
    for file in files:
        for issue in file_issues(file, schemas, schema=schema):
            found += 1
            print(f"{file}: {issue.kind}: {issue.where}: {issue.message}")
    print(f"{len(files)} files, {found} findings")
    if found:
        raise typer.Exit(1)
