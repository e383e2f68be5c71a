"""The command `synth-road`."""

import re
from pathlib import Path
from typing import Annotated

import typer

from envgen_usd.commands.option_types import Seed
from envgen_usd.commands.terminal_output import shell_command
from envgen_usd.errors import EnvgenError

_MOST_BLOCKS = 10_000
"""Largest number of blocks: some 600 km of streets."""
_BLOCKS = re.compile(r"(\d{1,4})x(\d{1,4})")


def synth_road(
    layout: Annotated[str, typer.Argument(help="grid, ring or organic.", metavar="LAYOUT")],
    *,
    blocks: Annotated[
        str,
        typer.Option(
            metavar="NxM",
            help="Number of blocks along x and y; of a ring: rings of blocks, and blocks around.",
        ),
    ] = "4x4",
    seed: Seed = 0,
    out: Annotated[
        Path | None, typer.Option(help="File to write (.xodr); default: LAYOUT_NxM.xodr.")
    ] = None,
) -> None:
    """Writes a street network as OpenDRIVE, for those who have no road file."""
    from envgen_usd.output_files import check_output_file
    from envgen_usd.streets.network_roads import network_xml
    from envgen_usd.streets.street_layouts import LAYOUTS
    from envgen_usd.whole_files import write_whole

    if layout not in LAYOUTS:
        raise EnvgenError(f"LAYOUT {layout}: unknown; choose from {', '.join(LAYOUTS)}")
    numbers = _BLOCKS.fullmatch(blocks)
    count = (int(numbers[1]), int(numbers[2])) if numbers else (0, 0)
    if not 1 <= count[0] * count[1] <= _MOST_BLOCKS:
        raise EnvgenError(
            f"--blocks {blocks}: expected two numbers such as 4x3, at most {_MOST_BLOCKS:,} blocks"
        )
    path = out or Path(f"{layout}_{count[0]}x{count[1]}.xodr")
    check_output_file(path)
    network = LAYOUTS[layout](count, seed)
    write_whole(path, network_xml(network, path.stem))
    length = network.length / 1000.0
    print(f"streets: {len(network.streets)}, {length:.1f} km, {len(network.nodes)} nodes")
    print(f"road:    {path}")
    place = ("--country", "1", "--area", "residential")
    print(f"next:    {shell_command('build', path, *place, '--out', path.stem)}")
