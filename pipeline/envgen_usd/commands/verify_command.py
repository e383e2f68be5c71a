"""The command `verify`."""

from pathlib import Path
from typing import Annotated

import typer

from envgen_usd.commands.terminal_output import shown_progress


def verify(
    folder: Annotated[
        Path, typer.Argument(metavar="OUT", help="Folder of a build or of a finished data set.")
    ],
) -> None:
    """Checks every file of a build, or of a data set's frames; exit code 1 for damage.

    The command that made the folder repairs what is damaged.
    """
    from envgen_usd.recipe.dataset_files import NAME, check_frames
    from envgen_usd.recipe.product_files import check_products

    check_files = check_frames if (folder / NAME).is_file() else check_products
    with shown_progress() as progress:
        check = check_files(folder, progress)
    for name, fault in check.faults.items():
        print(f"{folder / name}: {fault}")
    for name in check.unknown:
        print(f"{folder / name}: is not in the manifest")
    print(
        f"{check.whole} files as written, {len(check.faults)} damaged, {len(check.unknown)} others"
    )
    if check.faults:
        print("repair: run the same command again; it makes damaged files anew")
        raise typer.Exit(1)
