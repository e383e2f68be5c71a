"""The vehicles of the shipped library."""

from collections.abc import Collection, Mapping

from envgen_usd.assets.asset_design import AssetDesign
from envgen_usd.assets.shapes.printed_faces import PrintedFaces
from envgen_usd.assets.vehicles.car_bodies import CARS
from envgen_usd.assets.vehicles.car_design import Car
from envgen_usd.assets.vehicles.car_shapes import PAINTED, car_model
from envgen_usd.assets.vehicles.lorry_shapes import (
    CARGO,
    LORRIES,
    lorry_model,
)
from envgen_usd.assets.vehicles.rail_and_bus_bodies import BUS, TRAM

PAINTS = ("grey", "black", "white", "silver", "blue", "red", "green", "beige", "yellow")
"""Paints of cars, the most common first."""
_LORRY_PAINTS = ("white", "blue", "red", "silver", "green")
_CARGOS = ("white", "blue", "grey", "red", "green", "yellow")
_BUS_PAINTS = ("white", "red", "yellow", "blue", "green")
_TRAM_PAINTS = ("yellow", "red", "white", "blue", "green")
_LIGHTS = {
    "off": {"HeadLamps": "lens_clear", "TailLamps": "lens_red"},
    "on": {"HeadLamps": "lens_clear_lit", "TailLamps": "lens_tail_lit"},
}


def vehicle_designs(prints: PrintedFaces, displays: PrintedFaces) -> tuple[AssetDesign, ...]:
    """All vehicles, by kind.

    Args:
        prints: Faces of the number plates.
        displays: Faces of the displays of destinations.
    """
    faces = prints, displays
    return (
        _design("car", "car", CARS, PAINTS, faces),
        _design("bus", "bus", {"city": BUS}, _BUS_PAINTS, faces),
        _lorries(prints),
        _design("tram", "train", {"five_section": TRAM}, _TRAM_PAINTS, faces),
    )


def _lorries(prints: PrintedFaces) -> AssetDesign:
    models = {body: lorry_model(lorry, prints) for body, lorry in LORRIES.items()}
    paints = {paint: dict.fromkeys(PAINTED, f"car_{paint}") for paint in _LORRY_PAINTS}
    cargos = {name: dict.fromkeys(CARGO, f"car_{name}") for name in _CARGOS}
    lamps = {
        state: {**_lamps(look), "RearLamps": look["TailLamps"], "Far/RearLamps": look["TailLamps"]}
        for state, look in _LIGHTS.items()
    }
    looks = {"paint": paints, "cargo": cargos, "lights": lamps}
    return AssetDesign("truck", "truck", "truck", models, "body", looks)


def _lamps(look: Mapping[str, str]) -> dict[str, str]:
    """Materials of lamps, and of the same subsets of the far mesh."""
    return {**look, **{f"Far/{part}": material for part, material in look.items()}}


def _design(
    name: str,
    label: str,
    cars: Mapping[str, Car],
    paints: Collection[str],
    faces: tuple[PrintedFaces, PrintedFaces],
) -> AssetDesign:
    models = {body: car_model(car, *faces) for body, car in cars.items()}
    looks = {
        "paint": {paint: dict.fromkeys(PAINTED, f"car_{paint}") for paint in paints},
        "lights": {state: _lamps(look) for state, look in _LIGHTS.items()},
    }
    return AssetDesign(name, label, label, models, "body", looks)
