"""Composes the files of the chunks into a stage."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import chain
from pathlib import Path
from typing import TypeAlias

from pxr import Gf, Sdf

from envgen_usd.assets.asset_catalogue import Catalogue
from envgen_usd.assets.prim_authoring import (
    SEASON,
    SEASON_CLASS,
    add_prim,
    apply_schemas,
    set_attribute,
    set_custom,
    set_extents_hint,
    set_pose,
    union_extent,
)
from envgen_usd.assets.stage_schemas import ANCHOR, CHUNK
from envgen_usd.assets.usd_files import new_layer, write_layer
from envgen_usd.assets.usd_values import from_vectors
from envgen_usd.chunks import CHUNK_SIZE, Chunk
from envgen_usd.geometry.georeference import origin_degrees
from envgen_usd.layers.atmosphere_layer import NAME as ATMOSPHERE
from envgen_usd.layers.atmosphere_layer import write_atmosphere
from envgen_usd.layers.embedded_library import embed_library, library_files
from envgen_usd.layers.materials_layer import write_materials
from envgen_usd.layers.payload_roots import PayloadFile, PayloadRoot, read_payload
from envgen_usd.light.seasons import SUMMER
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.environment_profile import Profile
from envgen_usd.models.road_surface import RoadSurface
from envgen_usd.output_folder import STAGE_FILE

ACTORS = "actors"
"""Layer of what is on the streets; a stage may lack it."""
LAYERS = ("props", "buildings", "roads", "landuse", "terrain")
"""Other layers with a payload for each chunk, strongest first."""
MATERIALS = "materials"
"""Layer of the materials; weaker than those of the chunks."""
CHUNKS = "chunks"
"""Weakest layer of the stage: the prims of the chunks."""
CHUNK_CONTENTS = Sdf.Path("/__chunk__")
"""Scope of what the chunks' payloads bring; it is not active, so the stage does not compose it.

An unloaded chunk is then a single prim, and layers can still be muted for all chunks: the payload
of a chunk refers to the stage itself, whose sublayers bring the children by payloads of the scope.
USD reads these when the first chunk is loaded.
"""

_Payloads: TypeAlias = Mapping[tuple[str, Chunk], PayloadFile]
"""Files of the chunks, by layer and chunk."""


def compose_stage(  # noqa: PLR0913, PLR0917 - what a stage follows from
    folder: Path,
    chunks: Sequence[Chunk],
    surface: RoadSurface,
    profile: Profile,
    catalogue: Catalogue,
    embed_assets: bool = True,
    seed: int = 0,
    above: Sequence[str] = (),
    *,
    actors: bool = False,
    read: Callable[[Path], PayloadFile] = read_payload,
) -> Path:
    """Writes ``layers/<layer>.usda`` and ``stage.usda``.

    What grows with the map is binary, since text takes several times longer to open:
    ``layers/<layer>.usdc`` is the payload of a layer, ``layers/chunks.usdc`` holds the chunks.

    Args:
        folder: Output folder that holds ``chunks/<chunk>/<layer>.usdc``.
        chunks: Chunks of the map.
        surface: Road surface; gives the map's georeference.
        profile: Environment, recorded on the stage.
        catalogue: Asset library.
        embed_assets: Copy the used assets beside the stage.
        seed: Random seed of the clouds.
        above: Names of further files in ``layers``, strongest first.
        actors: Chunks have a layer of actors.
        read: Tells what the stage says of a chunk's file.

    Returns:
        Path of the stage.

    Raises:
        EnvgenError: A chunk's file is missing or cannot be read, or the library lacks a material.
    """
    ordered = sorted(chunks)
    layers = (ACTORS, *LAYERS) if actors else LAYERS
    payloads = {
        (name, chunk): read(folder / _file(name, chunk)) for chunk in ordered for name in layers
    }
    for name in (ACTORS, *LAYERS):
        for path in (folder / "layers").glob(f"{name}.usd?"):
            path.unlink()
    for name in layers:
        write_layer(_layer(name), folder / "layers" / f"{name}.usda")
        contents = _contents_layer(name, ordered, payloads)
        write_layer(contents, folder / "layers" / f"{name}.usdc")
    write_layer(_chunks_layer(ordered, payloads, profile), folder / "layers" / f"{CHUNKS}.usdc")
    files = library_files(catalogue, payloads.values())
    used = [name for name, entry in catalogue.materials.items() if entry.path in files]
    write_materials(used, profile.wear, catalogue, folder / "layers" / f"{MATERIALS}.usda")
    write_atmosphere(folder, seed)
    if embed_assets:
        embed_library(catalogue, folder, files)
    path = folder / STAGE_FILE
    root = _root_layer(surface, profile)
    texts = (f"{name}.usda" for name in (*above, ATMOSPHERE, *layers, MATERIALS))
    root.subLayerPaths[:] = [f"layers/{name}" for name in (*texts, f"{CHUNKS}.usdc")]
    write_layer(root, path)
    return path


def _file(layer: str, chunk: Chunk) -> str:
    """Path of a chunk's file relative to the output folder."""
    return f"chunks/{chunk.name}/{layer}.usdc"


def _layer(name: str) -> Sdf.Layer:
    """A sublayer of the stage: the contents of all chunks in one payload."""
    layer = new_layer("World")
    contents = add_prim(layer, CHUNK_CONTENTS.name, specifier=Sdf.SpecifierOver)
    contents.payloadList.prependedItems = [Sdf.Payload(f"{name}.usdc", CHUNK_CONTENTS)]
    return layer


def _contents_layer(name: str, chunks: Sequence[Chunk], payloads: _Payloads) -> Sdf.Layer:
    """A layer with a payload for every chunk, and with extents for unloaded payloads."""
    layer = new_layer("World")
    contents = add_prim(layer, CHUNK_CONTENTS.name, specifier=Sdf.SpecifierOver)
    of_chunk = _by_chunk(payloads)
    for chunk in chunks:
        over = add_prim(contents, chunk.prim_name, specifier=Sdf.SpecifierOver)
        for root in payloads[name, chunk].roots:
            specifier = Sdf.SpecifierDef if root.type_name else Sdf.SpecifierOver
            prim = add_prim(over, root.name, root.type_name, specifier=specifier)
            target = Sdf.Path() if root.default else Sdf.Path(f"/{root.name}")
            prim.payloadList.prependedItems = [Sdf.Payload(f"../{_file(name, chunk)}", target)]
            if root.type_name:
                prim.kind = root.kind
                boxes = [each for each in _roots(of_chunk[chunk]) if each.name == root.name]
                set_extents_hint(prim, _extent(boxes))
    return layer


def _chunks_layer(chunks: Sequence[Chunk], payloads: _Payloads, profile: Profile) -> Sdf.Layer:
    """The prims of the chunks, with their payloads and extents."""
    layer = new_layer("World")
    contents = add_prim(layer, CHUNK_CONTENTS.name, specifier=Sdf.SpecifierClass)
    contents.active = False
    world = add_prim(layer, "World", specifier=Sdf.SpecifierOver)
    of_chunk = _by_chunk(payloads)
    for chunk in chunks:
        prim = add_prim(world, chunk.prim_name, "Xform", kind="group")
        content = CHUNK_CONTENTS.AppendChild(chunk.prim_name)
        prim.payloadList.prependedItems = [Sdf.Payload("", content)]
        set_pose(prim, translate=from_vectors([*chunk.origin, 0.0]))
        set_extents_hint(prim, _extent(_roots(of_chunk[chunk])))
        _describe(prim, chunk, profile)
    return layer


def _by_chunk(payloads: _Payloads) -> dict[Chunk, list[PayloadFile]]:
    of_chunk: dict[Chunk, list[PayloadFile]] = {}
    for (_, chunk), file in payloads.items():
        of_chunk.setdefault(chunk, []).append(file)
    return of_chunk


def _roots(files: Iterable[PayloadFile]) -> list[PayloadRoot]:
    """Opinions of all files of a chunk over its children."""
    return list(chain.from_iterable(file.roots for file in files))


def _extent(roots: Iterable[PayloadRoot]) -> FloatArray:
    """Bounding box of the roots of a chunk's files, 2 x 3."""
    return union_extent([box for root in roots for box in root.extents])


def _root_layer(surface: RoadSurface, profile: Profile) -> Sdf.Layer:
    layer = new_layer("World")
    layer.customLayerData = {
        "area_type": profile.area,
        "country": profile.country,
        "geo_reference": surface.crs,
        "offset": Gf.Vec3d(*surface.offset),
    }
    season = add_prim(layer, SEASON_CLASS.name, specifier=Sdf.SpecifierClass)
    season.variantSelections[SEASON] = SUMMER
    world = add_prim(layer, "World", "Xform", kind="assembly")
    _set_reference(world, surface)
    return layer


def _describe(prim: Sdf.PrimSpec, chunk: Chunk, profile: Profile) -> None:
    """Authors what the schema of a chunk declares."""
    types = Sdf.ValueTypeNames
    apply_schemas(prim, CHUNK)
    index = Gf.Vec2i(chunk.x, chunk.y)
    set_attribute(prim, "userProperties:index", types.Int2, index, custom=True)
    set_attribute(prim, "userProperties:side", types.Float, CHUNK_SIZE, custom=True)
    set_custom(prim, {"area_type": profile.area, "country": profile.country})


def _set_reference(world: Sdf.PrimSpec, surface: RoadSurface) -> None:
    """Repeats the georeference as attributes, which survive flattening and Blender."""
    types = Sdf.ValueTypeNames
    apply_schemas(world, ANCHOR)
    degrees = origin_degrees(surface.crs, surface.offset)
    if degrees is not None:
        place = Gf.Vec2d(*degrees)
        set_attribute(world, "userProperties:latitude_longitude", types.Double2, place, custom=True)
    set_attribute(world, "userProperties:geo_reference", types.String, surface.crs, custom=True)
    offset = Gf.Vec3d(*surface.offset)
    set_attribute(world, "userProperties:offset", types.Double3, offset, custom=True)
