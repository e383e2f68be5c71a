"""Packs a flat layer with its textures into a .usdz file (USDZ File Format Specification)."""

import zipfile
from pathlib import Path

from pxr import Ar, Sdf, Tf, UsdUtils

from envgen_usd.errors import EnvgenError
from envgen_usd.whole_files import whole_file

TEXTURES = "textures"
"""Folder of the package that holds the textures."""
_TILES = "<UDIM>"
"""Placeholder for the four tile digits in the path of a UDIM texture."""


def write_package(layer: Sdf.Layer, target: Path) -> None:
    """Writes a package; the file is written whole or not at all.

    `UsdUtils.CreateNewUsdzPackage` resolves the textures again after it has moved them into the
    package. It then warns about every texture.

    Args:
        layer: Names its textures by absolute paths, and references no other layers; is changed.
        target: .usdz file.

    Raises:
        EnvgenError: A texture cannot be read, or the target cannot be written.
    """
    places: dict[str, str] = {}
    UsdUtils.ModifyAssetPaths(layer, lambda path: _place(path, places))
    with whole_file(target, Tf.ErrorException, zipfile.BadZipFile) as package:
        folder = package.parent
        layer.Export(str(folder / f"{target.stem}.usdc"))
        for path, place in places.items():
            _copy(path, folder / place, target)
        files = [folder / f"{target.stem}.usdc", *sorted((folder / TEXTURES).glob("*"))]
        with Sdf.ZipFileWriter.CreateNew(str(package)) as writer:  # type: ignore[attr-defined]
            for file in files:
                writer.AddFile(str(file), file.relative_to(folder).as_posix())
        # The writer does not report a full disk; a truncated package reveals it.
        zipfile.ZipFile(package).close()


def _place(path: str, places: dict[str, str]) -> str:
    """Path of a texture in the package; textures that share a name keep separate paths.

    A flat layer needs no other layers; where it still names a layer (`assetInfo`), only the name is
    kept.
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
    """Digits of a texture's UDIM tiles; a dummy value for a single file."""
    at = path.name.find(_TILES)
    if at < 0:
        return [""]
    files = path.parent.glob(path.name.replace(_TILES, "[0-9]" * 4))
    return sorted(file.name[at : at + 4] for file in files)
