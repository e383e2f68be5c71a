"""The OpenDRIVE file of a build, handed on byte by byte."""

import shutil
from pathlib import Path

from envgen_usd.build_manifest import hash_file, read_manifest
from envgen_usd.errors import EnvgenError
from envgen_usd.input_paths import check_input_file
from envgen_usd.whole_files import whole_file


def check_road(folder: Path, road: Path, *more: Path) -> None:
    """Checks that a road is that of a build.

    Args:
        folder: Folder of the build.
        road: OpenDRIVE file.
        more: Folders of the layers of an artist's stage, of which one may be that of the build.

    Raises:
        EnvgenError: There is no such file, or the build has another road.
    """
    check_input_file(road, "name the OpenDRIVE file of the build", "--road")
    for place in dict.fromkeys((folder, *more)):
        manifest = read_manifest(place)
        known = manifest.hashes.get("road", {}) if manifest else {}
        if known and hash_file(road) not in known.values():
            raise EnvgenError(f"--road {road}: is not the road of {place}; give {', '.join(known)}")


def copy_road(road: Path, target: Path) -> None:
    """Copies a road; the copy appears whole or not at all."""
    with whole_file(target) as part:
        shutil.copyfile(road, part)
