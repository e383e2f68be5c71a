"""The command `library new`."""

from pathlib import Path
from typing import Annotated

import typer


def new(
    folder: Annotated[Path, typer.Argument(help="Folder to make; new or empty.")],
) -> None:
    """Copies the shipped library into a folder: yours to change, and to build with."""
    from envgen_usd.assets.library_drafts import new_library
    from envgen_usd.commands.terminal_output import shell_command

    new_library(folder)
    how = shell_command("build", "...", "--library", folder)
    print(f"{folder}: an asset library; build with it: {how}")
