"""The command `inspect`."""

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from envgen_usd.commands.option_types import RoadFile


def inspect(
    road: RoadFile,
    *,
    image: Annotated[
        Path | None, typer.Option(help="Also draw a map of the road to this .svg or .png file.")
    ] = None,
    fixed: Annotated[
        Path | None, typer.Option(help="Also write the repaired OpenDRIVE file here.")
    ] = None,
    listed: Annotated[
        Path | None,
        typer.Option("--list", help="Also write all issues to this file, one per line."),
    ] = None,
) -> None:
    """Prints the content of an OpenDRIVE file and the warnings about it."""
    from envgen_usd.opendrive.inspect.network_tables import inspect_file
    from envgen_usd.output_files import check_output_file

    if image is not None:
        check_output_file(image, ".svg", ".png")
    for target in filter(None, (fixed, listed)):
        check_output_file(target)
    for table in inspect_file(road, image, fixed, listed):
        Console().print(table)
