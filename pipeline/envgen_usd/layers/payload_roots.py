"""Reads what the stage says about a payload before it is loaded: root prims, boxes, materials."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from pxr import Sdf

from envgen_usd.assets.prim_authoring import SURFACES
from envgen_usd.assets.usd_files import read_layer
from envgen_usd.assets.usd_values import from_vectors
from envgen_usd.models.array_types import FloatArray


@dataclass(frozen=True)
class PayloadRoot:
    """A root prim of a chunk's file.

    Attributes:
        name: Name of the prim, and of the chunk's child that it becomes.
        default: True for the default prim of the file.
        type_name: Type; empty for opinions over a prim of a weaker layer.
        kind: Kind; empty for opinions.
        extents: Bounding box, 2 x 3 in the chunk's frame; none where the prim has no extentsHint.
    """

    name: str
    default: bool
    type_name: str
    kind: str
    extents: tuple[FloatArray, ...]


@dataclass(frozen=True)
class PayloadFile:
    """A file of a chunk.

    Attributes:
        roots: Its root prims without classes.
        materials: Names of the materials of its surfaces.
        references: Asset paths of the files that it refers to.
    """

    roots: tuple[PayloadRoot, ...]
    materials: frozenset[str]
    references: frozenset[str]


def read_payload(path: Path) -> PayloadFile:
    """Reads a file of a chunk.

    Raises:
        EnvgenError: The file is missing or not a USD layer.
    """
    layer = read_layer(path)
    surfaces = layer.GetPrimAtPath(SURFACES)
    return PayloadFile(
        tuple(_roots(layer)),
        frozenset(prim.name for prim in surfaces.nameChildren) if surfaces else frozenset(),
        frozenset(layer.GetCompositionAssetDependencies()),
    )


def _roots(layer: Sdf.Layer) -> Iterator[PayloadRoot]:
    for prim in layer.rootPrims:
        defines = prim.specifier == Sdf.SpecifierDef
        hint = prim.attributes.get("extentsHint")
        if prim.specifier != Sdf.SpecifierClass:
            yield PayloadRoot(
                prim.name,
                prim.name == layer.defaultPrim,
                prim.typeName if defines else "",
                prim.kind if defines else "",
                (from_vectors(hint.default),) if hint else (),
            )
