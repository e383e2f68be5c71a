"""The command `verify`."""

from pathlib import Path
from typing import Annotated

import typer

from envgen_usd.commands.terminal_output import shown_progress


def verify(
    folder: Annotated[Path, typer.Argument(metavar="OUT", help="Folder of a build.")],
) -> None:
    """Checks every file of a build against its manifest; exit code 1 for damage.

    The command of the build repairs what is damaged.
    """
    from envgen_usd.recipe.product_files import check_products

    with shown_progress() as progress:
        check = check_products(folder, progress)
    for name, fault in check.faults.items():
        print(f"{folder / name}: {fault}")
    for name in check.unknown:
        print(f"{folder / name}: is not in the manifest")
    print(
        f"{check.whole} files as written, {len(check.faults)} damaged, {len(check.unknown)} others"
    )
    if check.faults:
        print("repair: run the same build again; it makes damaged files anew")
        raise typer.Exit(1)
