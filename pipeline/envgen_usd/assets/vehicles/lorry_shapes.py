"""Lorries: a cab, a frame with wheels, and a box or a semi-trailer.

Sizes keep to EU Directive 96/53/EC: 2.55 m wide, 4.0 m high, at most 12 m long, articulated 16.5 m.
Tyres are 315/70 R22.5 (radius 0.5 m).
"""

from dataclasses import dataclass, replace

import numpy as np

from envgen_usd.assets.asset_design import Model, Part, Subset
from envgen_usd.assets.polygon_mesh import Mesh, merge, welded
from envgen_usd.assets.shapes.printed_faces import PrintedFaces
from envgen_usd.assets.shapes.simple_solids import box, moved, turned
from envgen_usd.assets.vehicles.car_design import Car
from envgen_usd.assets.vehicles.car_details import Doors, Face, Glazing
from envgen_usd.assets.vehicles.car_fittings import wheel_figures, wheel_parts
from envgen_usd.assets.vehicles.car_form import Cabin, CarForm, Outline
from envgen_usd.assets.vehicles.car_shapes import car_model
from envgen_usd.assets.vehicles.wheel_shapes import Rim
from envgen_usd.models.array_types import FloatArray

CARGO = ("Cargo", "Far/Cargo")
"""Part and subset in the colour of the cargo's box or tarpaulin."""
RADIUS, _TYRE = 0.50, 0.31
"""Radius and width of tyres, metres."""
_RIM = Rim(10, (0.07, 0.06), share=0.58)
_BACK = np.diag([-1.0, -1.0, 1.0])
_FLAT = ((0.0, 0.02), (0.3, 0.0), (1.0, 0.01))

_CAB = Car(
    CarForm(
        length=2.10, width=2.48, axles=(1.38,), wheel=RADIUS, tyre=_TYRE, sill=0.38,
        shoulder=((0.0, 1.50), (2.1, 1.50)),
        cabin=Cabin(
            base=Outline(0.05, 2.05, 1.215, 0.36, 0.10, (2.8, 8.0)),
            top=Outline(0.30, 2.03, 1.09, 0.34, 0.12, (2.8, 6.0)),
            foot=1.42,
            roof=((0.30, 2.72), (0.8, 2.90), (2.03, 3.05)),
            crown=0.10, bulge=0.02,
        ),
        bonnet=((0.0, 0.0), (2.1, 0.0)),
        bow=((0.0, 0.08), (0.25, 0.0), (1.0, 0.03)), stern=((0.0, 0.0), (1.0, 0.0)), flank=_FLAT,
        nose=0.36, tail=0.08, square=(2.8, 8.0), arch=0.08, flare=0.0,
    ),
    Glazing(pillars=(), side=(0.03, 0.58), belt=0.0, above=0.42, rear=None, screen=-0.02,
            front=0.10),
    Face(
        head=((0.80, 0.62), (1.16, 0.62), (1.28, 0.72), (1.24, 0.86), (0.80, 0.80)),
        tail=(), indicator=((1.30, 0.64), (1.36, 0.66), (1.36, 0.82), (1.31, 0.80)),
        tail_indicator=(),
        grille=((-0.72, 0.66), (0.72, 0.66), (0.80, 1.32), (-0.80, 1.32)),
        intake=((-0.55, 0.44), (0.55, 0.44), (0.55, 0.56), (-0.55, 0.56)),
        bumpers=(0.60, 0.0), cladding=0.05, plates=(0.50, 0.0), reversing=(0.0, 0.0),
    ),
    Doors((0.42, 1.42), foot=0.55, handles=(1.28,), below=0.10),
    _RIM,
    mirror=2.4,
    plate="b",
)  # fmt: skip


@dataclass(frozen=True)
class Lorry:
    """A lorry behind its cab; lengths are metres, ``along`` counts from the front.

    Attributes:
        length: Overall length.
        frame: Along of both ends of the frame behind the cab.
        axles: Along of the axles behind the cab's.
        box: Along of both ends, lower and upper edge of the box.
    """

    length: float
    frame: tuple[float, float]
    axles: tuple[float, ...]
    box: tuple[float, float, float, float]


LORRIES = {
    "lorry": Lorry(9.60, (1.8, 9.3), (6.9,), (2.25, 9.55, 1.05, 3.60)),
    "articulated": Lorry(16.50, (1.8, 16.3), (5.08, 12.2, 13.5, 14.8), (2.90, 16.45, 1.15, 4.00)),
}
"""Lorries by name."""


def lorry_model(lorry: Lorry, prints: PrintedFaces) -> Model:
    """All parts of a lorry, and its far mesh."""
    shift = (lorry.length - _CAB.form.length) / 2
    cab = [
        replace(part, mesh=moved(part.mesh, (shift, 0.0, 0.0)))
        for part in car_model(_CAB, prints).parts
        if not part.name.startswith(("Wheel", "Rim"))
    ]
    far = cab.pop()
    body = [*_behind(lorry, prints), *wheel_parts(lorry_wheels(lorry), RADIUS, _TYRE, _RIM)]
    near = [*cab, *body]
    figures = wheel_figures(lorry_wheels(lorry), RADIUS)
    return Model((*near, _far_part(lorry, far, near)), custom=figures)


def lorry_wheels(lorry: Lorry) -> FloatArray:
    """W x 3, centres of the wheels: left and right of each axle, front to rear."""
    half = _CAB.form.width / 2 - 0.04 - _TYRE / 2
    axles = (*_CAB.form.axles, *lorry.axles)
    return np.array(
        [(lorry.length / 2 - axle, side * half, RADIUS) for axle in axles for side in (1, -1)]
    )


def _behind(lorry: Lorry, prints: PrintedFaces) -> list[Part]:
    """Box, frame and rear of a lorry."""
    start, end, low, high = lorry.box
    x = lorry.length / 2
    tail = x - end
    posts = np.linspace(x - start - 0.05, tail + 0.05, round((end - start) / 1.25) + 1)
    cargo = box((tail, -1.265, low), (x - start, 1.265, high))
    bars = [
        *(box((at - 0.03, -1.275, low + 0.02), (at + 0.03, 1.275, low + 0.16)) for at in posts),
        box((tail - 0.01, -1.27, low - 0.02), (x - start + 0.01, 1.27, low + 0.10)),
        box((tail - 0.012, -1.272, high - 0.10), (x - start + 0.012, 1.272, high - 0.02)),
        *(box((tail - 0.02, y - 0.015, low), (tail, y + 0.015, high)) for y in (-1.2, 0.0, 1.2)),
    ]
    return [
        Part("Cargo", cargo, "car_white", "cargo"),
        Part("CargoFrame", merge(bars), "metal_galvanised", "cargo"),
        Part("Frame", merge(_frame(lorry, low)), "car_underbody", "bodywork"),
        *_rear(lorry, prints),
    ]


def _frame(lorry: Lorry, low: float) -> list[Mesh]:
    """Beams, tanks, guards of the sides and of the rear, and mudguards."""
    x, (start, end) = lorry.length / 2, lorry.frame
    beams = [box((x - end, y - 0.05, 0.72), (x - start, y + 0.05, low - 0.01)) for y in (-0.4, 0.4)]
    axles = (*_CAB.form.axles, *lorry.axles)
    bars = [
        box((x - axle - 0.06, -1.0, RADIUS - 0.06), (x - axle + 0.06, 1.0, RADIUS + 0.06))
        for axle in axles
    ]
    gap = (axles[0] + RADIUS + 0.35, axles[1] - RADIUS - 0.15)
    tanks = [
        box((x - gap[0] - 1.1, side * 0.85 - 0.32, 0.42), (x - gap[0], side * 0.85 + 0.32, 0.98))
        for side in (-1, 1)
    ]
    long = lorry.axles[0] + 0.9, (lorry.axles[1] if len(lorry.axles) > 1 else 0.0) - 0.9
    spans = [(gap[0] + 1.2, gap[1]), long] if long[1] > long[0] else [(gap[0] + 1.2, gap[1])]
    guards = [
        box((x - b, side * 1.2 - 0.02, z), (x - a, side * 1.2 + 0.02, z + 0.10))
        for a, b in spans
        for side in (-1, 1)
        for z in (0.50, 0.78)
    ]
    flaps = [
        box(
            (x - axle - 0.60, side * 1.04 - 0.19, 0.30), (x - axle - 0.57, side * 1.04 + 0.19, 0.95)
        )
        for axle in lorry.axles
        for side in (-1, 1)
    ]
    bumper = box((x - end - 0.05, -1.2, 0.42), (x - end + 0.05, 1.2, 0.58))
    return [*beams, *bars, *tanks, *guards, *flaps, bumper]


def _rear(lorry: Lorry, prints: PrintedFaces) -> list[Part]:
    """Lamps and plate at the rear."""
    x = lorry.frame[1] - lorry.length / 2
    lamps, sides = [], []
    for side in (-1, 1):
        lamps.append(
            box((-x - 0.10, side * 1.0 - 0.18, 0.66), (-x - 0.05, side * 1.0 + 0.18, 0.80))
        )
        sides.append(
            box((-x - 0.10, side * 1.0 - 0.18, 0.82), (-x - 0.05, side * 1.0 + 0.18, 0.88))
        )
    plate = turned(prints.face("plate_c", x + 0.075, 0.66), _BACK)
    holder = box((-x - 0.07, -0.27, 0.64), (-x + 0.02, 0.27, 0.79))
    return [
        Part("RearLamps", merge(lamps), "lens_red", "tail_lamp"),
        Part("RearIndicators", merge(sides), "lens_amber", "indicator"),
        replace(prints.part("RearPlate", plate), label="number_plate"),
        Part("RearPlateHolder", holder, "car_plastic", "number_plate"),
    ]


def _far_part(lorry: Lorry, cab: Part, near: list[Part]) -> Part:
    """The far mesh of the cab with box, frame and wheels."""
    x, (start, end, low, high) = lorry.length / 2, lorry.box
    cargo = box((x - end, -1.265, low), (x - start, 1.265, high))
    frame = box((x - lorry.frame[1], -0.9, 0.6), (x - lorry.frame[0], 0.9, low - 0.02))
    wheels = [
        box((x - axle - 0.46, -1.20, 0.0), (x - axle + 0.46, 1.20, 0.96)) for axle in lorry.axles
    ]
    lamps = [
        box((x - lorry.frame[1] - 0.1, s - 0.18, 0.66), (x - lorry.frame[1] - 0.02, s + 0.18, 0.88))
        for s in (-1.0, 1.0)
    ]
    added = {
        ("Cargo", "car_white", "cargo"): cargo,
        ("Frame", "car_underbody", "bodywork"): frame,
        ("Axles", "car_tyre", "wheel"): merge(wheels),
        ("RearLamps", "lens_red", "tail_lamp"): merge(lamps),
    }
    start_face, subsets = len(cab.mesh.face_sizes), [*cab.subsets]
    for (name, material, label), mesh in added.items():
        end_face = start_face + len(mesh.face_sizes)
        subsets.append(Subset(name, np.arange(start_face, end_face), material, label))
        start_face = end_face
    subsets = [subset for subset in subsets if len(subset.faces)]
    first, *others = (part.name for part in near)
    whole = merge([cab.mesh, *map(welded, added.values())])
    return replace(
        cab, mesh=whole, subsets=tuple(subsets), proxy_of=first, stands_for=tuple(others)
    )
