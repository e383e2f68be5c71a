"""The command `landuse rules`."""

from pathlib import Path
from typing import Annotated

import typer

from envgen_usd.commands.landuse_sheets import Samples, draw_landuse_sheet
from envgen_usd.commands.option_types import AnyArea, AnyCountry, Seed


def rules(
    *,
    preview: Annotated[Path, typer.Option(help="Image file to write, .png.")],
    country: AnyCountry = None,
    area: AnyArea = None,
    samples: Samples = 2,
    seed: Seed = 0,
) -> None:
    """Draws a sheet of landuse maps by rules, the ground truth."""
    from envgen_usd.landuse.landuse_rules import RuleProvider

    draw_landuse_sheet(RuleProvider(), preview, (country, area), samples, seed)
