"""Includes: further files of the map in the same folder (7.3)."""

from pathlib import Path

from envgen_usd.opendrive.document.findings import Element, Findings, Hostile, remove
from envgen_usd.opendrive.document.xml_document import LARGEST_FILE, parse, strip_namespace

MOST_FILES = 256
"""Largest number of includes of a map; a file counts once for each include."""
_DEEPEST = 8
"""Largest nesting depth of includes; a larger value accepts deeper chains."""


def follow_includes(root: Element, path: Path, findings: Findings) -> tuple[Path, ...]:
    """Replaces the include elements by the content of the included files.

    If the included root is OpenDRIVE or has the tag of the enclosing element, its children replace
    the include. Otherwise the root itself replaces it.

    Args:
        root: Root of the including file; changed in place.
        path: Path of the including file.
        findings: Collects an issue for each missing file.

    Returns:
        The included files, each listed once, in the order of their first include.

    Raises:
        Hostile: An include leaves the file's folder, or the includes exceed `MOST_FILES`, the
            largest size or the largest depth.
        EnvgenError: An included file cannot be read.
    """
    includes = _Includes(path.resolve().parent, findings)
    includes.follow(root, path.resolve().parent, 0)
    return tuple(includes.files)


class _Includes:
    """Expands the includes of a map and counts their files and bytes."""

    def __init__(self, folder: Path, findings: Findings) -> None:
        self._folder = folder
        self._findings = findings
        self._count_of_files = 0
        self._bytes = 0
        self.files: dict[Path, None] = {}

    def follow(self, root: Element, folder: Path, depth: int) -> None:
        for element in list(root.iter("include")):
            target = self._target(element, folder)
            if not target.is_file():
                text = f"there is no file {element.get('file')!r}"
                self._findings.repaired("include.missing", element, text, "include left out")
                remove(element)
                continue
            self._count(element, target, depth)
            self.files[target] = None
            included = parse(target, self._findings, packed=False).getroot()
            strip_namespace(included)
            self.follow(included, target.parent, depth + 1)
            _splice(element, included)

    def _target(self, element: Element, folder: Path) -> Path:
        name = element.get("file", "")
        target = (folder / name).resolve()
        if "://" in name or not target.is_relative_to(self._folder):
            raise Hostile(element, f"includes {name!r} outside the file's folder")
        return target

    def _count(self, element: Element, target: Path, depth: int) -> None:
        self._count_of_files += 1
        self._bytes += target.stat().st_size
        if self._count_of_files > MOST_FILES or self._bytes > LARGEST_FILE or depth >= _DEEPEST:
            raise Hostile(element, "includes too many files, too many bytes, or itself")


def _splice(element: Element, included: Element) -> None:
    parent = element.getparent()
    if parent is None:
        raise Hostile(element, "an include element is the root of a whole file")
    whole = included.tag not in {parent.tag, "OpenDRIVE"}
    place = parent.index(element)
    for child in [included] if whole else list(included):
        child.tail = child.tail or element.tail
        parent.insert(place, child)
        place += 1
    remove(element)
