"""Scores of a segmentation from its confusion matrix."""

from dataclasses import dataclass

import numpy as np

from envgen_usd.models.array_types import ByteArray, FloatArray, IntArray
from envgen_usd.study.study_classes import CLASSES


@dataclass(frozen=True, eq=False)
class Scores:
    """Scores of one or several confusion matrices.

    Attributes:
        overall: ..., share of the counted pixels whose class is right ("global accuracy").
        mean_class: ..., mean share over the classes that the truth has.
        miou: ..., mean intersection over union of the classes that the truth has.
        iou: ... x C, by class; NaN where the truth has none of it.
        accuracy: ... x C, by class; NaN where the truth has none of it.
    """

    overall: FloatArray
    mean_class: FloatArray
    miou: FloatArray
    iou: FloatArray
    accuracy: FloatArray


def confusion(truth: ByteArray, predicted: ByteArray) -> IntArray:
    """Numbers of pixels, C x C: row is the true class, column the predicted one; void is left out.

    Args:
        truth: H x W, 0 to 6 or void.
        predicted: H x W, 0 to 6.
    """
    count = len(CLASSES)
    # A row more for void, so that no pixel has to be taken out.
    pairs = np.minimum(truth, count) * np.uint8(count) + predicted
    return np.bincount(pairs.ravel(), minlength=count * count)[: count * count].reshape(count, -1)


def scores(matrices: IntArray | FloatArray) -> Scores:
    """Scores of confusion matrices, ... x C x C, of counts or of weighted counts."""
    matrices = np.asarray(matrices, np.float64)
    right = np.diagonal(matrices, axis1=-2, axis2=-1)
    true, said = matrices.sum(-1), matrices.sum(-2)
    there = true > 0
    with np.errstate(invalid="ignore", divide="ignore"):
        accuracy = right / true
        iou = right / (true + said - right)
        total = right.sum(-1) / true.sum(-1)
        present = there.sum(-1)
        mean_class = np.where(there, accuracy, 0.0).sum(-1) / present
        miou = np.where(there, iou, 0.0).sum(-1) / present
        iou = np.where(there, iou, np.nan)
    return Scores(total, mean_class, miou, iou, accuracy)
