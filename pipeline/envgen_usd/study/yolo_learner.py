"""YOLOv8-n of ultralytics as a network of a study, in a process of its own.

ultralytics is AGPL-3.0, so this package neither imports nor needs it: `yolo_process` runs it, and
files go to and fro. It segments instances from polygons, as in the article; a polygon loses its
holes, and where it finds nothing the nearest instance counts.
"""

import json
import subprocess
import sys
import tempfile
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from PIL import Image
from rasterio.features import shapes
from scipy.ndimage import distance_transform_edt

from envgen_usd.errors import EnvgenError
from envgen_usd.idle_options import refuse_idle
from envgen_usd.models.array_types import ByteArray
from envgen_usd.study.first_weights import check_weights_file
from envgen_usd.study.labelled_images import Images
from envgen_usd.study.learners import Lesson, Predictor, Watcher
from envgen_usd.study.study_classes import CLASSES, VOID
from envgen_usd.study.training_options import TrainingOptions

_LEAST_AREA = 8
"""Least area of a polygon, pixels; a larger value leaves small poles out."""


class YoloLearner:
    """Trains ``yolov8n-seg`` from random or given weights."""

    def __init__(self, options: TrainingOptions) -> None:
        """Args: how to train; batches, class weights and adaptation are ultralytics' own.

        Raises:
            EnvgenError: ultralytics is not installed, an option has no effect with it, or the
                weights are no file of weights.
        """
        if find_spec("ultralytics") is None:
            raise EnvgenError(
                f"--network {options.network}: needs ultralytics (AGPL-3.0);"
                " pip install 'envgen-usd[ultralytics]', or choose --network small"
            )
        idle = {
            "--adapt": options.adaptation != "none",
            "--class-weights": options.class_weights != "none",
            "--balanced": options.balanced,
            "--schedule": options.schedule != "joint",
            "--batch-norm": options.batch_norm != TrainingOptions.batch_norm,
            "--rate": options.rate != TrainingOptions.rate,
        }
        refuse_idle(idle, f"with --network {options.network}")
        if options.weights:  # before any file is written
            check_weights_file(Path(options.weights))
        self._options = options

    def learn(self, lesson: Lesson, watch: Watcher) -> Predictor:
        """Trains from the start and returns the trained network; it is not watched on the way.

        Raises:
            EnvgenError: The process failed.
        """
        del watch
        folder = tempfile.TemporaryDirectory(prefix="envgen-usd.yolo.")
        root = Path(folder.name)
        count = _write_images(root, 0, lesson.synthetic)
        count = _write_images(root, count, lesson.real)
        names = "".join(f"  {number}: {name}\n" for number, name in enumerate(CLASSES))
        data = f"path: {root}\ntrain: images\nval: images\nnames:\n{names}"
        (root / "data.yaml").write_text(data, encoding="utf-8")
        options = self._options
        epochs = options.epochs or max(lesson.steps * options.batch // max(count, 1), 1)
        _call(
            root,
            {
                "do": "train",
                "model": options.weights or f"{options.network}-seg.yaml",
                "epochs": epochs,
                "batch": options.batch,
                "size": max(options.size),
                "seed": lesson.seed,
                "augmented": lesson.augmented,
            },
        )

        def predict(pictures: ByteArray, size: tuple[int, int]) -> ByteArray:
            np.save(root / "asked.npy", pictures)
            _call(root, {"do": "predict", "size": max(options.size)})
            said = np.load(root / "answer.npy")
            assert folder.name  # the closure keeps the folder
            return np.stack([_at_size(_filled(each), size) for each in said])

        return predict


def polygon_lines(classes: ByteArray) -> list[str]:
    """Lines of a label file of YOLO: class and outline, as shares of width and height.

    Args:
        classes: H x W, 0 to 6 or void.
    """
    height, width = classes.shape
    lines = []
    for shape, value in shapes(classes, mask=classes != VOID, connectivity=4):
        ring = np.array(shape["coordinates"][0][:-1], np.float64)
        x, y = ring[:, 0], ring[:, 1]
        area = abs(x @ np.roll(y, 1) - y @ np.roll(x, 1)) / 2.0
        if area >= _LEAST_AREA:
            places = (ring / (width, height)).round(5).reshape(-1)
            lines.append(" ".join([str(int(value)), *map(str, places.tolist())]))
    return lines


def _write_images(root: Path, first: int, images: Images) -> int:
    """Writes pictures and polygons; returns the number of the next image."""
    for kind in ("images", "labels"):
        (root / kind).mkdir(exist_ok=True)
    pairs = zip(images.pictures, images.classes, strict=True)
    number = first
    for number, (picture, classes) in enumerate(pairs, first + 1):
        Image.fromarray(picture).save(root / "images" / f"{number:06d}.png")
        text = "\n".join(polygon_lines(classes)) + "\n"
        (root / "labels" / f"{number:06d}.txt").write_text(text, encoding="utf-8")
    return number


def _call(root: Path, job: dict[str, object]) -> None:
    path = root / "job.json"
    path.write_text(json.dumps(job), encoding="utf-8")
    words = [sys.executable, "-P", "-m", "envgen_usd.study.yolo_process", str(path)]
    result = subprocess.run(words, capture_output=True, text=True, check=False)
    if result.returncode:
        last = (result.stderr.strip().splitlines() or ["no message"])[-1]
        raise EnvgenError(f"ultralytics failed to {job['do']}: {last}")


def _filled(classes: ByteArray) -> ByteArray:
    """Gives pixels without an instance the class of the nearest one; road if there is none."""
    if (classes == VOID).all():
        return np.zeros_like(classes)
    places = distance_transform_edt(classes == VOID, return_distances=False, return_indices=True)
    filled: ByteArray = classes[tuple(places)]
    return filled


def _at_size(classes: ByteArray, size: tuple[int, int]) -> ByteArray:
    height, width = size
    image = Image.fromarray(classes).resize((width, height), Image.Resampling.NEAREST)
    return np.asarray(image)
