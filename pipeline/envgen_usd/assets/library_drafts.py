"""Changes of a library, made in a draft beside it and published when they are sound."""

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import resources
from pathlib import Path

from envgen_usd.build_manifest import NAME as MANIFEST
from envgen_usd.errors import EnvgenError
from envgen_usd.input_paths import check_input_folder
from envgen_usd.whole_files import make_folder, part_folder

_SHARED = ("materials", "textures")
"""Folders of which a draft holds all files."""


def new_library(folder: Path) -> None:
    """Copies the shipped library, so that an author can change it.

    Raises:
        EnvgenError: The folder is a file, holds files, or cannot be written.
    """
    if folder.exists() and not folder.is_dir():
        raise EnvgenError(f"{folder}: is a file; choose a new folder")
    if folder.exists() and any(folder.iterdir()):
        raise EnvgenError(f"{folder}: exists and is not empty; choose a new folder")
    make_folder(folder.absolute().parent)
    shipped = Path(str(resources.files("envgen_usd.asset_library")))
    try:
        with part_folder(folder.absolute().parent) as draft:
            part = draft / folder.name
            ignored = shutil.ignore_patterns("__init__.py", "__pycache__", "README.md")
            # Content without modes: an installed library may be read-only.
            shutil.copytree(shipped, part, ignore=ignored, copy_function=shutil.copyfile)
            part.chmod(0o755)
            part.replace(folder)
    except OSError as error:
        raise EnvgenError(f"{folder}: cannot be written: {error.strerror}") from error


@contextmanager
def library_draft(library: Path, *assets: Path) -> Iterator[Path]:
    """Yields a folder with the library's materials and textures; publishes it afterwards.

    Files of a draft replace those of the library when the block ends without an error; before, the
    library is unchanged. An asset is published after what it refers to, and its interface last.
    Files in a draft must be replaced, not changed in place.

    Args:
        library: Folder of the library.
        assets: Folders of assets, relative to the library, that the draft holds as well.

    Raises:
        EnvgenError: There is no library, or it cannot be written.
    """
    if library.exists():
        remedy = "name the folder of your library; 'envgen-usd library new FOLDER' makes one"
        check_input_folder(library, remedy, "--library")
    is_build = (library / MANIFEST).exists()  # with copies of what it shows
    if is_build or not ((library / "assets").is_dir() and (library / "materials").is_dir()):
        what, name = ("a build, ", "NEW_FOLDER") if is_build else ("", library)
        raise EnvgenError(
            f"{library}: {what}no asset library; 'envgen-usd library new {name}' makes one"
        )
    try:
        with part_folder(library) as draft:
            for part in (*map(Path, _SHARED), *assets):
                if (library / part).is_dir():
                    shutil.copytree(library / part, draft / part, copy_function=_linked)
                make_folder(draft / part)
            make_folder(draft / "assets")
            yield draft
            _publish(draft, library)
    except OSError as error:
        raise EnvgenError(f"{library}: cannot be written: {error.strerror}") from error


def _linked(source: str, target: str) -> None:
    """A hard link, or a copy where the file system has none."""
    try:
        os.link(source, target)
    except OSError:
        shutil.copyfile(source, target)


def _publish(draft: Path, library: Path) -> None:
    files = [path for path in sorted(draft.rglob("*")) if path.is_file()]
    for path in sorted(files, key=lambda path: path.parent.name == "usd"):
        target = library / path.relative_to(draft)
        if not (target.exists() and target.samefile(path)):
            make_folder(target.parent)
            path.replace(target)
