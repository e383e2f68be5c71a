"""The command `library check`."""

import sys
from pathlib import Path
from typing import Annotated

import typer


def check(
    folder: Annotated[
        Path | None,
        typer.Argument(help="Folder of the asset library; default: the shipped library."),
    ] = None,
) -> None:
    """Lists the assets with their variants and all errors; checks the environments, too.

    Exit code 2 for files that do not match their paths and for faulty environments, 1 for others.
    """
    from envgen_usd.assets.asset_catalogue import scan_library
    from envgen_usd.assets.library_check import check_library
    from envgen_usd.commands.terminal_output import print_findings
    from envgen_usd.recipe.environment_check import library_environment_faults

    catalogue, broken = scan_library(folder)
    faults = (*broken, *library_environment_faults(catalogue))
    for asset in catalogue.assets.values():
        sets = "; ".join(f"{name}: {', '.join(of)}" for name, of in asset.variants.items())
        print(f"{asset.kind}/{asset.name}  {sets}")
    issues = check_library(catalogue)
    for fault in faults:
        print(f"error: {fault}", file=sys.stderr)
    print_findings(issues)
    print(f"{len(catalogue.assets)} assets, {len(faults) + len(issues)} findings")
    if faults or issues:
        raise typer.Exit(2 if faults else 1)
