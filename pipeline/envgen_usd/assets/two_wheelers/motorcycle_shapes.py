"""A motorcycle without fairing, and a scooter."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from envgen_usd.assets.people.figure_pieces import Piece
from envgen_usd.assets.people.lofted_forms import Loft, smoothed
from envgen_usd.assets.polygon_mesh import Mesh
from envgen_usd.assets.shapes.spoked_wheels import hoop, round_profile
from envgen_usd.assets.two_wheelers.bicycle_shapes import bar
from envgen_usd.models.array_types import FloatArray

_SIDES = (1.0, -1.0)


@dataclass(frozen=True)
class MotorForm:
    """Where a rider and the wheels touch, metres.

    Attributes:
        axles: x of the rear and of the front axle.
        radii: Of the rear and of the front wheel.
        tyres: Half the width of both tyres.
        seat: x and z of the rider's place on the seat.
        grip: Left grip (x, y, z).
        foot: Place below the ball of the left foot (x, y, z).
    """

    axles: tuple[float, float]
    radii: tuple[float, float]
    tyres: tuple[float, float]
    seat: tuple[float, float]
    grip: tuple[float, float, float]
    foot: tuple[float, float, float]


MOTORCYCLE = MotorForm(
    (-0.70, 0.71), (0.315, 0.305), (0.075, 0.055), (-0.20, 0.80), (0.30, 0.345, 1.045),
    (-0.10, 0.21, 0.36),
)  # fmt: skip
SCOOTER = MotorForm(
    (-0.62, 0.66), (0.235, 0.235), (0.058, 0.052), (-0.28, 0.785), (0.33, 0.30, 1.02),
    (0.20, 0.13, 0.285),
)  # fmt: skip


def motorcycle_pieces() -> tuple[Piece, ...]:
    """A motorcycle of the middle class with an open engine."""
    form = MOTORCYCLE
    tank = _body(
        ((-0.13, 0.79, 0.05, 0.03), (-0.10, 0.83, 0.10, 0.07), (0.02, 0.88, 0.145, 0.115),
         (0.18, 0.90, 0.155, 0.125), (0.30, 0.88, 0.11, 0.09), (0.335, 0.87, 0.05, 0.04)), 2.6,
    )  # fmt: skip
    tail = _body(
        ((-0.78, 0.885, 0.03, 0.02), (-0.74, 0.88, 0.075, 0.045), (-0.50, 0.80, 0.115, 0.07),
         (-0.22, 0.72, 0.12, 0.07), (-0.10, 0.73, 0.08, 0.05)), 3.0,
    )  # fmt: skip
    seat = _body(
        ((-0.76, 0.915, 0.03, 0.015), (-0.70, 0.905, 0.10, 0.035), (-0.45, 0.855, 0.135, 0.04),
         (-0.25, 0.775, 0.125, 0.035), (-0.12, 0.785, 0.085, 0.035), (-0.09, 0.80, 0.03, 0.02)),
        2.8,
    )  # fmt: skip
    engine = _body(
        ((-0.26, 0.42, 0.08, 0.10), (-0.22, 0.42, 0.15, 0.14), (0.02, 0.42, 0.165, 0.15),
         (0.10, 0.42, 0.14, 0.12), (0.13, 0.42, 0.06, 0.08)), 3.6,
    )  # fmt: skip
    cylinders = _barrel([(0.03, 0.50), (0.06, 0.54), (0.13, 0.72), (0.15, 0.76)], 0.10, 0.17)
    painted = [tank.mesh(18), tail.mesh(14), _fender(form, 1, 42.0, 160.0).mesh(8)]
    dark = [engine.mesh(12), cylinders.mesh(12), _fender(form, 0, 60.0, 165.0).mesh(8)]
    dark += [*_fork(form, (0.46, 0.87), 0.10), *_spine()]
    far = [tank.coarse(5, (0, 2, 5)), tail.coarse(4, (0, 2, 4))]
    lumps = [engine.coarse(4, (0, 4)), bar([(0.71, 0.0, 0.30), (0.40, 0.0, 0.98)], 0.05, 4)]
    return (
        Piece("Bodywork", painted, far, "paint_red", "bodywork"),
        Piece("Engine", dark, lumps, "metal_dark", "frame"),
        Piece("Saddle", [seat.mesh(12)], [seat.coarse(4, (1, 4))], "leather_black", "saddle"),
        Piece("Exhaust", _exhaust(), [], "paint_grey", "body"),
        *_wheels(form),
        Piece("Handlebar", _handlebar(form, (0.36, 1.00)), [_far_bar(form)], "paint_black",
              "handlebar"),
        *_signals((0.47, 0.885), 0.088, (-0.80, 0.86), 0.62),
    )  # fmt: skip


def scooter_pieces() -> tuple[Piece, ...]:
    """A scooter with a leg shield and a flat floor."""
    form = SCOOTER
    rear = _body(
        ((-0.86, 0.66, 0.03, 0.04), (-0.82, 0.65, 0.10, 0.10), (-0.62, 0.60, 0.165, 0.17),
         (-0.38, 0.54, 0.165, 0.22), (-0.20, 0.50, 0.13, 0.22), (-0.10, 0.47, 0.10, 0.19),
         (-0.08, 0.46, 0.06, 0.15)), 2.8,
    )  # fmt: skip
    floor = _body(
        ((-0.16, 0.25, 0.12, 0.02), (-0.13, 0.25, 0.185, 0.035), (0.25, 0.25, 0.195, 0.035),
         (0.34, 0.26, 0.17, 0.035), (0.36, 0.27, 0.10, 0.02)), 4.0,
    )  # fmt: skip
    seat = _body(
        ((-0.84, 0.76, 0.03, 0.015), (-0.78, 0.765, 0.12, 0.045), (-0.50, 0.775, 0.15, 0.05),
         (-0.22, 0.735, 0.125, 0.045), (-0.12, 0.72, 0.08, 0.04), (-0.095, 0.715, 0.03, 0.02)),
        2.8,
    )  # fmt: skip
    shield = _barrel([(0.37, 0.24), (0.375, 0.27), (0.41, 0.45), (0.44, 0.66), (0.41, 0.88),
                      (0.395, 0.93), (0.39, 0.94)], 0.045, 0.21, (0.5, 0.8, 1.0, 1.0, 0.72, 0.5,
                      0.3))  # fmt: skip
    cowl = _body(
        ((0.27, 0.985, 0.05, 0.02), (0.30, 0.99, 0.13, 0.05), (0.38, 0.985, 0.135, 0.065),
         (0.44, 0.97, 0.10, 0.055), (0.455, 0.965, 0.04, 0.03)), 2.4,
    )  # fmt: skip
    painted = [rear.mesh(14), shield.mesh(12), cowl.mesh(12),
               _fender(form, 1, 5.0, 172.0, 0.085).mesh(10)]  # fmt: skip
    dark = [floor.mesh(12), *_fork(form, (0.52, 0.56), 0.065)]
    dark += [bar([(-0.40, 0.10, 0.30), (-0.62, 0.10, 0.24)], 0.075, 8)]
    far = [rear.coarse(5, (0, 2, 6)), shield.coarse(4, (0, 3, 6))]
    return (
        Piece("Bodywork", painted, far, "paint_red", "bodywork"),
        Piece("Engine", dark, [floor.coarse(4, (0, 4))], "metal_dark", "frame"),
        Piece("Saddle", [seat.mesh(12)], [seat.coarse(4, (1, 4))], "leather_black", "saddle"),
        Piece("Exhaust", [bar([(-0.45, -0.15, 0.27), (-0.55, -0.16, 0.30), (-0.86, -0.16, 0.36)],
                              0.050, 8)], [], "paint_grey", "body"),
        *_wheels(form),
        Piece("Handlebar", _handlebar(form, (0.36, 1.0)), [_far_bar(form)], "paint_black",
              "handlebar"),
        *_signals((0.456, 0.965), 0.062, (-0.86, 0.67), 0.50),
    )  # fmt: skip


def _body(rows: Sequence[tuple[float, float, float, float]], power: float) -> Loft:
    """A body along x: x, height of the middle, half-width and half the height of each section."""
    x, z, wide, tall = np.array(rows).T
    count = len(x)
    centres = np.stack([x, np.zeros(count), z], axis=1)
    sections = np.stack([wide, tall, tall, np.full(count, power)], axis=1)
    left, up = np.tile([0.0, 1.0, 0.0], (count, 1)), np.tile([0.0, 0.0, 1.0], (count, 1))
    return Loft(centres, left, up, sections)


def _barrel(
    line: Sequence[tuple[float, float]],
    deep: float,
    wide: float,
    shares: Sequence[float] = (),
) -> Loft:
    """An upright body along points (x, z), with half its depth and its width."""
    points = np.array(line)
    count = len(points)
    share = np.array(shares) if len(shares) else np.array([0.6, *[1.0] * (count - 2), 0.6])
    centres = np.stack([points[:, 0], np.zeros(count), points[:, 1]], axis=1)
    depth = np.full(count, deep)
    depth[[0, -1]] *= 0.5
    sections = np.stack([wide * share, depth, depth, np.full(count, 3.2)], axis=1)
    left, ahead = np.tile([0.0, 1.0, 0.0], (count, 1)), np.tile([1.0, 0.0, 0.0], (count, 1))
    return Loft(centres, left, ahead, sections)


def _fender(form: MotorForm, end: int, first: float, last: float, wide: float = 0.0) -> Loft:
    """An arched strip above a wheel; angles from the front upwards, degrees."""
    angle = np.radians(np.linspace(first, last, 8))
    out = np.stack([np.cos(angle), np.zeros(8), np.sin(angle)], axis=1)
    radius = form.radii[end]
    centres = np.array([form.axles[end], 0.0, radius]) + (radius + 0.022) * out
    half = wide or form.tyres[end] + 0.012
    sections = np.tile([half, 0.008, 0.026, 3.0], (8, 1))
    sections[[0, -1], 0] *= 0.6
    return Loft(centres, np.tile([0.0, 1.0, 0.0], (8, 1)), out, sections)


def _fork(form: MotorForm, head: tuple[float, float], apart: float) -> list[Mesh]:
    axle = (form.axles[1], form.radii[1])
    legs = [bar([(*_flat(axle, apart * s),), (*_flat(head, apart * s),)], 0.024, 8) for s in _SIDES]
    crown = [bar([_flat(head, -apart - 0.02), _flat(head, apart + 0.02)], 0.026, 6)]
    return [*legs, *crown, bar([_flat(axle, -apart - 0.02), _flat(axle, apart + 0.02)], 0.018, 6)]


def _flat(point: tuple[float, float], y: float) -> tuple[float, float, float]:
    return point[0], y, point[1]


def _spine() -> list[Mesh]:
    """Frame, swing arm, rear springs, foot rests."""
    meshes = [bar([(0.42, 0.0, 0.84), (0.22, 0.0, 0.40), (0.0, 0.0, 0.27)], 0.022)]
    for s in _SIDES:
        meshes += [
            bar([(-0.18, 0.09 * s, 0.38), (-0.70, 0.11 * s, 0.315)], 0.024),
            bar([(-0.62, 0.12 * s, 0.36), (-0.48, 0.12 * s, 0.70)], 0.030, 8),
            bar([(-0.20, 0.10 * s, 0.36), (-0.20, 0.26 * s, 0.35)], 0.014),
        ]
    return meshes


def _exhaust() -> list[Mesh]:
    pipe = [(0.16, -0.06, 0.62), (0.25, -0.09, 0.50), (0.20, -0.14, 0.30), (-0.15, -0.17, 0.26),
            (-0.35, -0.19, 0.30)]  # fmt: skip
    muffler = [(-0.33, -0.19, 0.295), (-0.40, -0.20, 0.31), (-0.78, -0.21, 0.42),
               (-0.80, -0.21, 0.425)]  # fmt: skip
    return [bar(pipe, 0.022, 8), bar(muffler, 0.048, 10)]


def wheel_centres(form: MotorForm) -> FloatArray:
    """Centres of the front and of the rear wheel, 2 x 3, metres."""
    (rear, front), (low, high) = form.axles, form.radii
    return np.array([[front, 0.0, high], [rear, 0.0, low]])


def _wheels(form: MotorForm) -> list[Piece]:
    """Tyre and rim of each wheel, which turn about its axle."""
    pieces = []
    tyres = zip(("Front", "Rear"), wheel_centres(form), form.tyres[::-1], strict=True)
    for end, middle, half in tyres:
        # A tyre is about as high as it is wide.
        profile = round_profile(1.0, 8) * [0.8 * half, half]
        ring = float(middle[2]) - 0.8 * half
        near = smoothed(hoop(middle, ring, profile, 24))
        far = smoothed(hoop(middle, ring, round_profile(1.0, 4) * [0.9 * half, half], 9))
        inner = float(middle[2]) - 1.5 * half
        rim = np.array([[0.012, 0.6], [-0.016, 0.5], [-0.016, -0.5], [0.012, -0.6]])
        metal = [smoothed(hoop(middle, inner, rim * [1.0, half], 24))]
        metal += _cast_spokes(middle, inner)
        pieces += [
            Piece(f"Tyre{end}", [near], [far], "rubber", "wheel"),
            Piece(f"Rim{end}", metal, [], "paint_grey", "wheel"),
        ]
    return pieces


def _cast_spokes(middle: FloatArray, radius: float) -> list[Mesh]:
    meshes = [bar([middle - [0.0, 0.06, 0.0], middle + np.array([0.0, 0.06, 0.0])], 0.05, 10)]
    meshes.append(
        bar(
            [middle + np.array([0.0, 0.062, 0.0]), middle + np.array([0.0, 0.068, 0.0])],
            0.62 * radius,
            14,
        )
    )
    for k in range(5):
        angle = 2.0 * np.pi * k / 5 + 0.3
        out = np.array([np.cos(angle), 0.0, np.sin(angle)])
        meshes.append(bar([middle, middle + radius * out], 0.014, 5))
    return meshes


def _handlebar(form: MotorForm, clamp: tuple[float, float]) -> list[Mesh]:
    """Bar, grips, levers and mirrors."""
    grip = np.array(form.grip)
    meshes = [bar([grip * [1.0, -1.0, 1.0], _flat(clamp, -0.10), _flat(clamp, 0.10), grip], 0.012)]
    for s in _SIDES:
        end = grip * [1.0, s, 1.0]
        along = np.array([0.0, -0.13 * s, -0.005])
        meshes.append(bar([end + np.array([0.0, 0.03 * s, 0.0]), end + along], 0.017, 8))
        meshes.append(
            bar([end + along + np.array([0.03, 0, 0]), end + np.array([0.06, 0.0, 0.0])], 0.006, 4)
        )
        mirror = end + np.array([0.05, -0.02 * s, 0.17])
        meshes.append(bar([end + along, mirror], 0.006, 5))
        meshes.append(
            bar(
                [mirror - [0.012, 0.0, 0.0], mirror, mirror + np.array([0.014, 0.0, 0.0])],
                0.058,
                10,
            )
        )
    return meshes


def _far_bar(form: MotorForm) -> Mesh:
    grip = np.array(form.grip)
    return bar([grip * [1.0, -1.0, 1.0], grip], 0.02, 3)


def _signals(
    front: tuple[float, float], radius: float, back: tuple[float, float], plate: float
) -> tuple[Piece, ...]:
    """Headlamp, tail lamp, indicators and number plate."""
    x, z = front
    shell = bar([(x - 0.12, 0.0, z), (x - 0.09, 0.0, z), (x, 0.0, z)], radius, 12)
    lens = bar([(x, 0.0, z), (x + 0.02, 0.0, z)], radius * 0.93, 12)
    rear, high = back
    red = bar([(rear, -0.05, high), (rear, 0.05, high)], 0.026, 8)
    amber = [
        bar([(at, 0.11 * s, height), (at, 0.17 * s, height)], 0.022, 8)
        for at, height in ((x - 0.05, z - 0.04), (rear + 0.06, high - 0.02))
        for s in _SIDES
    ]
    card = _body(
        ((rear - 0.012, plate, 0.09, 0.075), (rear + 0.004, plate, 0.09, 0.075)), 8.0
    ).mesh(12)
    bracket = bar([(rear, 0.0, plate), (rear + 0.10, 0.0, high)], 0.014, 5)
    return (
        Piece("Housings", [shell, bracket], [], "paint_black", "body"),
        Piece("Headlamp", [lens], [], "headlamp_clear", "headlamp"),
        Piece("TailLamp", [red], [], "lens_red", "tail_lamp"),
        Piece("Indicators", amber, [], "lens_amber", "indicator"),
        Piece("Plate", [card], [], "paint_white", "number_plate"),
    )
