"""The command `envgen-usd`: parses, calls and prints; no logic."""

import sys
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from envgen_usd.config import BuildOptions, demo_road
from envgen_usd.errors import EnvgenError, Issue

app = typer.Typer(
    help="From an OpenDRIVE road to a labelled 3D environment in OpenUSD, and to images of it.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)
console = Console(stderr=True)

RoadArgument = Annotated[Path | None, typer.Argument(help="OpenDRIVE file (.xodr).")]


def main() -> None:
    """Runs the command; what cannot be used is one line and exit code 2."""
    try:
        app()
    except EnvgenError as error:
        console.print(f"envgen-usd: {error}", style="red", highlight=False, soft_wrap=True)
        sys.exit(2)
    except KeyboardInterrupt:
        console.print("envgen-usd: interrupted; the same command goes on from here", style="yellow")
        sys.exit(130)


def _bars() -> Progress:
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn())
    return Progress(*columns, TimeElapsedColumn(), console=console, transient=False)


class _Bars:
    """One bar for each step."""

    def __init__(self, progress: Progress) -> None:
        self._progress = progress
        self._tasks: dict[str, int] = {}

    def __call__(self, step: str, done: int, total: int) -> None:
        if step not in self._tasks:
            self._tasks[step] = int(self._progress.add_task(step, total=total))
        task = next(t for t in self._progress.tasks if t.id == self._tasks[step])
        self._progress.update(task.id, completed=done, total=total)


@app.command()
def build(
    road: RoadArgument = None,
    *,
    country: Annotated[str, typer.Option(help="Country of the environment.")],
    area: Annotated[str, typer.Option(help="Area type, e.g. residential.")],
    out: Annotated[Path, typer.Option(help="Folder for the environment.")],
    seed: Annotated[int, typer.Option(help="Every random draw follows from it.")] = 0,
    demo: Annotated[bool, typer.Option("--demo", help="Build the town that comes along.")] = False,
    tolerance: Annotated[float, typer.Option(help="Chord error of the road, metres.")] = 0.02,
    workers: Annotated[int, typer.Option(help="Processes; 0: one for each processor.")] = 0,
    embed_assets: Annotated[bool, typer.Option(help="Copy the assets beside the stage.")] = True,
) -> None:
    """Builds the environment of a road: terrain, landuse, city, props and the stage."""
    from envgen_usd.build import build as run  # noqa: PLC0415 - starts fast without it

    if demo == (road is not None):
        raise EnvgenError("build: name an OpenDRIVE file, or give --demo without one")
    options = BuildOptions(
        road=road or demo_road(),
        country=country,
        area=area,
        out=out,
        seed=seed,
        tolerance=tolerance,
        workers=workers,
        embed_assets=embed_assets,
    )
    with _bars() as bars:
        result = run(options, _Bars(bars))
    _print_issues(result.issues)
    made = ", ".join(f"{number} {kind}" for kind, number in sorted(result.counts.items()))
    print(f"chunks: {result.built} built, {result.kept} kept; {made or 'nothing new'}")
    print(f"stage:  {result.stage}")
    print(f"report: {result.stage.parent / 'report.html'}")
    print(f"next:   envgen-usd render {result.stage} --frames 20")


def _print_issues(issues: tuple[Issue, ...]) -> None:
    """Prints how often each kind of issue occurred, with one example."""
    if not issues:
        return
    kinds: dict[str, list[Issue]] = {}
    for issue in issues:
        kinds.setdefault(issue.kind, []).append(issue)
    table = Table("issue", "times", "example", title="Odd in the input, and used all the same")
    for kind, found in sorted(kinds.items()):
        table.add_row(kind, str(len(found)), f"{found[0].where}: {found[0].message}")
    console.print(table)


@app.command()
def render(
    stage: Annotated[Path, typer.Argument(help="The composed stage, OUT/stage.usda.")],
    *,
    frames: Annotated[int, typer.Option(min=1, help="Images to make along the road.")] = 20,
    out: Annotated[Path | None, typer.Option(help="Folder; default: frames beside it.")] = None,
    seed: Annotated[int, typer.Option(help="Where the drive begins and which way it turns.")] = 0,
    rig: Annotated[str, typer.Option(help="Camera rig, a name or a file.")] = "kitti_360",
) -> None:
    """Drives a camera along the road and writes rgb, semantic, instance and depth images."""
    from envgen_usd.render.export import render_frames  # noqa: PLC0415 - needs OpenGL

    folder = out or stage.parent / "frames"
    with _bars() as bars:
        result = render_frames(stage, folder, frames, seed=seed, rig=rig, progress=_Bars(bars))
    print(f"frames: {result.rendered} rendered, {result.kept} kept")
    print(f"images: {folder}/{{rgb,semantic,semantic_colour,instance,depth}}")


@app.command()
def inspect(
    road: Annotated[Path, typer.Argument(help="OpenDRIVE file (.xodr).")],
    *,
    image: Annotated[Path | None, typer.Option(help="Draw a map to this .svg or .png.")] = None,
    fixed: Annotated[Path | None, typer.Option(help="Write the mended OpenDRIVE here.")] = None,
) -> None:
    """Prints what an OpenDRIVE file holds and what is odd in it."""
    from envgen_usd.opendrive.inspect import inspect_file  # noqa: PLC0415 - starts fast

    for table in inspect_file(road, image, fixed):
        Console().print(table)
