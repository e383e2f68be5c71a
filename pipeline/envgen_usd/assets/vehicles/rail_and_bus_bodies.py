"""City bus and tram: long bodies with bands of windows.

Sizes: a city bus of 12 m x 2.55 m x 3.1 m (EU Directive 96/53/EC allows 13.5 m with two axles and
2.55 m; tyres 275/70 R22.5), a low-floor tram of 30 m x 2.65 m in five sections.
"""

from envgen_usd.assets.vehicles.car_design import Car
from envgen_usd.assets.vehicles.car_details import Doors, Face, Glazing
from envgen_usd.assets.vehicles.car_form import Cabin, CarForm, Outline
from envgen_usd.assets.vehicles.wheel_shapes import Rim

_FLAT = ((0.0, 0.02), (0.3, 0.0), (1.0, 0.015))

BUS = Car(
    CarForm(
        length=12.0, width=2.55, axles=(2.70, 8.60), wheel=0.478, tyre=0.275, sill=0.30,
        shoulder=((0.0, 1.12), (12.0, 1.12)),
        cabin=Cabin(
            base=Outline(0.022, 11.98, 1.268, 0.40, 0.25, (3.0, 5.0)),
            top=Outline(0.22, 11.90, 1.16, 0.40, 0.25, (3.0, 5.0)),
            foot=1.04,
            roof=((0.22, 2.86), (1.0, 2.93), (11.0, 2.93), (11.9, 2.88)),
            crown=0.10, bulge=0.02,
        ),
        bonnet=((0.0, 0.0), (12.0, 0.0)),
        bow=((0.0, 0.06), (0.4, 0.0), (1.0, 0.02)), stern=_FLAT, flank=_FLAT,
        nose=0.40, tail=0.25, square=(3.0, 5.0), arch=0.06, flare=0.0,
    ),
    Glazing(
        pillars=(0.115, 0.245, 0.375, 0.505, 0.635, 0.765, 0.89), pillar=0.05, front=0.10,
        side=(0.01, 0.985), belt=-0.02, above=0.38, rear=(0.45, 0.10), screen=-0.04,
    ),
    Face(
        head=((0.86, 0.62), (1.18, 0.62), (1.30, 0.72), (1.24, 0.82), (0.90, 0.80)),
        tail=((1.02, 0.62), (1.18, 0.62), (1.18, 1.04), (1.02, 1.04)),
        indicator=((1.30, 0.66), (1.36, 0.66), (1.36, 0.78), (1.32, 0.76)),
        tail_indicator=((1.04, 0.92), (1.16, 0.92), (1.16, 1.00), (1.04, 1.00)),
        grille=((-0.6, 0.62), (0.6, 0.62), (0.6, 0.70), (-0.6, 0.70)),
        intake=((-0.9, 0.34), (0.9, 0.34), (0.85, 0.42), (-0.85, 0.42)),
        bumpers=(0.58, 0.56), cladding=0.05, plates=(0.50, 0.72), reversing=(0.36, 0.46),
    ),
    Doors((0.55, 1.95), foot=0.06),
    Rim(8, (0.09, 0.08), share=0.60),
    mirror=1.9,
    plate="c",
    roof_boxes=((3.4, 6.0, 0.80, 0.24), (8.2, 11.2, 0.85, 0.20)),
    display="bus", display_foot=2.56,
)  # fmt: skip

TRAM = Car(
    CarForm(
        length=30.0, width=2.65, axles=(2.4, 4.2, 14.1, 15.9, 25.8, 27.6), wheel=0.30, tyre=0.14,
        sill=0.16,
        shoulder=((0.0, 1.06), (30.0, 1.06)),
        cabin=Cabin(
            base=Outline(0.045, 29.955, 1.318, 1.30, 1.30, (2.6, 2.6)),
            top=Outline(0.95, 29.05, 1.18, 0.90, 0.90, (2.6, 2.6)),
            foot=0.98,
            roof=((0.95, 3.00), (2.2, 3.14), (27.8, 3.14), (29.05, 3.00)),
            crown=0.12, bulge=0.03,
        ),
        bonnet=((0.0, 0.0), (30.0, 0.0)),
        bow=((0.0, 0.20), (0.35, 0.0), (1.0, 0.04)),
        stern=((0.0, 0.20), (0.35, 0.0), (1.0, 0.04)),
        flank=_FLAT, nose=1.35, tail=1.35, square=(2.6, 2.6), arch=-1.0, flare=0.0,
    ),
    Glazing(
        pillars=(0.075, 0.16, 0.19, 0.27, 0.35, 0.39, 0.46, 0.54, 0.61, 0.65, 0.73, 0.81, 0.84,
                 0.925),
        pillar=0.09, front=0.10, side=(0.006, 0.994), belt=-0.02, above=0.50, rear=(0.0, 0.10),
        screen=0.0,
    ),
    Face(
        head=((0.62, 0.72), (0.98, 0.72), (1.10, 0.86), (0.66, 0.84)),
        tail=((0.62, 0.72), (0.98, 0.72), (1.10, 0.86), (0.66, 0.84)),
        indicator=((1.14, 0.74), (1.22, 0.76), (1.24, 0.86), (1.18, 0.86)),
        tail_indicator=((1.14, 0.74), (1.22, 0.76), (1.24, 0.86), (1.18, 0.86)),
        grille=(), intake=((-0.55, 0.24), (0.55, 0.24), (0.50, 0.46), (-0.50, 0.46)),
        bumpers=(0.0, 0.0), cladding=0.06, plates=(0.0, 0.0), reversing=(0.24, 0.46),
        joints=(5.9, 11.95, 18.05, 24.1),
    ),
    Doors((7.2, 8.5), foot=0.06),
    Rim(6, (0.10, 0.09), share=0.80),
    mirror=0.0,
    roof_boxes=((3.0, 5.2, 0.90, 0.38), (7.0, 11.0, 0.95, 0.42), (13.0, 17.0, 0.90, 0.34),
                (19.0, 23.0, 0.95, 0.42), (24.8, 27.0, 0.90, 0.38)),
    display="tram", display_foot=2.52,
)  # fmt: skip
