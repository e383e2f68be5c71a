"""The bicycles, motorcycles and their riders of the shipped library."""

from dataclasses import replace

import numpy as np

from envgen_usd.assets.asset_design import AssetDesign, Model
from envgen_usd.assets.people import head_shapes
from envgen_usd.assets.people.body_sizes import man, woman
from envgen_usd.assets.people.figure_models import Figure, Outfit
from envgen_usd.assets.people.figure_pieces import FAR, composed, grounded
from envgen_usd.assets.people.garment_shapes import Cut
from envgen_usd.assets.people.people_designs import worn_looks
from envgen_usd.assets.two_wheelers import motorcycle_shapes
from envgen_usd.assets.two_wheelers.bicycle_shapes import (
    CITY,
    SPORT,
    BicycleForm,
    bicycle_pieces,
    pedals,
    wheel_centres,
)
from envgen_usd.assets.two_wheelers.motorcycle_shapes import (
    MOTORCYCLE,
    SCOOTER,
    MotorForm,
    motorcycle_pieces,
    scooter_pieces,
)
from envgen_usd.assets.two_wheelers.rider_poses import RiderSeat, rider_pieces
from envgen_usd.assets.vehicles.car_fittings import wheel_figures
from envgen_usd.models.array_types import FloatArray

PEDALLING = 4
"""Poses of a turn of the cranks."""
_PAINTS = ("black", "blue", "grey", "red", "green", "white")
_JACKET = Cut(0.505, 0.018, collar=0.866)
_SLEEVE = Cut(1.97, 0.012, 0.042)
_TROUSERS = Cut(2.04, 0.008, 0.055)
RIDERS = {
    "cyclist": Figure(
        woman(1.67), Outfit(head_shapes.BOB, _JACKET, _SLEEVE, _TROUSERS, scarf=True),
        grips=(0.85, 0.85),
    ),
    "cyclist_sport": Figure(
        man(1.80), Outfit(head_shapes.HELMET, _JACKET, _SLEEVE, Cut(0.96, 0.008, 0.07)),
        grips=(0.85, 0.85),
    ),
    "motorcyclist": Figure(
        man(1.79), Outfit(head_shapes.FULL_FACE, _JACKET, _SLEEVE, _TROUSERS, zip_=True),
        grips=(0.85, 0.85),
    ),
}  # fmt: skip


def two_wheeler_designs() -> tuple[AssetDesign, ...]:
    """Bicycles and motorcycles, alone and with riders."""
    models = {name: composed(bicycle_pieces(form)) for name, form in _FORMS.items()}
    return (
        AssetDesign(
            "bicycle", "bicycle", "bicycle", models, "design",
            {"paint": _paints("Frame", _PAINTS)},
        ),
        _cyclist("cyclist", CITY, 24.0),
        _cyclist("cyclist_sport", SPORT, 46.0),
        *_motorcycles(),
    )  # fmt: skip


_FORMS = {"city": CITY, "sport": SPORT}


def _motorcycles() -> tuple[AssetDesign, AssetDesign]:
    motors = {"motorcycle": motorcycle_pieces(), "scooter": scooter_pieces()}
    alone = {name: composed(pieces) for name, pieces in motors.items()}
    ridden = {
        "motorcycle": _motor_rider(MOTORCYCLE, 20.0),
        "scooter": _motor_rider(SCOOTER, 4.0),
    }
    with_rider = {
        name: _rolling(
            grounded(composed((*motors[name], *rider_pieces(RIDERS["motorcyclist"], place)))),
            motorcycle_shapes.wheel_centres(form),
        )
        for (name, place), form in zip(ridden.items(), (MOTORCYCLE, SCOOTER), strict=True)
    }
    paint = _paints("Bodywork", _PAINTS)
    clothes = worn_looks("motorcyclist", RIDERS["motorcyclist"], with_rider["motorcycle"])
    return (
        AssetDesign("motorcycle", "motorcycle", "motorcycle", alone, "design", {"paint": paint}),
        AssetDesign(
            "motorcyclist", "motorcyclist", "motorcycle", with_rider, "design",
            {"clothes": clothes, "paint": paint},
        ),
    )  # fmt: skip


def _motor_rider(form: MotorForm, lean: float) -> RiderSeat:
    seat = np.array([form.seat[0], 0.0, form.seat[1]])
    mirrored = [1.0, -1.0, 1.0]
    grip, foot = np.array(form.grip), np.array(form.foot)
    grips, feet = np.stack([grip, grip * mirrored]), np.stack([foot, foot * mirrored])
    return RiderSeat(seat, grips, feet, lean, (6.0, 6.0), apart=0.7)


def _paints(part: str, paints: tuple[str, ...]) -> dict[str, dict[str, str]]:
    return {paint: dict.fromkeys((part, f"{FAR}/{part}"), f"paint_{paint}") for paint in paints}


def _cyclist(name: str, form: BicycleForm, lean: float) -> AssetDesign:
    models = {f"pedal_{k}": _riding(name, form, lean, 360.0 * k / PEDALLING + 30.0)
              for k in range(PEDALLING)}  # fmt: skip
    looks = {
        "clothes": worn_looks(name, RIDERS[name], next(iter(models.values()))),
        "paint": _paints("Frame", _PAINTS[:3]),
    }
    return AssetDesign(name, "cyclist", "bicycle", models, "pose", looks, has_poses=True)


def _riding(name: str, form: BicycleForm, lean: float, turn: float) -> Model:
    places = np.stack(pedals(form, turn)) + np.array([0.0, 0.0, 0.012])
    angle = np.radians(turn)
    # The foot behind the axle points down, the one before it is level.
    tilt = (12.0 + 10.0 * float(np.cos(angle)), 12.0 - 10.0 * float(np.cos(angle)))
    grip = np.array(form.grips)
    seat = np.array([form.saddle[0] - 0.02, 0.0, form.saddle[1]])
    place = RiderSeat(
        seat, np.stack([grip, grip * [1.0, -1.0, 1.0]]), places, lean, tilt, apart=0.45
    )
    model = composed((*bicycle_pieces(form, turn), *rider_pieces(RIDERS[name], place)))
    per_turn = 2.0 * np.pi * form.radius * 2.6
    pedalling = replace(model, custom={"pedal_distance": round(per_turn, 3)})
    return _rolling(grounded(pedalling), wheel_centres(form))


def _rolling(model: Model, centres: FloatArray) -> Model:
    """The model with figures of its wheels, which tell that they turn."""
    return replace(
        model, custom={**model.custom, **wheel_figures(centres, float(centres[:, 2].mean()))}
    )
