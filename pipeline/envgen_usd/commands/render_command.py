"""The command `render`."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from envgen_usd.commands.option_types import Address, ExecutorName, StageFile, Strict
from envgen_usd.commands.terminal_output import print_issues, shown_progress

if TYPE_CHECKING:
    from envgen_usd.render.trajectories.trajectory import Trajectory


def render(
    stage: StageFile,
    *,
    frames: Annotated[
        int | None,
        typer.Option(
            min=1, help="Largest number of frames; default: 20, or all of a trajectory that ends."
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="Output folder; default: the folder 'frames' beside the stage."),
    ] = None,
    seed: Annotated[int, typer.Option(help="Random seed of the start position and the turns.")] = 0,
    rig: Annotated[
        str, typer.Option(help="Camera rig: a shipped name or a TOML file.")
    ] = "kitti_360",
    trajectory: Annotated[
        str,
        typer.Option(
            help="Where frames are: spread (over all lanes), drive (along routes), all-lanes (each"
            " once), traffic (in the places of vehicles that move), or a file of poses (.csv, or"
            " .json as cameras.json)."
        ),
    ] = "spread",
    weather: Annotated[
        str,
        typer.Option(
            help="A shipped weather, a TOML file, or random (drawn every few frames);"
            " default: the light of the stage."
        ),
    ] = "",
    hour: Annotated[
        float | None, typer.Option(min=0.0, max=24.0, help="Solar time; default: drawn.")
    ] = None,
    date: Annotated[
        str, typer.Option(help="Date as MM-DD; default: drawn, or the equinox with --hour.")
    ] = "",
    season: Annotated[
        str,
        typer.Option(
            help="Season of the plants: summer, autumn, winter (bare trees) or random; default:"
            " that of --date, drawn with --weather random, or that of the stage."
        ),
    ] = "",
    response: Annotated[
        str,
        typer.Option(help="camera (exposure, lens, noise, tone curve, JPEG) or ideal."),
    ] = "camera",
    engine: Annotated[
        str,
        typer.Option(help="What makes the pictures: opengl draws, mitsuba (extra) traces paths."),
    ] = "opengl",
    spacing: Annotated[
        float, typer.Option(min=0.001, help="Distance between two frames of a drive, metres.")
    ] = 10.0,
    fps: Annotated[
        float | None,
        typer.Option(
            min=0.001,
            help="Frames a second of a drive; replaces --spacing by --speed / --fps. In traffic:"
            " ride along with one vehicle after the other.",
        ),
    ] = None,
    speed: Annotated[
        float, typer.Option(min=0.001, help="Speed of a drive, metres a second.")
    ] = 10.0,
    jitter: Annotated[
        bool | None,
        typer.Option(
            help="Random offsets of place, height, heading and pitch; default: for spread only."
        ),
    ] = None,
    outputs: Annotated[
        str | None,
        typer.Option(
            help="Outputs, separated by commas, e.g. rgb,semantic,lidar; default: all but boxes,"
            " flow and lidar. What is left out costs nothing."
        ),
    ] = None,
    lidar_format: Annotated[
        str, typer.Option(help="Files of the output lidar: kitti (.bin, .label), npy or las.")
    ] = "kitti",
    lidar_motion: Annotated[
        bool,
        typer.Option(help="Scan from where the vehicle is at each shot; default: at a moment."),
    ] = False,
    reach: Annotated[
        float,
        typer.Option(
            "--range",
            min=1.0,
            help="Distance within which things are drawn, metres; less takes less memory.",
        ),
    ] = 1000.0,
    cache: Annotated[
        bool,
        typer.Option(help="Take what an earlier run read of the same layers, and keep it."),
    ] = True,
    workers: Annotated[
        int,
        typer.Option(
            min=0,
            help="Number of parallel processes, or of Slurm's jobs; 0 uses all processors. Each"
            " reads the stage and takes memory for it.",
        ),
    ] = 1,
    executor: ExecutorName = "local",
    address: Address = "auto",
    strict: Strict = False,
) -> None:
    """Moves a camera along the road and writes rgb, semantic, instance, part and depth images."""
    from envgen_usd.executors.executor import Cluster
    from envgen_usd.idle_options import refuse_idle
    from envgen_usd.render.frames.frame_export import render_frames
    from envgen_usd.render.frames.frame_folder import DEFAULT_OUTPUTS, LIDAR
    from envgen_usd.render.frames.frame_light import LightChoice, parse_day
    from envgen_usd.render.frames.scan_folder import LidarChoice
    from envgen_usd.render.trajectories.trajectory import Trajectory

    way = Trajectory(trajectory, spacing, fps, speed, jitter)
    refuse_idle(_of_drives(way), f"with --trajectory {trajectory}")
    light = LightChoice(weather, hour, parse_day(date), seed, season)
    kinds = list(DEFAULT_OUTPUTS)
    if outputs is not None:
        kinds = [name.strip() for name in outputs.split(",") if name.strip()]
    if LIDAR not in kinds:
        of_lidars = {
            "--lidar-format": lidar_format != LidarChoice.format,
            "--lidar-motion": lidar_motion,
        }
        refuse_idle(of_lidars, "without the output lidar in --outputs")
    folder = out or stage.parent / "frames"
    cluster = Cluster(executor, workers, address)
    with shown_progress() as progress:
        result = render_frames(
            stage,
            folder,
            frames,
            seed=seed,
            rig=rig,
            trajectory=way,
            light=light,
            response=response,
            engine=engine,
            outputs=kinds,
            lidar=LidarChoice(lidar_format, lidar_motion),
            reach=reach,
            strict=strict,
            cache=cache,
            executor=cluster.executor(folder.absolute() / ".jobs"),
            progress=progress,
        )
    print_issues(result.issues)
    shown = ",".join(kind for kind in kinds if kind not in {"objects", LIDAR})
    if shown:
        print(f"frames: {result.rendered} rendered, {result.kept} kept")
    if result.lidars:
        print(f"scans:  {result.scanned} scanned, {result.scans_kept} kept")
    if result.others:
        print(f"others: {result.others} more frames of this drive are kept")
    if result.removed:
        print(f"gone:   {result.removed} frames of another stage, sensor or drive were removed")
    if result.refused:
        print(f"places: {result.refused} lie inside of or close to an object")
    cameras = f"/{{{','.join(result.cameras)}}}" if len(result.cameras) > 1 else ""
    if shown:
        print(f"images: {folder}{cameras}/{{{shown}}}")
    if result.lidars:
        print(f"points: {folder}/{{{','.join(result.lidars)}}}/points")


def _of_drives(way: "Trajectory") -> dict[str, bool]:
    """Options of drives that a trajectory does not follow, and whether they are given."""
    from envgen_usd.render.trajectories.trajectory import ALL_LANES, DRIVE, TRAFFIC

    if way.name in {DRIVE, ALL_LANES}:
        return {}
    given = {"--spacing": way.spacing != type(way).spacing, "--speed": way.speed != type(way).speed}
    return given if way.name == TRAFFIC else {**given, "--fps": way.fps is not None}
