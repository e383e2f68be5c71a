"""The layout, held against DESIGN: packaging lists every folder, imports go one way."""

import ast
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "pipeline" / "envgen_usd"
LAYERS = {
    "opendrive",
    "terrain",
    "landuse",
    "city",
    "citygml",
    "cityjson",
    "layers",
    "render",
    "assets",
}
ONLY_UNDER = {
    "torch": {"landuse"},
    "pyrender": {"render"},
    "OpenGL": {"render"},
    "pxr": {"layers", "assets", "render"},
}
ALLOWED = {("layers", "assets"), ("render", "assets")}
COMMON = {
    "__init__",
    "chunks",
    "clock",
    "config",
    "errors",
    "labels",
    "manifest",
    "printing",
    "profiles",
    "report",
    "seeds",
}
"""Modules at the top that join no layers; layers may import these and no others."""
MODULES = sorted(PACKAGE.rglob("*.py"))


def imported(path: Path) -> set[str]:
    """Names of the modules that a file imports, wherever in it."""
    names: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            names.add(node.module)
    return names


@pytest.mark.parametrize("path", MODULES, ids=lambda p: str(p.relative_to(PACKAGE)))
def test_imports_go_one_way(path: Path) -> None:
    place = path.relative_to(PACKAGE).parts
    home = place[0] if len(place) > 1 else ""
    for name in imported(path):
        root = name.split(".")[0]
        if root in ONLY_UNDER:
            assert home in ONLY_UNDER[root], f"{name} may only be imported under {ONLY_UNDER[root]}"
        if root != "envgen_usd":
            continue
        target = name.split(".")[1] if "." in name else ""
        if home in {"models", "geometry"}:
            assert target not in LAYERS, f"{home} may not import the layer {target}"
        elif home in LAYERS and target in LAYERS and target != home:
            assert (home, target) in ALLOWED, f"layer {home} imports layer {target}"
        elif home in LAYERS and target:
            assert target in LAYERS | COMMON | {"models", "geometry"}, f"{home} imports {target}"
        elif not home and path.stem in COMMON:
            assert target not in LAYERS, f"{path.name} is below the layers"


def test_the_packaging_lists_every_package() -> None:
    config = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    listed = set(config["tool"]["setuptools"]["packages"])
    found = {
        ".".join(("envgen_usd", *init.parent.relative_to(PACKAGE).parts))
        for init in PACKAGE.rglob("__init__.py")
    }
    mapped = {name for name in config["tool"]["setuptools"]["package-dir"] if name}
    assert listed == found | mapped


def test_data_folders_hold_no_code_but_a_docstring() -> None:
    for folder in ("asset_library", "schemas", "renders"):
        for path in (ROOT / folder).rglob("*.py"):
            body = ast.parse(path.read_text(encoding="utf-8")).body
            assert len(body) == 1
            assert isinstance(body[0], ast.Expr)
