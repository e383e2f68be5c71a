"""A training and its score, as a result file."""

import json
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from PIL import Image

from envgen_usd.models.array_types import ByteArray, IntArray
from envgen_usd.study.labelled_images import Images, LabelledImage, decoded, full_classes
from envgen_usd.study.learners import Learner, Lesson, Predictor
from envgen_usd.study.prediction_pictures import beside_truth
from envgen_usd.study.segmentation_scores import confusion, scores
from envgen_usd.study.torch_learner import TorchLearner
from envgen_usd.study.training_options import TrainingOptions
from envgen_usd.whole_files import whole_file, write_whole

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


def read_counts(path: Path) -> IntArray:
    """Confusion matrix of each image, N x C x C, of a result."""
    counts = json.loads(path.read_text(encoding="utf-8"))["counts"]
    return np.array(counts, np.int64)


def learner_of(options: TrainingOptions) -> Learner:
    """The learner of a network's name.

    Raises:
        EnvgenError: Its library is missing.
    """
    if options.network.startswith("yolo"):
        from envgen_usd.study.yolo_learner import YoloLearner  # noqa: PLC0415 - an extra

        return YoloLearner(options)
    return TorchLearner(options)


def device_name() -> str:
    """What trainings run on: the GPU, or the CPU with its threads."""
    if torch.cuda.is_available():
        return torch.cuda.get_device_name()
    return f"CPU, {torch.get_num_threads()} threads"


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
