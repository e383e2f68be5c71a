"""Smooth curves through points, as parametric cubics."""

from dataclasses import dataclass

import numpy as np

from envgen_usd.models.array_types import FloatArray

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(16)
"""Places and weights of Gauss and Legendre on -1 to 1; 16 give lengths of bends to 1e-9."""


@dataclass(frozen=True, eq=False)
class Cubic:
    """A piece of a curve: u(p) = b p + c p² + d p³ along its first heading, v(p) to its left.

    Attributes:
        start: x and y where it begins, metres.
        heading: First heading, radians counter-clockwise from x.
        along: b, c, d of u.
        across: b, c, d of v; b is 0.
        length: Length of the piece, metres.
    """

    start: FloatArray
    heading: float
    along: FloatArray
    across: FloatArray
    length: float

    def end(self) -> tuple[FloatArray, float]:
        """Place where it ends, and heading there in radians."""
        slopes = np.array([1.0, 2.0, 3.0])
        turn = float(np.arctan2(self.across @ slopes, self.along @ slopes))
        x, y = np.cos(self.heading), np.sin(self.heading)
        axes = np.array([[x, y], [-y, x]])
        place = self.start + np.array([self.along.sum(), self.across.sum()]) @ axes
        return place, self.heading + turn

    @property
    def straight(self) -> bool:
        """True for a line with equal steps."""
        return bool(np.abs(self.across).max() < 1e-9 and np.abs(self.along[1:]).max() < 1e-9)


def hermite_cubic(start: FloatArray, end: FloatArray, first: FloatArray, last: FloatArray) -> Cubic:
    """The cubic between two places with given tangents.

    Args:
        start: x and y of its begin.
        end: x and y of its end.
        first: Derivative at its begin; its direction is the first heading.
        last: Derivative at its end.
    """
    size = float(np.hypot(*first))
    x, y = first / size
    axes = np.array([[x, -y], [y, x]])
    goal, into = (end - start) @ axes, last @ axes
    out = np.array([size, 0.0])
    square, cube = 3 * goal - 2 * out - into, out + into - 2 * goal
    along, across = np.stack([out, square, cube], axis=1)
    return Cubic(start, float(np.arctan2(y, x)), along, across, _length(along, across))


def smooth_curve(points: FloatArray) -> list[Cubic]:
    """Cubics through points with continuous heading.

    Hermite cubics with chord-length tangents (Catmull-Rom, centripetal in the weights of both
    chords), which do not overshoot at corners.

    Args:
        points: N x 2, at least two, none equal to its neighbour.
    """
    chords = np.diff(points, axis=0)
    lengths = np.linalg.norm(chords, axis=1)
    units = chords / lengths[:, None]
    inner = units[:-1] / lengths[:-1, None] + units[1:] / lengths[1:, None]
    tangents = np.concatenate([units[:1], inner, units[-1:]])
    size = np.linalg.norm(tangents, axis=1, keepdims=True)
    flat = np.concatenate([units, units[-1:]])
    tangents = np.where(size > 1e-9, tangents / np.maximum(size, 1e-9), flat)
    return [
        hermite_cubic(points[n], points[n + 1], span * tangents[n], span * tangents[n + 1])
        for n, span in enumerate(lengths)
    ]


def turning_cubic(start: FloatArray, heading: float, end: FloatArray, last: float) -> Cubic:
    """The cubic that turns from one heading to another, nearly an arc where an arc fits.

    The handles are those of the cubic that approximates an arc, 4/3 tan(turn / 4) radii.

    Args:
        start: x and y of its begin.
        heading: Heading there, radians.
        end: x and y of its end.
        last: Heading there, radians.
    """
    turn = abs((last - heading + np.pi) % (2.0 * np.pi) - np.pi)
    chord = float(np.hypot(*(end - start)))
    # chord = 2 R sin(turn / 2), a handle is 4/3 tan(turn / 4) R, a tangent is three handles.
    tangent = chord if turn < 1e-3 else 2.0 * chord * np.tan(turn / 4) / np.sin(turn / 2)
    return hermite_cubic(
        start, end,
        tangent * np.array([np.cos(heading), np.sin(heading)]),
        tangent * np.array([np.cos(last), np.sin(last)]),
    )  # fmt: skip


def _length(along: FloatArray, across: FloatArray) -> float:
    share = 0.5 * (_NODES + 1.0)
    speeds = np.hypot(*(b + 2 * c * share + 3 * d * share**2 for b, c, d in (along, across)))
    return 0.5 * float(_WEIGHTS @ speeds)
