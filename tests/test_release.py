"""A wheel is made, installed beside the libraries that are here, and builds the demo.

`make release` does the same with an empty environment and an index.
"""

import importlib.util
import os
import re
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from PIL import Image

ROOT = Path(__file__).resolve().parents[1]
SETTINGS = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))


def tool(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, ROOT / "tools" / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def release() -> ModuleType:
    if not (ROOT / ".git").exists():
        pytest.skip("no git here that knows the files of the repository")
    return tool("release")


@pytest.mark.long
def test_an_installed_wheel_builds_the_demo_without_the_repository(
    release: ModuleType, tmp_path: Path
) -> None:
    files = release.files_of_folder()
    archive, wheel = release.made(files, tmp_path, "--no-isolation")
    assert release.differences(wheel, files) == []
    with tarfile.open(archive) as packed:
        archived = {name.partition("/")[2] for name in packed.getnames()}
    assert {path for path in files if path[0] != "."} <= archived

    empty, programs = tmp_path / "empty", release.environment_with_libraries(tmp_path / "env")
    empty.mkdir()
    python, variables = str(programs / "python"), release.alone()
    look = (python, "-c", "import numpy, importlib.util as u; print(u.find_spec('envgen_usd'))")
    assert printed(look, empty, variables) == "None"
    install = ("install", "--quiet", "--no-index", "--no-deps", "--ignore-installed", str(wheel))
    release.run((sys.executable, "-m", "pip", "--python", python, *install), empty)
    assert str(tmp_path / "env") in printed(look, empty, variables)

    for arguments in release.demo("agricultural", "--no-pictures", "--workers", "1"):
        release.run((str(programs / "envgen-usd"), *arguments), empty, variables)
    town = empty / "town"
    made = ("stage.usda", "city.gml", "manifest.json", "report.html", "chunks/0_0/roads.usdc")
    assert [name for name in made if not (town / name).is_file()] == []
    (colour,) = (town / "frames" / "rgb").iterdir()
    # A frame without its shaders or its textures would be of a single colour.
    assert len(np.unique(np.asarray(Image.open(colour)).reshape(-1, 3), axis=0)) > 1000
    repository = os.fsencode(ROOT)
    assert [path for path in files_below(town) if repository in path.read_bytes()] == []


def printed(command: tuple[str, ...], folder: Path, variables: dict[str, str]) -> str:
    """What a program prints."""
    done = subprocess.run(
        command, cwd=folder, env=variables, check=True, capture_output=True, text=True
    )
    return done.stdout.strip()


def files_below(folder: Path) -> list[Path]:
    return [path for path in folder.rglob("*") if path.is_file()]


def test_files_that_a_wheel_lacks_or_has_too_many_are_named(
    release: ModuleType, tmp_path: Path
) -> None:
    wheel = tmp_path / "some.whl"
    with zipfile.ZipFile(wheel, "w") as packed:
        for name in ("envgen_usd/chunks.py", "envgen_usd/notes.txt", "a.dist-info/RECORD"):
            packed.writestr(name, "")
    files = ["pipeline/envgen_usd/chunks.py", "renders/shaders/wear.glsl", "docs/api.md"]
    assert release.differences(wheel, files) == [
        "missing: renders/shaders/wear.glsl",
        "not of the repository: envgen_usd/notes.txt",
    ]


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
