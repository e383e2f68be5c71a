"""Bicycles: a city bicycle with a low frame, and a sports bicycle with a diamond frame."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from envgen_usd.assets.people.figure_pieces import Piece
from envgen_usd.assets.people.lofted_forms import Loft, smoothed
from envgen_usd.assets.polygon_mesh import Mesh
from envgen_usd.assets.shapes.simple_solids import tube
from envgen_usd.assets.shapes.spoked_wheels import hoop, round_profile, spokes
from envgen_usd.models.array_types import FloatArray

Line = Sequence[tuple[float, float]]
"""Points (x, z) in the plane of a bicycle, metres."""


@dataclass(frozen=True)
class BicycleForm:
    """Sizes of a bicycle in metres; its wheels touch the ground at the same distance from x = 0.

    Attributes:
        axle: Distance of both axles from the middle.
        radius: Of the wheels with their tyres.
        tyre: Radius of a tyre.
        crank: x and z of the crank's axle.
        arm: Length of a crank.
        saddle: x and z of the middle of the saddle's top.
        tubes: Lines of the frame's tubes (x, z), and their radii.
        fork: Line of the fork's blades from the head to the axle.
        stem: Line from the head to the middle of the handlebar.
        bar: Line (x, y, z) of the left half of the handlebar from its middle.
        grips: Left grip (x, y, z).
        guarded: True for mudguards, a rack and a chain guard.
    """

    axle: float
    radius: float
    tyre: float
    crank: tuple[float, float]
    arm: float
    saddle: tuple[float, float]
    tubes: tuple[tuple[Line, float], ...]
    fork: Line
    stem: Line
    bar: tuple[tuple[float, float, float], ...]
    grips: tuple[float, float, float]
    guarded: bool


CITY = BicycleForm(
    axle=0.56, radius=0.350, tyre=0.021, crank=(-0.11, 0.30), arm=0.17, saddle=(-0.30, 0.965),
    tubes=(
        (((-0.11, 0.30), (-0.285, 0.90)), 0.016),
        (((-0.11, 0.30), (0.06, 0.35), (0.24, 0.52), (0.335, 0.72)), 0.021),
        (((-0.205, 0.62), (-0.02, 0.58), (0.18, 0.66), (0.325, 0.80)), 0.014),
        (((0.345, 0.66), (0.305, 0.90)), 0.020),
    ),
    fork=((0.35, 0.66), (0.42, 0.52), (0.56, 0.35)),
    stem=((0.305, 0.90), (0.285, 1.00), (0.30, 1.06)),
    bar=((0.30, 0.0, 1.06), (0.30, 0.10, 1.07), (0.22, 0.24, 1.09), (0.10, 0.285, 1.08)),
    grips=(0.14, 0.28, 1.085),
    guarded=True,
)  # fmt: skip
SPORT = BicycleForm(
    axle=0.51, radius=0.340, tyre=0.016, crank=(-0.10, 0.275), arm=0.172, saddle=(-0.27, 0.985),
    tubes=(
        (((-0.10, 0.275), (-0.265, 0.94)), 0.015),
        (((-0.10, 0.275), (0.335, 0.70)), 0.021),
        (((-0.215, 0.74), (0.305, 0.80)), 0.016),
        (((0.345, 0.66), (0.295, 0.84)), 0.020),
    ),
    fork=((0.345, 0.66), (0.425, 0.45), (0.51, 0.34)),
    stem=((0.295, 0.84), (0.285, 0.885), (0.39, 0.93)),
    bar=((0.39, 0.0, 0.93), (0.39, 0.06, 0.935), (0.375, 0.30, 0.955)),
    grips=(0.378, 0.26, 0.95),
    guarded=False,
)  # fmt: skip
_SIDES = (1.0, -1.0)
_ENDS = ("Front", "Rear")


def pedals(form: BicycleForm, turn: float) -> tuple[FloatArray, FloatArray]:
    """Middle (3) of the left and of the right pedal.

    Args:
        form: The bicycle.
        turn: Angle of the right crank from the front downwards, degrees.
    """
    angle = np.radians(turn)
    out = np.array([np.cos(angle), 0.0, -np.sin(angle)]) * form.arm
    axle = np.array([form.crank[0], 0.0, form.crank[1]])
    return axle - out + [0.0, 0.135, 0.0], axle + out - [0.0, 0.135, 0.0]


def bicycle_pieces(form: BicycleForm, turn: float = 20.0) -> tuple[Piece, ...]:
    """A bicycle that stands upright.

    Args:
        form: Its sizes.
        turn: Angle of the right crank from the front downwards, degrees.
    """
    return (
        Piece("Frame", _frame(form), _far_frame(form), "paint_blue", "frame"),
        *(piece for end in _ENDS for piece in _wheel(form, end)),
        *([Piece("Rack", _rack(form), [], "metal_galvanised", "frame")] if form.guarded else []),
        Piece("Drive", _drive(form, turn), [], "metal_dark", "body"),
        Piece("Handlebar", _handlebar(form), [_flat_bar(form)], "metal_dark", "handlebar"),
        Piece("Saddle", [_saddle(form).mesh(8)], [_saddle(form).coarse(3, (1, 3))],
              "leather_black", "saddle"),
        Piece("Lamps", _lamps(form), [], "lens_red", "lamp"),
    )  # fmt: skip


def bar(
    points: Sequence[Sequence[float] | FloatArray] | FloatArray, radius: float, sides: int = 6
) -> Mesh:
    """A round bar through points (x, y, z), with smooth normals."""
    line = np.array(points, dtype=np.float64)
    return smoothed(tube(line, np.full(len(line), radius), sides))


def _plane(line: Line, y: float = 0.0) -> list[tuple[float, float, float]]:
    return [(x, y, z) for x, z in line]


def _frame(form: BicycleForm) -> list[Mesh]:
    meshes = [bar(_plane(line), radius) for line, radius in form.tubes]
    top = _on(form.tubes[0][0], 0.78)
    rear = (-form.axle, form.radius)
    for side in _SIDES:
        ends = ((*rear, 0.062 * side), (*form.crank, 0.03 * side), (*top, 0.02 * side))
        axle, crank, seat = ([x, y, z] for x, z, y in ends)
        meshes += [bar([axle, crank], 0.009, 5), bar([axle, seat], 0.008, 5)]
        crown, *blade = form.fork
        line = [(crown[0], 0.045 * side, crown[1])]
        line += [(x, (0.052 if k == 0 else 0.056) * side, z) for k, (x, z) in enumerate(blade)]
        meshes.append(bar(line, 0.011, 5))
    crown = form.fork[0]
    meshes.append(bar([(crown[0], -0.05, crown[1]), (crown[0], 0.05, crown[1])], 0.014, 5))
    if form.guarded:
        for x, first, last in ((-form.axle, -25.0, 178.0), (form.axle, 32.0, 185.0)):
            meshes.append(_mudguard(form, x, first, last))
        meshes.append(_chain_guard(form))
    return meshes


def _on(line: Line, share: float) -> tuple[float, float]:
    (x0, z0), (x1, z1) = line[0], line[-1]
    return x0 + share * (x1 - x0), z0 + share * (z1 - z0)


def _mudguard(form: BicycleForm, x: float, first: float, last: float) -> Mesh:
    """An arched strip above a wheel; angles from the front upwards, degrees."""
    angle = np.radians(np.linspace(first, last, 9))
    out = np.stack([np.cos(angle), np.zeros(9), np.sin(angle)], axis=1)
    centres = np.array([x, 0.0, form.radius]) + (form.radius + 0.018) * out
    sections = np.tile([0.028, 0.004, 0.004, 3.0], (9, 1))
    return Loft(centres, np.tile([0.0, 1.0, 0.0], (9, 1)), out, sections).mesh(6)


def _chain_guard(form: BicycleForm) -> Mesh:
    x, z = form.crank
    line = np.array([[x + 0.13, -0.05, z], [x, -0.05, z + 0.005], [-form.axle, -0.05, form.radius]])
    up = np.tile([0.0, 0.0, 1.0], (3, 1))
    tall = np.array([0.045, 0.075, 0.045])
    sections = np.stack([np.full(3, 0.006), tall, tall, np.full(3, 3.0)], axis=1)
    return Loft(line, np.tile([0.0, 1.0, 0.0], (3, 1)), up, sections).mesh(8)


def _wheel(form: BicycleForm, end: str) -> tuple[Piece, Piece]:
    """Tyre and rim of an end of the bicycle, which turn about its axle."""
    middle = wheel_centres(form)[_ENDS.index(end)]
    radius = form.radius - form.tyre
    near = smoothed(hoop(middle, radius, round_profile(form.tyre, 6), 28))
    far = smoothed(hoop(middle, radius, round_profile(form.tyre * 1.2, 3), 9))
    rim = np.array([[0.004, 0.009], [-0.018, 0.005], [-0.018, -0.005], [0.004, -0.009]])
    inner = form.radius - 1.6 * form.tyre
    wide = np.array([0.0, 0.06, 0.0])
    metal = [
        smoothed(hoop(middle, inner, rim, 28)),
        smoothed(spokes(middle, 0.02, inner - 0.01, 20, wide=0.03)),
        bar([middle - wide, middle + wide], 0.014, 6),
    ]
    return (
        Piece(f"Tyre{end}", [near], [far], "rubber", "wheel"),
        Piece(f"Rim{end}", metal, [], "metal_galvanised", "wheel"),
    )


def wheel_centres(form: BicycleForm) -> FloatArray:
    """Centres of the front and of the rear wheel, 2 x 3, metres."""
    return np.array([[form.axle, 0.0, form.radius], [-form.axle, 0.0, form.radius]])


def _rack(form: BicycleForm) -> list[Mesh]:
    """Rails and stays above the rear wheel."""
    meshes = []
    back, high = -form.axle, 2 * form.radius + 0.06
    for side in _SIDES:
        foot = (back, 0.065 * side, form.radius)
        rail = [(back - 0.17, 0.05 * side, high), (back + 0.22, 0.05 * side, high)]
        meshes += [bar([foot, rail[0]], 0.005, 4), bar(rail, 0.006, 4)]
    for x in (back - 0.15, back, back + 0.15):
        meshes.append(bar([(x, -0.05, high), (x, 0.05, high)], 0.004, 4))
    return meshes


def _drive(form: BicycleForm, turn: float) -> list[Mesh]:
    """Cranks, pedals, chain wheel, seat post."""
    axle = np.array([form.crank[0], 0.0, form.crank[1]])
    meshes = []
    for pedal, side in zip(pedals(form, turn), _SIDES, strict=True):
        inner = axle + np.array([0.0, 0.065 * side, 0.0])
        outer = pedal - [0.0, 0.055 * side, 0.0]
        meshes += [bar([inner, outer], 0.010, 5)]
        ends = np.stack(
            [pedal - [0.0, 0.05 * side, 0.0], pedal + np.array([0.0, 0.045 * side, 0.0])]
        )
        flat = np.tile([0.045, 0.012, 0.012, 4.0], (2, 1))
        ahead, up = np.tile([1.0, 0.0, 0.0], (2, 1)), np.tile([0.0, 0.0, 1.0], (2, 1))
        meshes.append(Loft(ends, ahead, up, flat).mesh(8))
    meshes.append(bar([axle - [0.0, 0.07, 0.0], axle + np.array([0.0, 0.07, 0.0])], 0.02))
    ring = hoop(axle - [0.0, 0.055, 0.0], 0.085, round_profile(0.006, 4), 18)
    meshes += [smoothed(ring), _chain(form)]
    top = form.tubes[0][0][-1]
    meshes.append(
        bar([(top[0], 0.0, top[1]), (form.saddle[0], 0.0, form.saddle[1] - 0.05)], 0.0135)
    )
    return meshes


def _chain(form: BicycleForm) -> Mesh:
    (x, z), y = form.crank, -0.055
    sprocket, rear, high = 0.035, -form.axle, form.radius
    loop = [(x, y, z + 0.085), (rear, y, high + sprocket), (rear - sprocket, y, high),
            (rear, y, high - sprocket), (x, y, z - 0.085)]  # fmt: skip
    return bar(loop, 0.004, 4)


def _handlebar(form: BicycleForm) -> list[Mesh]:
    left = np.array(form.bar)
    whole = np.concatenate([left[::-1], left[1:] * [1.0, -1.0, 1.0]])
    meshes = [bar(_plane(form.stem), 0.013), bar(whole, 0.011)]
    for side in _SIDES:
        grip = np.array(form.bar[-1]) * [1.0, side, 1.0]
        inner = np.array(form.bar[-2]) * [1.0, side, 1.0]
        along = (inner - grip) / np.linalg.norm(inner - grip)
        meshes.append(bar([grip - 0.004 * along, grip + 0.12 * along], 0.016))
        lever = np.array([0.045, -0.02 * side, -0.02])
        meshes.append(
            bar([grip + 0.13 * along + lever * 0.4, grip + 0.05 * along + lever], 0.005, 4)
        )
    return meshes


def _flat_bar(form: BicycleForm) -> Mesh:
    left, right = np.array(form.grips), np.array(form.grips) * [1.0, -1.0, 1.0]
    middle = np.array(form.bar[0])
    return bar([left, middle, right], 0.016, 3)


def _saddle(form: BicycleForm) -> Loft:
    """A saddle, wide at the back and narrow at the front."""
    along = np.array([-0.125, -0.115, -0.06, 0.04, 0.125, 0.135])
    wide = np.array([0.03, 0.075, 0.085, 0.035, 0.022, 0.008]) * (1.15 if form.guarded else 0.95)
    high = np.array([0.010, 0.022, 0.024, 0.018, 0.014, 0.006])
    x, z = form.saddle
    centres = np.stack([x + along, np.zeros(6), z - 0.024 + 0.012 * (along / 0.12) ** 2], axis=1)
    sections = np.stack([wide, high, high * 1.4, np.full(6, 2.6)], axis=1)
    left, up = np.tile([0.0, 1.0, 0.0], (6, 1)), np.tile([0.0, 0.0, 1.0], (6, 1))
    return Loft(centres, left, up, sections)


def _far_frame(form: BicycleForm) -> list[Mesh]:
    lines = [form.tubes[0][0], (form.tubes[1][0][0], form.tubes[1][0][-1])]
    lines += [
        ((-form.axle, form.radius), form.crank),
        ((-form.axle, form.radius), _on(form.tubes[0][0], 0.8)),
    ]
    lines += [(form.fork[-1], form.stem[-1])]
    lines += [(form.tubes[2][0][0], form.tubes[2][0][-1])]
    return [bar(_plane(line), 0.022, 3) for line in lines]


def _lamps(form: BicycleForm) -> list[Mesh]:
    """A red lamp at the back."""
    x, z = (-form.axle - 0.18, 2 * form.radius + 0.03) if form.guarded else (
        form.saddle[0] - 0.06, form.saddle[1] - 0.10
    )  # fmt: skip
    return [bar([(x - 0.02, 0.0, z), (x + 0.02, 0.0, z)], 0.022, 8)]
