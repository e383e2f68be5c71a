"""The command `flatten`."""

from pathlib import Path
from typing import Annotated

import typer

from envgen_usd.commands.option_types import StageFile


def flatten(
    stage: StageFile,
    target: Annotated[Path, typer.Argument(help="File to write: .usda, .usdc or .usdz.")],
    *,
    deinstance: Annotated[
        bool, typer.Option("--deinstance", help="Replace instances by copies of their prototypes.")
    ] = False,
) -> None:
    """Writes a composed stage as a single file, for readers without composition."""
    from envgen_usd.layers.flat_stage import flatten_stage

    flatten_stage(stage, target, deinstance=deinstance)
    print(f"flattened stage: {target}")
