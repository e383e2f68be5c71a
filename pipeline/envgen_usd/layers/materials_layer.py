"""Writes the materials layer: the stage's one scope of materials, and what is bound to them."""

import posixpath
from collections.abc import Iterable
from pathlib import Path

from pxr import Sdf

from envgen_usd.assets.asset_catalogue import Catalogue
from envgen_usd.assets.prim_authoring import (
    SURFACES,
    add_material_references,
    add_prim,
    bind_material,
    set_attribute,
)
from envgen_usd.assets.usd_files import new_layer, write_layer
from envgen_usd.models.environment_profile import WearRules


def write_materials(
    names: Iterable[str], wear: WearRules, catalogue: Catalogue, path: Path
) -> None:
    """Writes ``/World/Materials``, and a class of surfaces bound to each material.

    Surfaces of payloads and assets inherit the classes, so that a material is one prim.

    Args:
        names: Materials of the library.
        wear: Use and weather of the environment.
        catalogue: Asset library.
        path: .usda file in a folder beside that of the chunks, written atomically.

    Raises:
        EnvgenError: The library lacks a material.
    """
    layer = new_layer("World")
    world = add_prim(layer, "World", specifier=Sdf.SpecifierOver)
    asked_by = "layers of the stage"
    references = {
        name: _from_layers(catalogue.reference(catalogue.material(name, asked_by).path))
        for name in names
    }
    paths = add_material_references(world, references)
    classes = add_prim(layer, SURFACES.name, specifier=Sdf.SpecifierClass)
    for name, material in paths.items():
        _set_wear(layer, material, wear)
        bind_material(add_prim(classes, name, specifier=Sdf.SpecifierClass), material)
    write_layer(layer, path)


def _set_wear(layer: Sdf.Layer, material: Sdf.Path, wear: WearRules) -> None:
    """Authors the inputs with which an environment scales the wear of a material."""
    prim = layer.GetPrimAtPath(material)
    for name, amount in (("of_ground", wear.ground), ("of_walls", wear.walls)):
        set_attribute(prim, f"inputs:wear:{name}", Sdf.ValueTypeNames.Float, amount)


def _from_layers(reference: str) -> str:
    """Converts a path relative to a chunk's folder; absolute paths stay."""
    return posixpath.normpath(posixpath.join("../chunks/chunk", reference))
