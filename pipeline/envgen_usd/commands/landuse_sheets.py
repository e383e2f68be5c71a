"""Sheets of landuse maps, and the options of their commands."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from envgen_usd.commands.terminal_output import shown_progress
from envgen_usd.output_files import check_output_file
from envgen_usd.whole_files import make_folder, whole_file

if TYPE_CHECKING:
    from PIL import Image

    from envgen_usd.landuse.landuse_provider import LanduseProvider

Samples = Annotated[int, typer.Option(min=1, help="Maps to draw for each environment.")]


def draw_landuse_sheet(
    provider: "LanduseProvider",
    path: Path,
    environment: tuple[str | None, str | None],
    samples: int,
    seed: int,
) -> None:
    """Draws landuse maps along random roads, for the environments of a country and an area type.

    Raises:
        EnvgenError: There is no such environment, or the sheet cannot be written.
    """
    from envgen_usd.landuse.network.training.drawn_preview import environments, preview_sheet

    check_sheet(path)
    with shown_progress() as progress:
        sheet = preview_sheet(provider, environments(*environment), samples, seed, progress)
    save_sheet(sheet, path)


def check_sheet(path: Path) -> None:
    """Checks that a sheet can be written, before it is drawn.

    Raises:
        EnvgenError: It is no name of a picture, or the folder cannot be written.
    """
    check_output_file(path, ".png", ".jpg")


def save_sheet(sheet: "Image.Image", path: Path) -> None:
    """Saves a sheet and prints its path."""
    make_folder(path.parent)
    with whole_file(path) as part:
        sheet.save(part)
    print(f"sheet: {path}")
