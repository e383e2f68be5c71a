"""Carries the runs of a study out, each into a file of its own, and goes on where it stopped."""

import hashlib
import json
import os
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from PIL import Image

from envgen_usd.errors import EnvgenError
from envgen_usd.models.array_types import ByteArray, IntArray
from envgen_usd.step_clock import Progress
from envgen_usd.study.flat_pictures import flat_pictures
from envgen_usd.study.labelled_images import Images, LabelledImage, decoded, full_classes
from envgen_usd.study.learners import Learner, Lesson, Predictor
from envgen_usd.study.prediction_pictures import beside_truth
from envgen_usd.study.segmentation_scores import confusion, scores
from envgen_usd.study.study_protocol import Run, StudyPlan, run_images, scored_images
from envgen_usd.study.torch_learner import TorchLearner
from envgen_usd.study.training_options import TrainingOptions
from envgen_usd.whole_files import make_folder, whole_file, write_whole
from envgen_usd.workers import run_in_workers

RUNS = "runs"
"""Folder with the result of each run."""
MARK = "study.json"
"""File that says which study a folder holds."""
_CURVE_IMAGES = 24
"""Test images that a curve is scored on; a larger value makes curves steadier and runs longer."""
_SHOWN = 4
"""Predictions that are kept as pictures, of each run."""
_SCORED = 32
"""Images that are scored at once; a larger value is faster and takes memory."""
_QUALITY = 88
"""Quality of JPEG, 0 to 95; a larger value makes larger files."""


@dataclass(frozen=True, eq=False)
class Exercise:
    """A training, and the images that it is scored on.

    Attributes:
        lesson: What the network learns from.
        options: How.
        tested: Images that it is scored on.
        record: What the result's file says of it.
        change: Changes the test images before they are scored; None leaves them.
    """

    lesson: Lesson
    options: TrainingOptions
    tested: tuple[LabelledImage, ...]
    record: dict[str, Any]
    change: Callable[[Images], Images] | None = None

    def decoded(self, images: Sequence[LabelledImage]) -> Images:
        """Images as the network sees them."""
        seen = decoded(images, self.options.size)
        return self.change(seen) if self.change else seen


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
        jobs: Number of processes; each takes an even part of the processors.
        shard: i and n: only part i of n parts of the runs.
        progress: Called with the step's name, the parts done and the total.

    Raises:
        EnvgenError: The folder holds another study, an image cannot be read, or a training failed.
    """
    images = [image for fold in plan.folds for image in fold.test]
    if plan.protocol.random_split:
        images += plan.folds[0].train
    random_split = plan.protocol.random_split
    open_folder(out, plan.options, (*images, *plan.synthetic), random_split=random_split)
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
    if jobs > 1:
        work = [(plan, out, run) for run in open_runs]
        run_in_workers(_run_job, work, jobs, _start, (threads,), count)
    else:
        for run in open_runs:
            _carry_out(plan, out, run)
            count(run.name)
    missing = sum(not result_file(out, run).is_file() for run in plan.runs)
    return StudyWork(len(open_runs), len(asked) - len(open_runs), missing)


def open_folder(
    out: Path,
    options: TrainingOptions,
    images: Sequence[LabelledImage],
    *,
    random_split: bool = False,
) -> None:
    """Marks a folder with what its results follow from.

    Args:
        out: The folder; it is created.
        options: How networks are trained.
        images: All images.
        random_split: The split is random.

    Raises:
        EnvgenError: The folder holds results of other options or images, or cannot be written.
    """
    make_folder(out / RUNS)
    path, mark = out / MARK, _mark(options, random_split, images)
    if path.is_file():
        earlier = json.loads(path.read_text(encoding="utf-8"))
        if earlier.get("mark") != mark:
            before, now = earlier.get("options", {}), asdict(options)
            other = [key for key in now if before.get(key) != now[key]]
            fault = f"{other[0]} was {before.get(other[0])!r}" if other else "its images differ"
            raise EnvgenError(f"{out}: holds another study: {fault}; choose another --out")
        return
    content = {"mark": mark, "options": asdict(options)}
    write_whole(path, json.dumps(content, indent=1) + "\n")


def _mark(options: TrainingOptions, random_split: bool, images: Sequence[LabelledImage]) -> str:
    files = [
        [image.name, image.sequence, image.picture.stat().st_size, image.labels.stat().st_size]
        for image in images
    ]
    tables = sorted({image.table.hex() for image in images})
    content = json.dumps([asdict(options), random_split, files, tables], sort_keys=True)
    return hashlib.sha256(content.encode()).hexdigest()


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
    except (OSError, ValueError, KeyError) as error:
        fault = f"cannot be read ({error}); remove it, and run the study again"
        raise EnvgenError(f"{path}: {fault}") from error


def learner_of(options: TrainingOptions) -> Learner:
    """The learner of a network's name.

    Raises:
        EnvgenError: Its library is missing.
    """
    if options.network.startswith("yolo"):
        from envgen_usd.study.yolo_learner import YoloLearner  # noqa: PLC0415 - an extra

        return YoloLearner(options)
    return TorchLearner(options)


def read_counts(path: Path) -> IntArray:
    """Confusion matrix of each image, N x C x C, of a result."""
    counts = json.loads(path.read_text(encoding="utf-8"))["counts"]
    return np.array(counts, np.int64)


def _scored(predict: Predictor, exercise: Exercise) -> IntArray:
    """Confusion matrix of each test image in the size of its labels, N x C x C."""
    counts: list[IntArray] = []
    for first in range(0, len(exercise.tested), _SCORED):
        part = exercise.tested[first : first + _SCORED]
        truths = [full_classes(image) for image in part]
        pictures = exercise.decoded(part).pictures
        alike = len({truth.shape for truth in truths}) == 1
        said = (
            predict(pictures, _shape(truths[0]))
            if alike
            else [predict(pictures[n : n + 1], _shape(t))[0] for n, t in enumerate(truths)]
        )
        counts += [confusion(t, p) for t, p in zip(truths, said, strict=True)]
    return np.stack(counts)


def device_name() -> str:
    """What trainings run on: the GPU, or the CPU with its threads."""
    if torch.cuda.is_available():
        return torch.cuda.get_device_name()
    return f"CPU, {torch.get_num_threads()} threads"


def _start(threads: int) -> None:
    torch.set_num_threads(threads)


def _run_job(job: tuple[StudyPlan, Path, Run]) -> str:
    _carry_out(*job)
    return job[2].name


def _carry_out(plan: StudyPlan, out: Path, run: Run) -> None:
    exercise = Exercise(_lesson(plan, run), plan.options, scored_images(plan, run), asdict(run))
    carry_exercise_out(exercise, result_file(out, run))


def carry_exercise_out(exercise: Exercise, path: Path) -> None:
    """Trains and scores, and writes the result and some predictions.

    Args:
        exercise: What is learnt and scored.
        path: File of the result; pictures get its name with another suffix.

    Raises:
        EnvgenError: An image cannot be read, the training failed, or a file cannot be written.
    """
    begun, options, tested = time.perf_counter(), exercise.options, exercise.tested
    some = exercise.decoded(tested[:: max(len(tested) // _CURVE_IMAGES, 1)])
    curve: list[tuple[int, float, float]] = []

    def watch(step: int, loss: float, predict: Predictor) -> None:
        said = predict(some.pictures, (options.height, options.width))
        counts = np.sum([confusion(t, p) for t, p in zip(some.classes, said, strict=True)], axis=0)
        curve.append((step, loss, float(scores(counts).miou)))

    predict = learner_of(options).learn(exercise.lesson, watch)
    counts = _scored(predict, exercise)
    _keep_pictures(predict, exercise, path.with_suffix(".jpg"))
    content = {
        "run": exercise.record,
        "seconds": round(time.perf_counter() - begun, 1),
        "device": device_name(),
        "curve": curve,
        "images": [f"{image.sequence}/{image.name}" for image in tested],
        "counts": counts.tolist(),
    }
    write_whole(path, json.dumps(content) + "\n")


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


def _keep_pictures(predict: Predictor, exercise: Exercise, path: Path) -> None:
    """Writes some test pictures beside truth and prediction."""
    tested, options = exercise.tested, exercise.options
    places = np.linspace(0, len(tested) - 1, min(_SHOWN, len(tested))).round().astype(int)
    seen = exercise.decoded([tested[index] for index in places.tolist()])
    said = predict(seen.pictures, (options.height, options.width))
    with whole_file(path) as part:
        sheet = beside_truth(seen.pictures, seen.classes, said)
        Image.fromarray(sheet).save(part, "JPEG", quality=_QUALITY)


def _shape(truth: ByteArray) -> tuple[int, int]:
    return truth.shape[0], truth.shape[1]
