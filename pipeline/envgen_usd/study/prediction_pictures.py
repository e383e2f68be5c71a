"""Pictures beside their true and their predicted classes."""

import numpy as np

from envgen_usd.label_taxonomy import label
from envgen_usd.models.array_types import ByteArray
from envgen_usd.study.study_classes import CLASSES


def class_colours(classes: ByteArray) -> ByteArray:
    """Classes, ... x H x W, in the colours of the label taxonomy; void is black."""
    colours = np.zeros((256, 3), np.uint8)
    for value, name in enumerate(CLASSES):
        colours[value] = label(name).colour
    painted: ByteArray = colours[classes]
    return painted


def beside_truth(pictures: ByteArray, truth: ByteArray, predicted: ByteArray) -> ByteArray:
    """A sheet with a row for each picture: picture, truth, prediction.

    Args:
        pictures: N x H x W x 3.
        truth: N x H x W.
        predicted: N x H x W.
    """
    rows = np.concatenate((pictures, class_colours(truth), class_colours(predicted)), axis=2)
    return rows.reshape(-1, *rows.shape[2:])
