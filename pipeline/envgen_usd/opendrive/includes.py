"""Includes: files in the file's own folder that are part of it (7.3)."""

from pathlib import Path

from envgen_usd.opendrive.document import LARGEST_FILE, parse, strip_namespace
from envgen_usd.opendrive.findings import Element, Findings, Hostile, remove

MOST_FILES = 256
"""Files that one map may include, each counted as often as it is included."""
_DEEPEST = 8


def follow_includes(root: Element, path: Path, findings: Findings) -> None:
    """Puts the content of included files in place of the include elements.

    An included file whose root is the element that it is included in (or OpenDRIVE) stands for
    that root's children, any other for its root.

    Args:
        root: The file's root; changed.
        path: The file.
        findings: Takes an issue for each file that is not there.

    Raises:
        Hostile: An include leaves the file's folder, or there are too many or too large ones.
        EnvgenError: An included file cannot be read.
    """
    _Includes(path.resolve().parent, findings).follow(root, path.resolve().parent, 0)


class _Includes:
    """Counts what the includes of one map have brought in."""

    def __init__(self, folder: Path, findings: Findings) -> None:
        self._folder = folder
        self._findings = findings
        self._files = 0
        self._bytes = 0

    def follow(self, root: Element, folder: Path, depth: int) -> None:
        for element in list(root.iter("include")):
            target = self._target(element, folder)
            if not target.is_file():
                text = f"there is no file {element.get('file')!r}"
                self._findings.mended("include.missing", element, text, "include left out")
                remove(element)
                continue
            self._count(element, target, depth)
            included = parse(target, self._findings).getroot()
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
        self._files += 1
        self._bytes += target.stat().st_size
        if self._files > MOST_FILES or self._bytes > LARGEST_FILE or depth >= _DEEPEST:
            raise Hostile(element, "includes too many files, too much, or itself")


def _splice(element: Element, included: Element) -> None:
    parent = element.getparent()
    if parent is None:
        raise Hostile(element, "an include that is a whole file")
    whole = included.tag not in {parent.tag, "OpenDRIVE"}
    place = parent.index(element)
    for child in [included] if whole else list(included):
        child.tail = child.tail or element.tail
        parent.insert(place, child)
        place += 1
    remove(element)
