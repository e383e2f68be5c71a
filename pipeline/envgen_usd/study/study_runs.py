"""Carries the runs of a study out, each into a file of its own, and goes on where it stopped."""

import json
import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch

from envgen_usd.errors import EnvgenError
from envgen_usd.models.array_types import ByteArray, IntArray
from envgen_usd.step_clock import Progress
from envgen_usd.study.flat_pictures import flat_pictures
from envgen_usd.study.labelled_images import Images, decoded
from envgen_usd.study.learners import Lesson
from envgen_usd.study.study_folder import RUNS, open_folder
from envgen_usd.study.study_protocol import Run, StudyPlan, run_images, scored_images
from envgen_usd.study.training_exercise import Exercise, carry_exercise_out
from envgen_usd.workers import Workers


@dataclass(frozen=True, eq=False)
class RunResult:
    """The result of a run.

    Attributes:
        run: The run.
        images: Name of each image that it was scored on, with its sequence before it.
        counts: Confusion matrix of each image, N x C x C.
        curve: Step, mean loss, and mIoU on some of the test images, at several steps.
        seconds: Time of training and scoring.
        device: What it ran on.
    """

    run: Run
    images: tuple[str, ...]
    counts: IntArray
    curve: tuple[tuple[int, float, float], ...]
    seconds: float
    device: str


@dataclass(frozen=True)
class StudyWork:
    """What was done.

    Attributes:
        trained: Runs that were trained now.
        kept: Runs of earlier calls.
        missing: Runs of the plan that no call has done; of other shards, say.
    """

    trained: int
    kept: int
    missing: int


def run_study(
    plan: StudyPlan,
    out: Path,
    *,
    jobs: int = 1,
    shard: tuple[int, int] = (1, 1),
    progress: Progress = lambda *_: None,
) -> StudyWork:
    """Trains what is missing of a study, or of a part of it.

    Args:
        plan: The study.
        out: Its folder.
        jobs: Number of trainings side by side: threads with queues of their own on a GPU, else
            processes, which take even parts of the processors.
        shard: i and n: only part i of n parts of the runs.
        progress: Called with the step's name, the parts done and the total.

    Raises:
        EnvgenError: The folder holds another study, an image cannot be read, or a training failed.
    """
    images = [image for fold in plan.folds for image in fold.test]
    if plan.protocol.random_split:
        images += plan.folds[0].train
    random_split = plan.protocol.random_split
    # Names of runs tell their synthetic images, so that those alone with real ones are kept.
    open_folder(out, plan.options, images, random_split=random_split)
    asked = plan.runs[shard[0] - 1 :: shard[1]]
    open_runs = [run for run in asked if not result_file(out, run).is_file()]
    progress("train", 0, max(len(open_runs), 1))
    done = 0

    def count(_name: str) -> None:
        nonlocal done
        done += 1
        progress("train", done, len(open_runs))

    jobs = max(min(jobs, len(open_runs)), 1)
    threads = max((os.cpu_count() or 1) // jobs, 1)
    if jobs > 1 and torch.cuda.is_available():
        _side_by_side(plan, out, open_runs, jobs, count)
    elif jobs > 1:
        work = [(plan, out, run) for run in open_runs]
        with Workers(jobs) as workers:
            workers.run(_run_job, work, _start, (threads,), count)
    else:
        for run in open_runs:
            _carry_out(plan, out, run)
            count(run.name)
    missing = sum(not result_file(out, run).is_file() for run in plan.runs)
    return StudyWork(len(open_runs), len(asked) - len(open_runs), missing)


def result_file(out: Path, run: Run) -> Path:
    """The file of a run's result."""
    return out / RUNS / f"{run.name}.json"


def read_result(out: Path, run: Run) -> RunResult:
    """Reads the result of a run.

    Raises:
        EnvgenError: The file is missing or cannot be read.
    """
    path = result_file(out, run)
    try:
        content: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        return RunResult(
            run,
            tuple(content["images"]),
            np.array(content["counts"], np.int64),
            tuple((int(a), float(b), float(c)) for a, b, c in content["curve"]),
            float(content["seconds"]),
            str(content["device"]),
        )
    except (OSError, ValueError, TypeError, KeyError) as error:
        fault = f"cannot be read ({error}); remove it, and run the study again"
        raise EnvgenError(f"{path}: {fault}") from error


def _side_by_side(
    plan: StudyPlan, out: Path, runs: Sequence[Run], jobs: int, count: Callable[[str], None]
) -> None:
    """Trains in threads, which share the GPU; after a fault no more begin."""
    with ThreadPoolExecutor(jobs) as pool:
        trainings = [pool.submit(_run_job, (plan, out, run)) for run in runs]
        try:
            for training in as_completed(trainings):
                count(training.result())
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def _start(threads: int) -> None:
    torch.set_num_threads(threads)


def _run_job(job: tuple[StudyPlan, Path, Run]) -> str:
    _carry_out(*job)
    return job[2].name


def _carry_out(plan: StudyPlan, out: Path, run: Run) -> None:
    exercise = Exercise(_lesson(plan, run), plan.options, scored_images(plan, run), asdict(run))
    carry_exercise_out(exercise, result_file(out, run))


def _lesson(plan: StudyPlan, run: Run) -> Lesson:
    options = plan.options
    real, synthetic = run_images(plan, run)
    frames = decoded(synthetic, options.size)
    if run.flat:
        names = [image.name for image in synthetic]
        frames = Images(flat_pictures(frames.classes, names, run.seed), frames.classes)
    steps = options.steps(run.pace)
    photographs = decoded(real, options.size)
    return Lesson(photographs, frames, _unlabelled(plan, run), run.seed, run.augmented, steps)


def _unlabelled(plan: StudyPlan, run: Run) -> ByteArray:
    """Real pictures of the training sequences for the adaptation."""
    options = plan.options
    if options.adaptation == "none" or not run.fold:
        return decoded((), options.size).pictures
    train = plan.fold(run.fold).train
    count = min(options.unlabelled or len(train), len(train))
    order = np.linspace(0, len(train) - 1, count).round().astype(int).tolist()
    return decoded([train[index] for index in order], options.size).pictures
