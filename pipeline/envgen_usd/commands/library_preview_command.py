"""The command `library preview`."""

from pathlib import Path
from typing import Annotated

import typer

from envgen_usd.commands.option_types import Library


def preview(
    names: Annotated[
        list[str] | None,
        typer.Argument(help="Assets or kinds, or materials with --materials; all."),
    ] = None,
    *,
    out: Annotated[Path, typer.Option(help="PNG file.")],
    library: Library = None,
    materials: Annotated[
        bool, typer.Option("--materials", help="Show materials instead of assets.")
    ] = False,
) -> None:
    """Draws a contact sheet of all variants of the assets, or of the materials."""
    from envgen_usd.commands.terminal_output import shown_progress
    from envgen_usd.recipe.library_sheet import write_sheet

    with shown_progress() as progress:
        count = write_sheet(library, names or [], out, materials=materials, progress=progress)
    print(f"{out}: {count} pictures")
