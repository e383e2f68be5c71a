"""The commands `envgen-usd dataset ...`: a data set from a recipe, its shards, its sheets."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.core import TyperGroup

from envgen_usd.commands.option_types import Address, ExecutorName
from envgen_usd.commands.terminal_output import print_issues, shell_command, shown_progress
from envgen_usd.errors import EnvgenError

if TYPE_CHECKING:
    from envgen_usd.datasets.dataset_index import IndexedFrame

_MAKE = "make"
_OUT = typer.Option(help="Folder of the data set.")


class _MakeByDefault(TyperGroup):
    """`dataset RECIPE` stands for `dataset make RECIPE`."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:  # noqa: ANN401 - typer has its click
        """Adds the name of the command where none is given."""
        if args and args[0] not in {*self.commands, *ctx.help_option_names}:
            args = [_MAKE, *args]
        rest: list[str] = super().parse_args(ctx, args)
        return rest


app = typer.Typer(
    name="dataset",
    cls=_MakeByDefault,
    help="Data sets from recipes: 'dataset RECIPE.toml --out DIR' builds, draws and reports.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)
Formats = Annotated[
    list[str] | None,
    typer.Option(
        "--format",
        help="Also write this layout: cityscapes, coco, kitti360, nuscenes, webdataset or yolo;"
        " repeatable.",
    ),
]
Recording = Annotated[
    Path | None,
    typer.Option(
        "--rerun",
        metavar="OUT.rrd",
        help="Also write images, boxes, scans and roads for the Rerun viewer; needs rerun-sdk.",
    ),
]
Recipe = Annotated[
    str, typer.Argument(help="Recipe (.toml), or the name of a shipped one: article.")
]


@app.command()
def make(
    recipe: Recipe,
    *,
    out: Annotated[Path, _OUT],
    shard: Annotated[
        str,
        typer.Option(
            metavar="I/N", help="Only part I of N parts of the frames; 'dataset merge' joins them."
        ),
    ] = "",
    formats: Formats = None,
    rerun: Recording = None,
    workers: Annotated[
        int,
        typer.Option(
            "--workers",
            "--jobs",
            min=0,
            help="Number of parallel processes, or of Slurm's jobs; 0 uses all processors.",
        ),
    ] = 0,
    executor: ExecutorName = "local",
    address: Address = "auto",
) -> None:
    """Makes a data set: builds the towns of a recipe, draws their frames, writes index and report.

    The same command goes on after an interruption.
    """
    from envgen_usd.executors.executor import Cluster
    from envgen_usd.recipe.dataset_plan import parse_shard
    from envgen_usd.recipe.dataset_recipe import recipe_file
    from envgen_usd.recipe.dataset_run import make_dataset

    part = parse_shard(shard)
    if rerun and part[1] > 1:
        raise EnvgenError("--rerun: a shard has a part of the frames; give it to 'dataset merge'")
    _check_recording(rerun, recipe)
    with shown_progress() as progress:
        result = make_dataset(
            recipe_file(recipe),
            out,
            shard=part,
            formats=formats or (),
            cluster=Cluster(executor, workers, address),
            progress=progress,
        )
    print_issues(result.issues)
    print(f"frames: {result.rendered} rendered, {result.kept} kept")
    if part[1] > 1:
        words = ("dataset", "merge", recipe, "SHARD", "...", "--out", "DIR")
        print(f"next:   {shell_command(*words)}")
        return
    _print_splits([frame.split for frame in result.frames])
    print(f"report: {out / 'report.html'}")
    _write_recording(out, result.frames, rerun)


@app.command()
def merge(
    recipe: Recipe,
    shards: Annotated[
        list[Path] | None,
        typer.Argument(help="Folders of the shards; none if all shards wrote into --out."),
    ] = None,
    *,
    out: Annotated[Path, _OUT],
    formats: Formats = None,
    rerun: Recording = None,
) -> None:
    """Joins the shards of a data set, and writes index, sheets and report."""
    from envgen_usd.recipe.dataset_merge import merge_shards
    from envgen_usd.recipe.dataset_recipe import recipe_file

    _check_recording(rerun, recipe)
    with shown_progress() as progress:
        frames = merge_shards(
            recipe_file(recipe), shards or [], out, formats=formats or (), progress=progress
        )
    _print_splits([frame.split for frame in frames])
    print(f"report: {out / 'report.html'}")
    _write_recording(out, frames, rerun)


@app.command()
def preview(
    folder: Annotated[Path, typer.Argument(help="Folder of a finished data set.")],
    *,
    frames: Annotated[int, typer.Option(min=1, help="Largest number of frames of a sheet.")] = 12,
) -> None:
    """Draws contact sheets: pictures beside their labels, one for each town and camera."""
    from envgen_usd.datasets.dataset_index import read_index
    from envgen_usd.datasets.pages.preview_sheets import draw_previews

    with shown_progress() as progress:
        sheets = draw_previews(folder, read_index(folder), frames, progress)
    for sheet in sheets:
        print(folder / sheet.file)


@app.command()
def convert(
    folder: Annotated[Path, typer.Argument(help="Folder of a finished data set.")],
    formats: Annotated[
        list[str] | None,
        typer.Argument(help="Layouts: cityscapes, coco, kitti360, nuscenes, webdataset, yolo."),
    ] = None,
    *,
    rerun: Recording = None,
) -> None:
    """Writes a finished data set in the layouts of other data sets, in folders of their names."""
    from envgen_usd.datasets.dataset_index import read_index
    from envgen_usd.datasets.formats.dataset_formats import write_formats

    names = list(dict.fromkeys(formats or ()))
    if not names and rerun is None:
        raise EnvgenError("dataset convert: name a layout, or a file with --rerun")
    _check_recording(rerun)
    frames = read_index(folder)
    with shown_progress() as progress:
        write_formats(folder, frames, names, progress)
    for name in names:
        print(folder / name)
    _write_recording(folder, frames, rerun)


def _check_recording(rerun: Path | None, recipe: str = "") -> None:
    """Checks that a recording can be written, of the scans of a recipe if it is named."""
    from envgen_usd.datasets.formats.rerun_recording import check_recording
    from envgen_usd.datasets.frame_scans import check_scan_format
    from envgen_usd.recipe.dataset_recipe import read_recipe, recipe_file

    if rerun:
        check_recording(rerun)
    if rerun and recipe:
        path = recipe_file(recipe)
        choice = read_recipe(path)
        if "lidar" in choice.outputs:
            check_scan_format(choice.lidar_format, f"{path}: lidar_format: ")


def _write_recording(folder: Path, frames: "Sequence[IndexedFrame]", rerun: Path | None) -> None:
    from envgen_usd.datasets.formats.dataset_formats import write_recording

    if rerun:
        with shown_progress() as progress:
            write_recording(folder, frames, rerun, progress)
        print(rerun)


def _print_splits(splits: list[str]) -> None:
    counts = ", ".join(f"{name} {splits.count(name)}" for name in dict.fromkeys(splits))
    print(f"splits: {counts}")
