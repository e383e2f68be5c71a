"""Lens models: from directions before a camera to places on its image plane, and back.

Places are those of a focal length of 1 about the principal point: a pixel is ``fx * x + cx``,
``fy * y + cy``. Directions are in camera space as in OpenCV: x right, y down, z forward. The
formulas are those of OpenCV (``calib3d``, its ``fisheye`` and ``omnidir``).
"""

from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal, TypeAlias

import numpy as np
from msgspec import Meta

from envgen_usd.models.array_types import FloatArray

WIDEST_FIELD = 250.0
"""Largest field of view, degrees; the views that cover a lens leave out what lies behind."""
_WIDEST_PERSPECTIVE = 80.0
"""Largest angle from the optical axis of a lens with an image plane, degrees."""
_SAMPLES = 4096
"""Samples of the radial curve; a larger value starts the inversion nearer to its end."""
_STEPS = 3
"""Newton steps of an inversion; more steps reach places nearer to where the image folds."""
_RESIDUAL = 1e-9
"""Largest error of an inverted place; a larger value accepts places where the image folds."""

Coefficient: TypeAlias = Annotated[float, Meta(ge=-1e6, le=1e6)]
Field: TypeAlias = Annotated[float, Meta(ge=1.0, le=WIDEST_FIELD)]


@dataclass(frozen=True)
class Pinhole:
    """The perspective projection, without distortion.

    Attributes:
        model: Name of the model.
    """

    model: Literal["pinhole"] = "pinhole"
    has_ranges: ClassVar[bool] = False

    def project(self, directions: FloatArray) -> FloatArray:
        """Places (N x 2) of directions (N x 3); NaN behind the camera."""
        return _perspective(directions, np.radians(90.0) - 1e-9)

    def directions(self, places: FloatArray) -> FloatArray:
        """Unit directions (N x 3) of places (N x 2)."""
        return _unit(np.column_stack((places, np.ones(len(places)))))


@dataclass(frozen=True)
class BrownConrady:
    """Radial and decentring distortion (Brown 1966); coefficients as in OpenCV.

    Attributes:
        model: Name of the model.
        k1: Radial distortion, second order.
        k2: Radial distortion, fourth order.
        p1: Decentring distortion along y.
        p2: Decentring distortion along x.
        k3: Radial distortion, sixth order.
    """

    model: Literal["brown_conrady"]
    k1: Coefficient = 0.0
    k2: Coefficient = 0.0
    p1: Coefficient = 0.0
    p2: Coefficient = 0.0
    k3: Coefficient = 0.0
    has_ranges: ClassVar[bool] = False

    def project(self, directions: FloatArray) -> FloatArray:
        """Places (N x 2) of directions (N x 3); NaN where the image would fold."""
        distortion = self._distortion()
        plane = _perspective(directions, np.arctan(distortion.limit))
        return distortion.distorted(plane)

    def directions(self, places: FloatArray) -> FloatArray:
        """Unit directions (N x 3) of places (N x 2); NaN outside of the image."""
        plane = self._distortion().undistorted(places)
        return _unit(np.column_stack((plane, np.ones(len(plane)))))

    def _distortion(self) -> "_Distortion":
        widest = float(np.tan(np.radians(_WIDEST_PERSPECTIVE)))
        return _Distortion(self.k1, self.k2, self.k3, self.p1, self.p2, widest)


@dataclass(frozen=True)
class KannalaBrandt:
    """A fisheye lens (Kannala and Brandt, PAMI 2006); coefficients as in OpenCV's ``fisheye``.

    Attributes:
        model: Name of the model.
        k1: Coefficient of the third power of the angle.
        k2: Coefficient of the fifth power.
        k3: Coefficient of the seventh power.
        k4: Coefficient of the ninth power.
        field: Angle of view across the image circle, degrees; the image is black beyond.
    """

    model: Literal["kannala_brandt"]
    k1: Coefficient = 0.0
    k2: Coefficient = 0.0
    k3: Coefficient = 0.0
    k4: Coefficient = 0.0
    field: Field = 180.0
    has_ranges: ClassVar[bool] = True

    def project(self, directions: FloatArray) -> FloatArray:
        """Places (N x 2) of directions (N x 3); NaN outside of the image circle."""
        across = np.hypot(directions[:, 0], directions[:, 1])
        angles = np.arctan2(across, directions[:, 2])
        curve = self._curve()
        radii = np.where(angles <= curve.limit, curve.at(angles), np.nan)
        scale = np.divide(
            radii, across, out=np.where(np.isnan(radii), np.nan, 1.0), where=across > 0
        )
        return directions[:, :2] * scale[:, None]

    def directions(self, places: FloatArray) -> FloatArray:
        """Unit directions (N x 3) of places (N x 2); NaN outside of the image circle."""
        radii = np.hypot(places[:, 0], places[:, 1])
        angles = self._curve().inverse(radii)
        turn = places / np.maximum(radii, 1e-300)[:, None]
        return np.column_stack((turn * np.sin(angles)[:, None], np.cos(angles)))

    def _curve(self) -> "_OddCurve":
        return _OddCurve((self.k1, self.k2, self.k3, self.k4), np.radians(self.field / 2))


@dataclass(frozen=True)
class Mei:
    """The unified model with distortion (Mei and Rives, ICRA 2007), as KITTI-360's fisheyes.

    Attributes:
        model: Name of the model.
        xi: Distance of the projection's centre from that of the unit sphere.
        k1: Radial distortion, second order.
        k2: Radial distortion, fourth order.
        p1: Decentring distortion along y.
        p2: Decentring distortion along x.
        field: Angle of view across the image circle, degrees; the image is black beyond.
    """

    model: Literal["mei"]
    xi: Annotated[float, Meta(ge=0.0, le=100.0)]
    k1: Coefficient = 0.0
    k2: Coefficient = 0.0
    p1: Coefficient = 0.0
    p2: Coefficient = 0.0
    field: Field = 180.0
    has_ranges: ClassVar[bool] = True

    def project(self, directions: FloatArray) -> FloatArray:
        """Places (N x 2) of directions (N x 3); NaN outside of the image circle."""
        x, y, z = _unit(directions).T
        limit, distortion = self._limit(), self._distortion()
        seen = z >= np.cos(limit)
        plane = np.column_stack((x, y)) / np.where(seen, z + self.xi, np.nan)[:, None]
        beyond = np.hypot(plane[:, 0], plane[:, 1]) > distortion.limit
        plane[beyond] = np.nan
        return distortion.distorted(plane)

    def directions(self, places: FloatArray) -> FloatArray:
        """Unit directions (N x 3) of places (N x 2); NaN outside of the image circle."""
        plane = self._distortion().undistorted(places)
        square = np.sum(plane**2, axis=1)
        root = np.sqrt(np.maximum(1.0 + (1.0 - self.xi**2) * square, 0.0))
        factor = (self.xi + root) / (square + 1.0)
        found = np.column_stack((plane * factor[:, None], factor - self.xi))
        found[~(found[:, 2] >= np.cos(self._limit()))] = np.nan
        return found

    def _limit(self) -> float:
        """Largest angle from the optical axis, radians: of the circle, or where the model folds."""
        folds = np.arccos(-1.0 / self.xi) if self.xi > 1.0 else np.arccos(-self.xi) - 1e-3
        return float(min(np.radians(self.field / 2), folds))

    def _distortion(self) -> "_Distortion":
        limit = self._limit()
        widest = float(np.sin(limit) / (np.cos(limit) + self.xi))
        return _Distortion(self.k1, self.k2, 0.0, self.p1, self.p2, widest * (1.0 + 1e-9))


Lens: TypeAlias = Pinhole | BrownConrady | KannalaBrandt | Mei
PINHOLE = Pinhole()


@dataclass(frozen=True)
class _OddCurve:
    """The curve t + a t^3 + b t^5 + ... up to its first turning point or a widest argument."""

    coefficients: tuple[float, ...]
    widest: float

    @property
    def limit(self) -> float:
        """Largest argument; up to it the curve rises."""
        slope = [(2 * n + 1) * c for n, c in enumerate((1.0, *self.coefficients))]
        roots = np.roots(np.trim_zeros(slope[::-1], "f"))
        turns = roots[(np.abs(roots.imag) < 1e-12) & (roots.real > 0.0)].real
        return float(min(np.sqrt(turns.min(initial=np.inf)), self.widest))

    def at(self, t: FloatArray) -> FloatArray:
        """Values of the curve."""
        values: FloatArray = t * np.polynomial.polynomial.polyval(t**2, (1.0, *self.coefficients))
        return values

    def slope(self, t: FloatArray) -> FloatArray:
        """Derivative of the curve."""
        powers = [(2 * n + 1) * c for n, c in enumerate((1.0, *self.coefficients))]
        return np.asarray(np.polynomial.polynomial.polyval(t**2, powers), np.float64)

    def inverse(self, values: FloatArray) -> FloatArray:
        """Arguments of values; NaN above the value at the limit."""
        samples = np.linspace(0.0, self.limit, _SAMPLES)
        t = np.interp(values, self.at(samples), samples)
        for _ in range(_STEPS):
            t = np.clip(
                t - (self.at(t) - values) / np.maximum(self.slope(t), 1e-9), 0.0, self.limit
            )
        return np.where(np.abs(self.at(t) - values) < _RESIDUAL, t, np.nan)


@dataclass(frozen=True)
class _Distortion:
    """Radial and decentring distortion of an image plane, within a widest radius."""

    k1: float
    k2: float
    k3: float
    p1: float
    p2: float
    widest: float

    @property
    def _radial(self) -> _OddCurve:
        return _OddCurve((self.k1, self.k2, self.k3), self.widest)

    @property
    def limit(self) -> float:
        """Largest radius before the distortion."""
        return self._radial.limit

    def distorted(self, plane: FloatArray) -> FloatArray:
        """Places (N x 2) after the distortion."""
        x, y = plane.T
        square = x**2 + y**2
        radial = 1.0 + square * (self.k1 + square * (self.k2 + square * self.k3))
        return np.column_stack(
            (
                x * radial + 2.0 * self.p1 * x * y + self.p2 * (square + 2.0 * x**2),
                y * radial + self.p1 * (square + 2.0 * y**2) + 2.0 * self.p2 * x * y,
            )
        )

    def undistorted(self, places: FloatArray) -> FloatArray:
        """Places (N x 2) before the distortion; NaN outside of its limit."""
        curve = self._radial
        samples = np.linspace(0.0, curve.limit, _SAMPLES)
        radii = np.hypot(places[:, 0], places[:, 1])
        shrink = np.interp(radii, curve.at(samples), samples) / np.maximum(radii, 1e-300)
        plane = places * np.where(radii > 0.0, shrink, 1.0)[:, None]
        for _ in range(_STEPS):
            plane = plane - self._step(plane, self.distorted(plane) - places)
        error = np.abs(self.distorted(plane) - places).max(axis=1, initial=0.0)
        outside = ~(error < _RESIDUAL) | (np.hypot(plane[:, 0], plane[:, 1]) > curve.limit)
        plane[outside] = np.nan
        return plane

    def _step(self, plane: FloatArray, error: FloatArray) -> FloatArray:
        """Newton step: the inverse of the Jacobian times the error."""
        x, y = plane.T
        square = x**2 + y**2
        radial = 1.0 + square * (self.k1 + square * (self.k2 + square * self.k3))
        growth = 2.0 * (self.k1 + square * (2.0 * self.k2 + square * 3.0 * self.k3))
        xx = radial + growth * x**2 + 2.0 * self.p1 * y + 6.0 * self.p2 * x
        yy = radial + growth * y**2 + 6.0 * self.p1 * y + 2.0 * self.p2 * x
        xy = growth * x * y + 2.0 * self.p1 * x + 2.0 * self.p2 * y
        area = xx * yy - xy**2
        area = np.where(np.abs(area) < 1e-9, 1e-9, area)
        step = np.column_stack(
            (yy * error[:, 0] - xy * error[:, 1], xx * error[:, 1] - xy * error[:, 0])
        )
        return step / area[:, None]


def _perspective(directions: FloatArray, widest: float) -> FloatArray:
    """Places on the image plane; NaN beyond an angle from the optical axis."""
    depth = directions[:, 2]
    plane = directions[:, :2] / np.where(depth > 0.0, depth, np.nan)[:, None]
    plane[np.hypot(plane[:, 0], plane[:, 1]) > np.tan(widest)] = np.nan
    return plane


def _unit(vectors: FloatArray) -> FloatArray:
    unit: FloatArray = vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
    return unit
