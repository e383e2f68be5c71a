"""Frames that several processes draw have the bytes of those of one process."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from envgen_usd.errors import EnvgenError
from envgen_usd.executors.executor import LocalProcesses, Tasks
from envgen_usd.render.frames.frame_export import RenderResult, render_frames
from envgen_usd.render.frames.frame_light import LightChoice
from envgen_usd.render.trajectories.trajectory import Trajectory

FRAMES = 5
TWO = LocalProcesses(2)
SENSORS = """
[[camera]]
name = "ahead"
width = 64
height = 32
fx = 40.0
fy = 40.0
cx = 31.5
cy = 15.5
position = [0.0, 0.0, 1.6]
rotation = [0.0, 0.0, 0.0]
[[camera]]
name = "behind"
width = 64
height = 32
fx = 40.0
fy = 40.0
cx = 31.5
cy = 15.5
position = [0.0, 0.0, 1.6]
rotation = [0.0, 0.0, 180.0]
[[lidar]]
name = "top"
model = "Velodyne VLP-16"
position = [0.0, 0.0, 1.9]
"""


def content(folder: Path) -> dict[str, bytes]:
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file()
    }


@pytest.fixture
def drawn(street: Path, tmp_path: Path) -> Callable[..., RenderResult]:
    """Draws a drive with two cameras and a lidar, in weathers drawn at random."""
    rig = tmp_path / "rig.toml"
    rig.write_text(SENSORS)

    def draw(name: str, frames: int = FRAMES, executor: LocalProcesses | None = None, **more):
        return render_frames(
            street,
            tmp_path / name,
            frames,
            rig=str(rig),
            light=LightChoice("random", seed=5),
            trajectory=Trajectory("drive", fps=10.0),
            outputs=("rgb", "semantic", "flow", "objects", "lidar"),
            executor=executor,
            **more,
        )

    return draw


def test_two_processes_draw_the_same(drawn: Callable[..., RenderResult], tmp_path: Path) -> None:
    told: list[tuple[str, int, int]] = []
    alone = drawn("alone")
    together = drawn("together", executor=TWO, progress=lambda *step: told.append(step))
    assert content(tmp_path / "together") == content(tmp_path / "alone")
    assert together == alone
    assert (alone.rendered, alone.scanned) == (2 * FRAMES, FRAMES)
    steps = [done for name, done, _ in told if name == "draw frames"]
    assert steps == sorted(steps)
    assert (steps[0], steps[-1]) == (0, FRAMES)


@dataclass(frozen=True)
class Asked(LocalProcesses):
    """Does all tasks in this process, and notes whether they want a GPU."""

    wanted: list[bool] = field(default_factory=list)

    def run(self, tasks: Tasks, done: Callable) -> None:
        self.wanted.append(tasks.on_gpu)
        LocalProcesses(1).run(tasks, done)


def test_frames_are_tasks_that_want_a_gpu(
    drawn: Callable[..., RenderResult], tmp_path: Path
) -> None:
    asked = Asked(2)
    drawn("alone")
    drawn("asked", executor=asked)
    assert asked.wanted == [True]
    assert content(tmp_path / "asked") == content(tmp_path / "alone")


def test_what_is_missing_is_drawn(drawn: Callable[..., RenderResult], tmp_path: Path) -> None:
    drawn("folder")
    whole = content(tmp_path / "folder")
    (tmp_path / "folder" / "ahead" / "rgb" / "000001.png").unlink()
    (tmp_path / "folder" / "top" / "points" / "000003.bin").unlink()
    result = drawn("folder", executor=TWO)
    assert (result.rendered, result.kept) == (1, 2 * FRAMES - 1)
    assert (result.scanned, result.scans_kept) == (1, FRAMES - 1)
    assert content(tmp_path / "folder") == whole


def test_a_finished_run_starts_no_process(drawn: Callable[..., RenderResult]) -> None:
    class Refused(LocalProcesses):
        def run(self, tasks: Tasks, done: Callable) -> None:
            raise AssertionError(tasks, done)

    drawn("folder", 2)
    result = drawn("folder", 2, Refused(2))
    assert (result.rendered, result.kept) == (0, 4)


def test_a_fault_of_a_process_is_told(drawn: Callable[..., RenderResult], tmp_path: Path) -> None:
    """A file lies where a folder has to be; the folder of the run has no part of a file."""
    drawn("folder", 2)
    for path in (tmp_path / "folder" / "ahead" / "rgb").iterdir():
        path.unlink()
    (tmp_path / "folder" / "ahead" / "rgb" / "000001.png").mkdir()
    with pytest.raises(EnvgenError, match=r"000001\.png"):
        drawn("folder", 2, TWO)
    assert not [*(tmp_path / "folder").rglob(".*")]
