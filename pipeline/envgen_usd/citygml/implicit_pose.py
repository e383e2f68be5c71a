"""Pose of implicit geometry: heading, pitch, roll and the rotation matrix."""

import math

import numpy as np

from envgen_usd.models.array_types import FloatArray

_DIGITS = 9


def rotation(heading: float, pitch: float, roll: float) -> FloatArray:
    """Returns the 3 x 3 rotation matrix of a template: roll first, then pitch, then heading.

    Args:
        heading: Radians about z, counter-clockwise.
        pitch: Radians, positive lifts +x.
        roll: Radians about +x.
    """
    ch, sh = math.cos(heading), math.sin(heading)
    cp, sp = math.cos(pitch), math.sin(pitch)
    cr, sr = math.cos(roll), math.sin(roll)
    about_z = np.array([[ch, -sh, 0.0], [sh, ch, 0.0], [0.0, 0.0, 1.0]])
    about_y = np.array([[cp, 0.0, -sp], [0.0, 1.0, 0.0], [sp, 0.0, cp]])
    about_x = np.array([[1.0, 0.0, 0.0], [0.0, cr, -sr], [0.0, sr, cr]])
    turned: FloatArray = about_z @ about_y @ about_x
    return turned


def angles(matrix: FloatArray) -> tuple[float, float, float]:
    """Returns (heading, pitch, roll) of a 3 x 3 matrix, which may contain a scale.

    Angles are rounded to 1e-9 rad, so that angles with nine decimals survive a round trip. At a
    pitch of ±90° only the sum of heading and roll is defined; roll is then zero.
    """
    level = math.hypot(matrix[0, 0], matrix[1, 0])
    scale = math.sqrt(float((matrix[:, 0] ** 2).sum())) or 1.0
    pitch = math.atan2(matrix[2, 0], level)
    if level < 1e-9 * scale:
        heading, roll = math.atan2(-matrix[0, 1], matrix[1, 1]), 0.0
    else:
        heading = math.atan2(matrix[1, 0], matrix[0, 0])
        roll = math.atan2(matrix[2, 1], matrix[2, 2])
    return round(heading, _DIGITS), round(pitch, _DIGITS), round(roll, _DIGITS)
