"""Packs a flat layer with its textures into one .usdz file (USDZ File Format Specification)."""

import tempfile
from pathlib import Path

from pxr import Ar, Sdf, UsdUtils

from envgen_usd.assets.files import write_layer
from envgen_usd.errors import EnvgenError

TEXTURES = "textures"
"""Folder of the package that holds the textures."""
_TILES = "<UDIM>"
"""Stands for four digits in the path of a texture that has several files."""


def write_package(layer: Sdf.Layer, target: Path) -> None:
    """Writes a package; the file appears only when it is complete.

    `UsdUtils.CreateNewUsdzPackage` would do it too, but resolves the textures once more after it
    has given them their places in the package, and warns of each that it is not there.

    Args:
        layer: Names its textures by absolute paths, and no other layers; is changed.
        target: The .usdz file.

    Raises:
        EnvgenError: A texture cannot be read, or the target cannot be written.
    """
    places: dict[str, str] = {}
    UsdUtils.ModifyAssetPaths(layer, lambda path: _place(path, places))
    with tempfile.TemporaryDirectory(dir=target.absolute().parent) as name:
        folder = Path(name)
        write_layer(layer, folder / f"{target.stem}.usdc")
        for path, place in places.items():
            _copy(path, folder / place, target)
        files = [folder / f"{target.stem}.usdc", *sorted((folder / TEXTURES).glob("*"))]
        package = folder / target.name
        with Sdf.ZipFileWriter.CreateNew(str(package)) as writer:  # type: ignore[attr-defined]
            for file in files:
                writer.AddFile(str(file), file.relative_to(folder).as_posix())
        package.replace(target)


def _place(path: str, places: dict[str, str]) -> str:
    """Where a texture lies in the package; two files of one name from two folders stay two.

    A flat layer needs no others; where it still names one (`assetInfo`), only the name is kept.
    """
    if not path:
        return ""
    if Sdf.FileFormat.FindByExtension(path):
        return Path(path).name
    if path not in places:
        inner = path.rstrip("]").rpartition("[")[2]
        name, number = Path(inner).name, 1
        while f"{TEXTURES}/{name}" in places.values():
            number += 1
            name = f"{number}_{Path(inner).name}"
        places[path] = f"{TEXTURES}/{name}"
    return places[path]


def _copy(path: str, place: Path, target: Path) -> None:
    place.parent.mkdir(exist_ok=True)
    for tile in _tiles(Path(path)):
        file = path.replace(_TILES, tile)
        asset = Ar.GetResolver().OpenAsset(Ar.ResolvedPath(file))  # type: ignore[attr-defined]
        if not asset:
            raise EnvgenError(f"{target}: cannot be packed; texture {file} cannot be read")
        place.with_name(place.name.replace(_TILES, tile)).write_bytes(bytes(asset.GetBuffer()))


def _tiles(path: Path) -> list[str]:
    """Digits of a texture's tiles; one without meaning for a texture of one file."""
    at = path.name.find(_TILES)
    if at < 0:
        return [""]
    files = path.parent.glob(path.name.replace(_TILES, "[0-9]" * 4))
    return sorted(file.name[at : at + 4] for file in files)
