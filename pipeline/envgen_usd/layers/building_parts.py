"""Selects buildings and their openings, and names their prims."""

from collections.abc import Iterator

from envgen_usd.assets.prim_authoring import prim_names
from envgen_usd.models.city_model import City, CityObject, ThematicSurface

CLASSES = {
    "Building": "building",
    "OtherConstruction": "building",
    "Bridge": "bridge",
    "Tunnel": "tunnel",
}
"""Token in the `class` taxonomy of each kind of construction."""


def buildings_by_name(city: City) -> dict[str, CityObject]:
    """Returns the top-level constructions of a city by prim name.

    The buildings layer and the props layer get the same names without reading each other's files.
    """
    tops = {top.id: top for top in city.objects if top.kind in CLASSES}
    return {name: tops[key] for key, name in prim_names(tops).items()}


def with_openings(surfaces: tuple[ThematicSurface, ...]) -> Iterator[ThematicSurface]:
    """Surfaces, each followed by its windows and doors."""
    for surface in surfaces:
        yield surface
        yield from with_openings(surface.openings)
