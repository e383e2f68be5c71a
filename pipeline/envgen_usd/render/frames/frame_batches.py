"""Draws the frames of a drive in several processes, batch by batch."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from envgen_usd.executors.executor import Executor, Tasks
from envgen_usd.render.cameras.camera_pose import Pose
from envgen_usd.render.cameras.sensor_rig import Rig
from envgen_usd.render.frames.frame_light import FrameLight
from envgen_usd.render.frames.frame_run import Drawing, Drive, FrameRun
from envgen_usd.render.frames.shot_drawing import Progress
from envgen_usd.render.stage.stage_scene import StageScene
from envgen_usd.whole_files import part_folder

MOST = 100
"""Largest number of frames of a batch; a larger value reads places less often, shares work less
evenly, and tells of progress less often."""


@dataclass(frozen=True)
class _Shared:
    """What each process needs before its first batch.

    Attributes:
        run: What frames follow from.
        stage: The stage, an absolute path.
        season: Season of the plants; empty for that of the stage.
        cache: Take what an earlier run read of the stage.
        drive: File of the poses.
    """

    run: FrameRun
    stage: str
    season: str
    cache: bool
    drive: Path


@dataclass(frozen=True)
class BatchResult:
    """What processes say of the frames that they drew.

    Attributes:
        renderer: Name of the renderer; empty if only scans were missing.
        hidden: Paths of moving objects that overlapped the vehicle of the sensors.
    """

    renderer: str
    hidden: tuple[str, ...]


@dataclass(frozen=True)
class _Batch:
    frames: int
    said: BatchResult


def draw_in_batches(
    drawing: Drawing, drive: Drive, executor: Executor, progress: Progress, *, cache: bool
) -> BatchResult:
    """Draws what is missing; the bytes are those of a single process.

    Args:
        drawing: All frames of the run.
        drive: Their places.
        executor: Who draws them.
        progress: Called with the step's name, the parts done and the total.
        cache: Take what an earlier run read of the stage.

    Raises:
        EnvgenError: A process cannot draw or write, or was lost too often.
    """
    batches = _batches(drawing, drive, executor.slots)
    total, done = sum(map(len, batches)), 0
    renderers: dict[str, None] = {}
    hidden: dict[str, None] = {}

    def add(batch: _Batch) -> None:
        nonlocal done
        done += batch.frames
        renderers.update(dict.fromkeys(filter(None, [batch.said.renderer])))
        hidden.update(dict.fromkeys(batch.said.hidden))
        progress("draw frames", done, total)

    progress("draw frames", 0, total)
    opened = drawing.opened
    run = replace(drawing.run, out=drawing.run.out.absolute())
    with part_folder(run.out) as folder:
        path = folder / "drive.npz"
        _write_drive(path, drive, run.sensors)
        shared = _Shared(run, opened.path, opened.season, cache, path)
        executor.run(Tasks(_draw_batch, batches, _start, (shared,), on_gpu=True), add)
    return BatchResult(", ".join(renderers), tuple(sorted(hidden)))


def _batches(drawing: Drawing, drive: Drive, slots: int) -> list[tuple[int, ...]]:
    """Numbers of the missing frames; frames of a batch are near one another.

    They follow the frames that are missing and the number of processes. Images do not show it.
    """
    missing = drawing.missing
    eyes = np.array([drive.poses[number].matrix[:3, 3] for number in missing])
    size = min(MOST, -(-len(missing) // slots))
    near = [n for cell in drawing.opened.places(eyes, drawing.run.reach) for n in cell]
    ordered = [missing[place] for place in near]
    return [tuple(ordered[first : first + size]) for first in range(0, len(ordered), size)]


def _write_drive(path: Path, drive: Drive, sensors: Rig) -> None:
    poses = drive.poses
    np.savez(
        path,
        matrix=np.array([pose.matrix for pose in poses]),
        number=np.array([(pose.route, pose.turn) for pose in poses]),
        time=np.array([np.nan if pose.time is None else pose.time for pose in poses]),
        vehicle=np.array([pose.vehicle for pose in poses], dtype=np.str_),
        drawn=np.array(drive.drawn),
        of_reference=np.array(drive.lead == sensors.reference),
    )


def _read_drive(path: Path, sensors: Rig) -> Drive:
    with np.load(path, allow_pickle=False) as file:
        rows = (file[name].tolist() for name in ("number", "time", "vehicle"))
        poses = [
            Pose(matrix, route, turn, None if np.isnan(time) else time, vehicle)
            for matrix, (route, turn), time, vehicle in zip(file["matrix"], *rows, strict=True)
        ]
        lead = sensors.reference if file["of_reference"] else sensors.camera[0]
        return Drive(poses, int(file["drawn"]), lead)


_process: tuple[FrameRun, StageScene, FrameLight, Drive] | None = None


def _start(shared: _Shared) -> None:
    """Opens the stage once for all batches of this process."""
    global _process  # noqa: PLW0603 - the state of a worker process
    opened = StageScene(shared.stage, shared.season, cache=shared.cache)
    lights = FrameLight(shared.run.light, opened.stage, shared.run.weathers)
    _process = shared.run, opened, lights, _read_drive(shared.drive, shared.run.sensors)


def _draw_batch(numbers: Sequence[int]) -> _Batch:
    assert _process is not None
    run, opened, lights, drive = _process
    renderer = Drawing.of(run, opened, lights, drive, numbers).draw(lambda *_: None)
    hidden = tuple(opened.moving.hidden) if opened.moving else ()
    return _Batch(len(numbers), BatchResult(renderer, hidden))
