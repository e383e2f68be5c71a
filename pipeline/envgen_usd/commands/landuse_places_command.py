"""The command `landuse places`."""

from pathlib import Path
from typing import Annotated

import typer

from envgen_usd.commands.option_types import Seed
from envgen_usd.commands.terminal_output import print_issues
from envgen_usd.errors import EnvgenError
from envgen_usd.idle_options import refuse_idle
from envgen_usd.output_files import check_output_file
from envgen_usd.whole_files import make_folder

_STEP = 256
"""Cells from one square to the next; a larger value gives fewer squares that overlap less."""


def places(
    extracts: Annotated[
        list[Path] | None, typer.Argument(help="OpenStreetMap extracts, .osm or .pbf.")
    ] = None,
    *,
    out: Annotated[Path, typer.Option(help="File of squares to write, .npz.")],
    half: Annotated[
        str, typer.Option(help="Part of each place: west to learn from, east, or all.")
    ] = "all",
    side: Annotated[int, typer.Option(min=128, help="Side of a square, cells of 0.78 m.")] = 512,
    towns: Annotated[
        int, typer.Option(min=0, help="Squares of towns by rules to add, each with its own roads.")
    ] = 0,
    seed: Seed = 0,
    step: Annotated[int, typer.Option(min=16, help="Cells from one square to the next.")] = _STEP,
) -> None:
    """Turns real places and towns by rules into squares of ground truth, for training."""
    from envgen_usd.landuse.network.data.place_sample import write_place_samples
    from envgen_usd.recipe.place_windows import HALVES, MappedPlace, place_samples, rule_sample

    check_output_file(out, ".npz")
    if half not in (*HALVES, "all"):
        raise EnvgenError(f"--half {half}: unknown; choose from {', '.join(HALVES)}, all")
    if not extracts:
        refuse_idle({"--half": half != "all", "--step": step != _STEP}, "without extracts")
    samples = []
    side = side // 2 * 2
    for path in extracts or []:
        mapped = MappedPlace.read(path)
        print_issues(mapped.place.issues)
        bounds = mapped.place.bounds() if half == "all" else mapped.half(half)
        found = [one for _, one in place_samples(mapped, bounds, side, step)]
        print(f"{path.name}: {len(found)} squares")
        samples += found
    samples += [rule_sample(number, seed, side) for number in range(towns)]
    if not samples:
        raise EnvgenError(
            "no square holds streets and buildings; name extracts or --towns, or a smaller --side"
        )
    make_folder(out.parent)
    write_place_samples(samples, out)
    print(f"squares: {len(samples)} in {out}")
