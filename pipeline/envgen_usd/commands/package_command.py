"""The command `package`."""

from pathlib import Path
from typing import Annotated

import typer

from envgen_usd.commands.option_types import Environment


def package(
    environment: Environment,
    *,
    to: Annotated[
        Path | None,
        typer.Option(
            "--to", help="Folder to write; its name names the files; default: OUT/package."
        ),
    ] = None,
    road: Annotated[
        Path | None, typer.Option(help="OpenDRIVE file of the build, to be handed on.")
    ] = None,
) -> None:
    """Writes a .usdz, and beside it the road and ASAM OpenMATERIAL 3D files."""
    from envgen_usd.commands.terminal_output import print_issues, shown_progress
    from envgen_usd.exchange.environment_export import stage_of
    from envgen_usd.exchange.stage_package import package_environment

    target = to or stage_of(environment).parent / "package"
    with shown_progress() as progress:
        result = package_environment(environment, target, road=road, progress=progress)
    print_issues(result.issues)
    size = result.stage.stat().st_size / 1e6
    print(f"{result.stage}: {size:.1f} MB")
    print(f"{result.asset}: {len(result.materials)} materials")
