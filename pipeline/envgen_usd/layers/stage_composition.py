"""Composes the files of the chunks into a stage."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from pxr import Gf, Sdf

from envgen_usd.assets.asset_catalogue import Catalogue
from envgen_usd.assets.prim_authoring import add_prim, set_attribute, set_extents_hint, set_pose
from envgen_usd.assets.usd_files import new_layer, read_layer, write_layer
from envgen_usd.assets.usd_values import from_vectors
from envgen_usd.chunks import Chunk
from envgen_usd.layers.atmosphere import add_environment
from envgen_usd.layers.embedded_library import embed_library
from envgen_usd.models.environment_profile import Profile
from envgen_usd.models.road_surface import RoadSurface

LAYERS = ("props", "buildings", "roads", "landuse", "terrain")
"""Layers of the stage, strongest first."""
PRIMS = {
    "props": "Props",
    "buildings": "Buildings",
    "roads": "Roads",
    "landuse": "Terrain",
    "terrain": "Terrain",
}
"""Child prim of the chunk that each layer authors."""


def compose_stage(  # noqa: PLR0913, PLR0917 - what a stage follows from
    folder: Path,
    chunks: Sequence[Chunk],
    surface: RoadSurface,
    profile: Profile,
    catalogue: Catalogue,
    embed_assets: bool = True,
) -> Path:
    """Writes ``layers/<layer>.usda`` and ``stage.usda``.

    Args:
        folder: Output folder that holds ``chunks/<chunk>/<layer>.usdc``.
        chunks: Chunks of the map.
        surface: Road surface; gives the map's georeference.
        profile: Environment, recorded on the stage.
        catalogue: Asset library.
        embed_assets: Copy the used assets beside the stage.

    Returns:
        Path of the stage.

    Raises:
        EnvgenError: A chunk's file is missing or cannot be read.
    """
    ordered = sorted(chunks)
    for name in LAYERS:
        write_layer(_layer(name, folder, ordered), folder / "layers" / f"{name}.usda")
    if embed_assets:
        embed_library(catalogue, folder, tuple(_files(folder, ordered)))
    path = folder / "stage.usda"
    write_layer(_root_layer(ordered, surface, profile), path)
    return path


def _files(folder: Path, chunks: Sequence[Chunk]) -> Iterator[Path]:
    for chunk in chunks:
        for name in LAYERS:
            yield folder / "chunks" / chunk.name / f"{name}.usdc"


def _layer(name: str, folder: Path, chunks: Sequence[Chunk]) -> Sdf.Layer:
    """A layer with a payload for every chunk, and with extents for unloaded payloads."""
    layer = new_layer("World")
    world = add_prim(layer, "World", specifier=Sdf.SpecifierOver)
    for chunk in chunks:
        file = f"{chunk.name}/{name}.usdc"
        over = add_prim(world, chunk.prim_name, specifier=Sdf.SpecifierOver)
        overlay = name == "landuse"
        specifier = Sdf.SpecifierOver if overlay else Sdf.SpecifierDef
        prim = add_prim(over, PRIMS[name], "" if overlay else "Xform", specifier=specifier)
        prim.payloadList.prependedItems = [Sdf.Payload(f"../chunks/{file}")]
        if not overlay:
            payload = read_layer(folder / "chunks" / file)
            source = payload.GetPrimAtPath(f"/{PRIMS[name]}")
            prim.kind = source.kind
            set_extents_hint(prim, from_vectors(source.attributes["extentsHint"].default))
    return layer


def _root_layer(chunks: Sequence[Chunk], surface: RoadSurface, profile: Profile) -> Sdf.Layer:
    layer = new_layer("World")
    layer.subLayerPaths[:] = [f"layers/{name}.usda" for name in LAYERS]
    layer.customLayerData = {
        "area_type": profile.area,
        "country": profile.country,
        "geo_reference": surface.crs,
        "offset": Gf.Vec3d(*surface.offset),
    }
    world = add_prim(layer, "World", "Xform", kind="assembly")
    _set_reference(world, surface)
    add_environment(world)
    for chunk in chunks:
        prim = add_prim(world, chunk.prim_name, "Xform", kind="group")
        set_pose(prim, translate=from_vectors([*chunk.origin, 0.0]))
    return layer


def _set_reference(world: Sdf.PrimSpec, surface: RoadSurface) -> None:
    """Repeats the georeference as attributes, which survive flattening and Blender."""
    types = Sdf.ValueTypeNames
    set_attribute(world, "userProperties:geo_reference", types.String, surface.crs, custom=True)
    offset = Gf.Vec3d(*surface.offset)
    set_attribute(world, "userProperties:offset", types.Double3, offset, custom=True)
