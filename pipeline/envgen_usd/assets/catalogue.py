"""What the asset library holds, found by looking into its folders."""

import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import resources
from pathlib import Path

import numpy as np
from pxr import Sdf

from envgen_usd.assets.files import read_layer
from envgen_usd.assets.values import from_vectors
from envgen_usd.errors import EnvgenError
from envgen_usd.models.arrays import FloatArray

EMBEDDED = "../.."
"""From OUT/chunks/<chunk> to OUT, where copies of the library's folders lie."""


@dataclass(frozen=True)
class Asset:
    """One asset.

    Attributes:
        name: Name.
        kind: Kind of thing that it shows, e.g. ``tree``.
        label: Token in the `class` taxonomy.
        path: Its interface, relative to the library's folder, with ``/``.
        variants: Variants of each variant set, sorted.
        defaults: The variant that each set chooses by itself.
        sizes: Nominal extent (x, y, z) in metres by (set, variant); ("", "") for all others.
        extents: 2 x 3 box around its geometry by (set, variant); ("", "") for all others.
        widths: Least and greatest width to which it may be scaled, metres.
    """

    name: str
    kind: str
    label: str
    path: str
    variants: Mapping[str, tuple[str, ...]]
    defaults: Mapping[str, str]
    sizes: Mapping[tuple[str, str], FloatArray]
    extents: Mapping[tuple[str, str], FloatArray]
    widths: tuple[float, float] = (0.0, math.inf)

    def fits(self, width: float) -> bool:
        """Whether it looks right at that width, metres."""
        return self.widths[0] <= width <= self.widths[1]

    def size(self, selections: Mapping[str, str]) -> FloatArray:
        """Nominal extent (x, y, z) in metres with these variants."""
        return _pick(self.sizes, {**self.defaults, **selections})

    def extent(self, selections: Mapping[str, str]) -> FloatArray:
        """2 x 3 box around the geometry with these variants, before any scaling."""
        return _pick(self.extents, {**self.defaults, **selections})


@dataclass(frozen=True)
class LibraryMaterial:
    """One material: its file relative to the library's folder, and its texture's side in metres."""

    name: str
    path: str
    size: float


@dataclass(frozen=True)
class Catalogue:
    """The asset library.

    Attributes:
        folder: Where it is.
        assets: Assets by name.
        materials: Materials by name.
        prefix: How the files of a chunk refer to the library: relative to themselves where the
            library is copied beside the stage.
    """

    folder: Path
    assets: Mapping[str, Asset]
    materials: Mapping[str, LibraryMaterial]
    prefix: str

    def reference(self, path: str) -> str:
        """Asset path of a file of the library, seen from a chunk's folder."""
        return f"{self.prefix}/{path}"

    def material(self, name: str, asked_by: str) -> LibraryMaterial:
        """The material of that name.

        Raises:
            EnvgenError: There is none; the message says who asked for it.
        """
        if name not in self.materials:
            raise EnvgenError(
                f"{asked_by}: unknown material '{name}'; known: {', '.join(self.materials)}. "
                f"A new material is a new file in {self.folder / 'materials'}."
            )
        return self.materials[name]

    def of_kind(self, kind: str) -> tuple[Asset, ...]:
        """All assets that show one kind of thing."""
        return tuple(asset for asset in self.assets.values() if asset.kind == kind)


def read_catalogue(folder: Path | None = None, *, embed: bool = True) -> Catalogue:
    """Looks for assets and materials.

    An asset is a folder ``assets/<kind>/<name>`` with ``usd/<name>.usda``; a material is a file
    ``materials/<name>.usda``. Nothing else has to be told about them.

    Args:
        folder: The library; the package's own if none is given.
        embed: Stages refer to a copy beside them; otherwise to this folder itself.

    Raises:
        EnvgenError: The folder is missing, or a file in it is not what its place says.
    """
    catalogue, faults = scan_library(folder, embed=embed)
    if faults:
        more = f" (and {len(faults) - 1} more: envgen-usd library)" if len(faults) > 1 else ""
        raise EnvgenError(f"{faults[0]}{more}")
    return catalogue


def scan_library(
    folder: Path | None = None, *, embed: bool = True
) -> tuple[Catalogue, tuple[str, ...]]:
    """Looks for assets and materials as `read_catalogue` does, and for all that is wrong.

    Returns:
        What can be used, and what is wrong with each of the other files, with its path.

    Raises:
        EnvgenError: The folder is missing.
    """
    root = folder or Path(str(resources.files("envgen_usd.asset_library")))
    if not (root / "materials").is_dir() or not (root / "assets").is_dir():
        raise EnvgenError(f"{root}: no asset library; expected the folders assets and materials")
    faults: list[str] = []
    assets: dict[str, Asset] = {}
    materials: dict[str, LibraryMaterial] = {}
    for path in sorted(root.glob("assets/*/*/usd/*.usda")):
        with _noted(faults):
            asset = _read_asset(path, root)
            if asset.name in assets:
                raise EnvgenError(f"{path}: asset '{asset.name}' exists twice")
            assets[asset.name] = asset
    for path in sorted(root.glob("materials/*.usda")):
        with _noted(faults):
            materials[path.stem] = _read_material(path, root)
    prefix = EMBEDDED if embed else root.absolute().as_posix()
    return Catalogue(root, assets, materials, prefix), tuple(faults)


@contextmanager
def _noted(faults: list[str]) -> Iterator[None]:
    """Notes what is wrong with a file, so that the next one is read all the same."""
    try:
        yield
    except EnvgenError as error:
        faults += str(error).split("\n")


def _read_material(path: Path, root: Path) -> LibraryMaterial:
    layer = read_layer(path)
    prim = layer.GetPrimAtPath(f"/{path.stem}")
    if prim is None or prim.typeName != "Material" or layer.defaultPrim != path.stem:
        raise EnvgenError(f"{path}: its default prim must be a Material named {path.stem}")
    size = prim.customData.get("texture_size", 1.0)
    if not isinstance(size, int | float) or not size > 0:
        raise EnvgenError(f"{path}: texture_size must be a number above 0, found {size}")
    return LibraryMaterial(path.stem, path.relative_to(root).as_posix(), float(size))


def _read_asset(path: Path, root: Path) -> Asset:
    layer = read_layer(path)
    prim = layer.GetPrimAtPath(f"/{path.stem}")
    if prim is None or layer.defaultPrim != path.stem:
        raise EnvgenError(f"{path}: its default prim must be named {path.stem}")
    label = prim.attributes.get("semantics:labels:class")
    sizes: dict[tuple[str, str], FloatArray] = {}
    extents: dict[tuple[str, str], FloatArray] = {}
    _read_extent(prim, ("", ""), sizes, extents)
    for set_name, variant_set in sorted(prim.variantSets.items()):
        for name, variant in sorted(variant_set.variants.items()):
            _read_extent(variant.primSpec, (set_name, name), sizes, extents)
    missing = {
        "its default prim needs a label of the taxonomy 'class'": label and label.default,
        "needs customData nominal_size: x, y, z in metres": sizes,
        "needs extentsHint: two corners": extents,
    }
    if faults := [f"{path}: {what}" for what, there in missing.items() if not there]:
        raise EnvgenError("\n".join(faults))
    variants = {name: tuple(sorted(of.variants.keys())) for name, of in prim.variantSets.items()}
    return Asset(
        path.stem,
        path.parents[2].name,
        str(label.default[0]),
        path.relative_to(root).as_posix(),
        dict(sorted(variants.items())),
        dict(sorted(prim.variantSelections.items())),
        sizes,
        extents,
        _read_widths(prim, path),
    )


def _read_widths(prim: Sdf.PrimSpec, path: Path) -> tuple[float, float]:
    """`fits_width` of the custom data; any width where it is not there."""
    found = prim.customData.get("fits_width", (0.0, math.inf))
    widths = from_vectors(found) if not isinstance(found, str) else np.empty(0)
    if widths.shape != (2,) or not 0.0 <= widths[0] <= widths[1]:
        raise EnvgenError(f"{path}: fits_width must be a range of metres, found {found}")
    return float(widths[0]), float(widths[1])


def _read_extent(
    prim: Sdf.PrimSpec,
    key: tuple[str, str],
    sizes: dict[tuple[str, str], FloatArray],
    extents: dict[tuple[str, str], FloatArray],
) -> None:
    """Notes size and box where this prim or variant states usable ones."""
    if "nominal_size" in prim.customData:
        found = prim.customData["nominal_size"]
        size = from_vectors(found) if not isinstance(found, str) else np.empty(0)
        if size.shape == (3,) and (size > 0).all():
            sizes[key] = size
    hint = prim.attributes.get("extentsHint")
    if hint and hint.default is not None and len(hint.default) >= 2:
        extents[key] = from_vectors(hint.default)[:2]


def _pick(
    values: Mapping[tuple[str, str], FloatArray], selections: Mapping[str, str]
) -> FloatArray:
    """The value that the selected variants state, or else the one for all others."""
    found = [values[item] for item in sorted(selections.items()) if item in values]
    if found:
        return found[0]
    return values[("", "")] if ("", "") in values else np.array(next(iter(values.values())))
