"""Repair of landuse: removal of tiny areas."""

import numpy as np
from scipy import ndimage

from envgen_usd.models.array_types import ByteArray


def remove_specks(classes: ByteArray, least: int) -> ByteArray:
    """Gives specks, and holes of the same size, the class of the nearest larger area.

    Args:
        classes: H x W.
        least: Least number of connected cells of a class; a larger value removes larger areas.

    Returns:
        Repaired classes, H x W.
    """
    specks = np.zeros(classes.shape, dtype=np.bool_)
    for kind in np.unique(classes):
        parts, _ = ndimage.label(classes == kind)
        sizes = np.bincount(parts.ravel())
        specks |= (sizes < least)[parts] & (parts > 0)
    if least <= 1 or not specks.any() or specks.all():
        return classes
    row, column = ndimage.distance_transform_edt(
        specks, return_distances=False, return_indices=True
    )
    repaired: ByteArray = classes[row, column]
    return repaired
