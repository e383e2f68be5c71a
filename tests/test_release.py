"""What a release holds, from its description alone; `make release` makes and tries one."""

import importlib.util
import re
import tomllib
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[1]
SETTINGS = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))


def tool(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, ROOT / "tools" / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def packaged() -> set[str]:
    """Paths that the lists of packages and of their data in pyproject.toml stand for."""
    packaging = SETTINGS["tool"]["setuptools"]
    folders = packaging["package-dir"]
    found: set[str] = set()
    for package in packaging["packages"]:
        inside = Path(*package.split("."))
        folder = ROOT / folders.get(package, Path(folders[""]) / inside)
        for pattern in ("*.py", *packaging["package-data"].get(package, ())):
            files = (path for path in folder.glob(pattern) if path.is_file())
            found |= {(inside / path.relative_to(folder)).as_posix() for path in files}
    return found


def test_the_wheel_holds_every_file_of_the_package_and_its_data() -> None:
    release = tool("release")
    files = [
        path.relative_to(ROOT).as_posix()
        for folder in release.HOMES
        for path in (ROOT / folder).rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    ]
    expected = release.wheel_files(files)
    assert "envgen_usd/asset_library/roads/straight.xodr" in expected
    assert "envgen_usd/exchange/viewer/page/three.js" in expected
    assert packaged() == expected.keys()


def test_the_changelog_begins_with_the_version() -> None:
    lines = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8").splitlines()
    first = next(line for line in lines if line.startswith("## "))
    assert re.match(rf"## {re.escape(SETTINGS['project']['version'])}\b", first), first


JUDGED = {"name": "numpy", "version": "2.4.6", "vulns": []}
SKIPPED = {"name": "lxml", "skip_reason": "Dependency not found"}
FAULTY = {
    "name": "pillow",
    "version": "9.0",
    "vulns": [{"id": "CVE-1", "fix_versions": ["9.1"]}],
}


@pytest.mark.parametrize(
    ("packages", "code", "said"),
    [
        ([JUDGED], 0, "1 of 1 pinned versions were judged, 0 faults"),
        ([JUDGED, SKIPPED], 2, "does not know them: lxml"),
        ([SKIPPED], 2, "NOT AUDITED.*all of them"),
        ([], 2, "0 of 0"),
        ([JUDGED, SKIPPED, FAULTY], 1, "pillow 9.0: CVE-1, mended in 9.1"),
    ],
)
def test_versions_that_no_service_knows_are_not_called_clean(
    packages: list[dict[str, Any]], code: int, said: str
) -> None:
    given, lines = tool("audit").verdict(packages)
    assert given == code
    assert re.search(said, "\n".join(lines))
