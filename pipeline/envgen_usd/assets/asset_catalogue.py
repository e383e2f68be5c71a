"""Catalogue of the asset library, read from its folders."""

import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import lru_cache
from importlib import resources
from pathlib import Path

import numpy as np
from pxr import Sdf, Tf

from envgen_usd.assets.signs.sign_sheets import SignSheet, faces, read_sign_sheets
from envgen_usd.assets.usd_files import read_layer
from envgen_usd.assets.usd_values import from_vectors
from envgen_usd.errors import EnvgenError, noted, one_line
from envgen_usd.file_states import FileState, file_state
from envgen_usd.input_paths import check_input_folder
from envgen_usd.models.array_types import FloatArray

EMBEDDED = "../.."
"""Relative path from OUT/chunks/<chunk> to OUT, which holds copies of the library's folders."""
_ASSETS, _MATERIALS = "assets/*/*/usd/*.usda", "materials/*.usda"
"""Where the interfaces of assets and the materials lie in a library."""


@dataclass(frozen=True)
class Asset:
    """An asset of the library.

    Attributes:
        name: Name.
        kind: Kind of object, e.g. ``tree``.
        label: Token in the `class` taxonomy.
        path: Path of its interface relative to the library's folder, with ``/``.
        variants: Variants of each variant set, sorted.
        defaults: Default variant of each set.
        sizes: Nominal extent (x, y, z) in metres by (set, variant); ("", "") for all others.
        extents: 2 x 3 bounding box by (set, variant); ("", "") for all others.
        widths: Least and largest width to which it may be scaled, metres.
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
        """True if the asset suits that width, metres."""
        return self.widths[0] <= width <= self.widths[1]

    def size(self, selections: Mapping[str, str]) -> FloatArray:
        """Nominal extent (x, y, z) in metres with these variants."""
        return _pick(self.sizes, {**self.defaults, **selections})

    def extent(self, selections: Mapping[str, str]) -> FloatArray:
        """2 x 3 bounding box with these variants, metres, before any scaling."""
        return _pick(self.extents, {**self.defaults, **selections})


@dataclass(frozen=True)
class LibraryMaterial:
    """A material: its file in the library, and its texture's side length in metres."""

    name: str
    path: str
    size: float


@dataclass(frozen=True)
class Catalogue:
    """The asset library.

    Attributes:
        folder: Folder of the library.
        assets: Assets by name.
        materials: Materials by name.
        prefix: Path prefix with which a chunk's files reference the library; relative if the
            library is copied beside the stage.
        signs: Sheets of sign faces.
    """

    folder: Path
    assets: Mapping[str, Asset]
    materials: Mapping[str, LibraryMaterial]
    prefix: str
    signs: tuple[SignSheet, ...] = ()

    def reference(self, path: str) -> str:
        """Asset path of a library file, relative to a chunk's folder."""
        return f"{self.prefix}/{path}"

    def material(self, name: str, asked_by: str) -> LibraryMaterial:
        """Returns the material of that name.

        Raises:
            EnvgenError: The material does not exist; the message names the requester.
        """
        if name not in self.materials:
            raise EnvgenError(
                f"{asked_by}: unknown material '{name}'; known: {', '.join(self.materials)}. "
                f"A new material is a new file in {self.folder / 'materials'}."
            )
        return self.materials[name]

    def of_kind(self, kind: str) -> tuple[Asset, ...]:
        """All assets of a kind."""
        return tuple(asset for asset in self.assets.values() if asset.kind == kind)


def read_catalogue(folder: Path | None = None, *, embed: bool = True) -> Catalogue:
    """Reads the assets and materials of a library; a process reads unchanged files once.

    An asset is a folder ``assets/<kind>/<name>`` with ``usd/<name>.usda``; a material is a file
    ``materials/<name>.usda``. Neither needs registration.

    Args:
        folder: Library; `None` means the shipped library.
        embed: Stages reference a copy beside them; otherwise the folder itself.

    Raises:
        EnvgenError: The folder is missing, or a file does not match its path.
    """
    root = folder or Path(str(resources.files("envgen_usd.asset_library")))
    known, faults = _scanned(root, _states(root), embed=embed)
    if faults:
        more = f" (and {len(faults) - 1} more: envgen-usd library check)" if len(faults) > 1 else ""
        raise EnvgenError(f"{faults[0]}{more}")
    return replace(known, assets=dict(known.assets), materials=dict(known.materials))


@lru_cache(maxsize=4)
def _scanned(
    root: Path,
    states: tuple[tuple[Path, FileState], ...],  # noqa: ARG001 - other states are another library
    *,
    embed: bool,
) -> tuple[Catalogue, tuple[str, ...]]:
    return scan_library(root, embed=embed)


def _states(root: Path) -> tuple[tuple[Path, FileState], ...]:
    """States of all files that a catalogue follows from."""
    patterns = (_ASSETS, _MATERIALS, "signs/*.toml")
    paths = (path for pattern in patterns for path in sorted(root.resolve().glob(pattern)))
    return tuple((path, file_state(path)) for path in paths)


def scan_library(
    folder: Path | None = None, *, embed: bool = True
) -> tuple[Catalogue, tuple[str, ...]]:
    """Reads assets and materials as `read_catalogue` does, and collects all errors.

    Returns:
        The usable assets and materials, and the errors of the other files with their paths.

    Raises:
        EnvgenError: The folder is missing.
    """
    root = folder or Path(str(resources.files("envgen_usd.asset_library")))
    if root.exists():
        check_input_folder(root, "name the folder of an asset library")
    if not (root / "materials").is_dir() or not (root / "assets").is_dir():
        raise EnvgenError(f"{root}: no asset library; expected the folders assets and materials")
    # OpenUSD gives some paths of files with links followed; all have to agree.
    root = root.resolve()
    faults: list[str] = []
    assets: dict[str, Asset] = {}
    materials: dict[str, LibraryMaterial] = {}
    for path in sorted(root.glob(_ASSETS)):
        with noted(faults), _metadata_named(path):
            asset = _read_asset(path, root)
            if asset.name in assets:
                raise EnvgenError(f"{path}: asset '{asset.name}' exists twice")
            assets[asset.name] = asset
    for path in sorted(root.glob(_MATERIALS)):
        with noted(faults), _metadata_named(path):
            materials[path.stem] = _read_material(path, root)
    signs: tuple[SignSheet, ...] = ()
    with noted(faults):
        signs = read_sign_sheets(root)
        _check_signs(signs, assets, root)
    prefix = EMBEDDED if embed else root.as_posix()
    return Catalogue(root, assets, materials, prefix, signs), tuple(faults)


def _check_signs(signs: tuple[SignSheet, ...], assets: Mapping[str, Asset], root: Path) -> None:
    """Checks that each face of the sheets is a variant of its asset."""
    for sheet in signs:
        asset = assets.get(sheet.asset)
        known = asset.variants.get("face", ()) if asset else ()
        for name in (face.name for face in faces(sheet)):
            if name not in known:
                raise EnvgenError(
                    f"{root / 'signs' / sheet.name}.toml: face '{name}' is no variant of the set "
                    f"'face' of the asset '{sheet.asset}'"
                )


@contextmanager
def _metadata_named(path: Path) -> Iterator[None]:
    """Turns values that the metadata of a layer cannot have into an `EnvgenError`."""
    try:
        yield
    except (TypeError, ValueError, IndexError, AttributeError, Tf.ErrorException) as error:
        raise EnvgenError(
            f"{path}: metadata of an unexpected type: {one_line(error)}; see the library's README"
        ) from error


def _read_material(path: Path, root: Path) -> LibraryMaterial:
    layer = read_layer(path)
    prim = layer.GetPrimAtPath(f"/{path.stem}")
    if prim is None or prim.typeName != "Material" or layer.defaultPrim != path.stem:
        raise EnvgenError(f"{path}: its default prim must be a Material named {path.stem}")
    size = prim.customData.get("texture_size", 1.0)
    if not isinstance(size, int | float) or not size > 0:
        raise EnvgenError(f"{path}: texture_size must be a number above 0, got {size}")
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
    """`fits_width` of the custom data; any width if it is missing."""
    value = prim.customData.get("fits_width", (0.0, math.inf))
    widths = from_vectors(value) if not isinstance(value, str) else np.empty(0)
    if widths.shape != (2,) or not 0.0 <= widths[0] <= widths[1]:
        raise EnvgenError(f"{path}: fits_width must be a range of metres, got {value}")
    return float(widths[0]), float(widths[1])


def _read_extent(
    prim: Sdf.PrimSpec,
    key: tuple[str, str],
    sizes: dict[tuple[str, str], FloatArray],
    extents: dict[tuple[str, str], FloatArray],
) -> None:
    """Records the size and the box of this prim or variant if they are valid."""
    if "nominal_size" in prim.customData:
        nominal = prim.customData["nominal_size"]
        size = from_vectors(nominal) if not isinstance(nominal, str) else np.empty(0)
        if size.shape == (3,) and (size > 0).all():
            sizes[key] = size
    hint = prim.attributes.get("extentsHint")
    if hint and hint.default is not None and len(hint.default) >= 2:
        extents[key] = from_vectors(hint.default)[:2]


def _pick(
    values: Mapping[tuple[str, str], FloatArray], selections: Mapping[str, str]
) -> FloatArray:
    """The value of the selected variants, or else the general value."""
    stated = [values[item] for item in sorted(selections.items()) if item in values]
    if stated:
        return stated[0]
    return values[("", "")] if ("", "") in values else np.array(next(iter(values.values())))
