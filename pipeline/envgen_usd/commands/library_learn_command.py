"""The command `library learn`."""

from pathlib import Path
from typing import Annotated

import typer


def learn(
    counts: Annotated[
        Path, typer.Argument(help="CSV file with the columns kind,variant,count,spacing,area.")
    ],
    *,
    environment: Annotated[Path, typer.Option(help="File of the environment, .toml.")],
    smoothing: Annotated[
        float, typer.Option(help="Added to each count; 0 for plain shares.")
    ] = 1.0,
    write: Annotated[
        bool, typer.Option("--write", help="Write the file; otherwise its lines are printed.")
    ] = False,
) -> None:
    """Fits the weights and spacings of an environment to counts of real streets."""
    from envgen_usd.recipe.environment_edits import (
        edited_environment,
        library_of,
        write_environment,
    )
    from envgen_usd.recipe.learned_environment import learned_edits

    edits = learned_edits(counts, environment, smoothing)
    catalogue = library_of(environment)
    if write:
        write_environment(environment, edits, catalogue)
    else:
        edited_environment(environment, edits, catalogue)
    for edit in edits:
        print(f"[{edit.table}] {edit.line()}  # {edit.note}")
    where = "written to" if write else "not written (--write) to"
    print(f"{len(edits)} values {where} {environment}")
