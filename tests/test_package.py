"""The layout, held against DESIGN: packaging lists every folder, imports go one way."""

import ast
import graphlib
import tomllib
from collections import Counter, defaultdict
from collections.abc import Mapping
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "pipeline" / "envgen_usd"
LAYERS = {
    "opendrive",
    "terrain",
    "traffic",
    "landuse",
    "city",
    "citygml",
    "cityjson",
    "layers",
    "render",
    "assets",
    "exchange",
    "datasets",
    "places",
    "streets",
    "study",
}
ONLY_UNDER = {
    "torch": {"landuse", "datasets", "study"},
    "pyrender": {"render/opengl"},
    "OpenGL": {"render/opengl", "render/lighting", "render/drawing"},
    "pxr": {"layers", "assets", "render/stage", "render/frames", "exchange"},
    "mitsuba": {"render/path_tracing"},
    "embreex": {"render/lidar"},
}
"""Library to the only folders that import it."""
ALLOWED = {
    ("layers", "assets"),
    ("render", "assets"),
    ("exchange", "layers"),
    ("exchange", "render"),
    ("datasets", "render"),
    ("study", "datasets"),
}
ABOVE = {"commands": 2, "recipe": 1}
"""Folders above the layers: commands call recipes, recipes join layers."""
REPEATED = {"__init__", "read", "write"}
"""Names that several modules may have."""
CITY_MODEL = "envgen_usd.models.city_model"
KNOW_NO_CITY = {"opendrive", "terrain", "landuse"}
"""Layers of the road and the land; which CityGML feature stands for what is for `city` to say."""
MODULES = sorted(PACKAGE.rglob("*.py"))


@cache
def imported(path: Path) -> frozenset[str]:
    """Names of the modules that a file imports, wherever in it; three tests ask for them."""
    names: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            names.add(node.module)
    return frozenset(names)


@pytest.mark.parametrize("path", MODULES, ids=lambda p: str(p.relative_to(PACKAGE)))
def test_imports_go_one_way(path: Path) -> None:
    place = path.relative_to(PACKAGE).parts
    home = place[0] if len(place) > 1 else ""
    for name in imported(path):
        root = name.split(".")[0]
        if root in ONLY_UNDER:
            folders = ONLY_UNDER[root]
            inside = any(path.is_relative_to(PACKAGE / folder) for folder in folders)
            assert inside, f"{name} may only be imported under {folders}"
        if root != "envgen_usd":
            continue
        target = name.split(".")[1] if "." in name else ""
        if place in {("__init__.py",), ("__main__.py",)} or home == target:
            continue
        if home in ABOVE:
            assert ABOVE[home] > ABOVE.get(target, 0), f"{home} imports {target}"
        elif home in LAYERS:
            assert target not in ABOVE, f"layer {home} imports {target}"
            assert target not in LAYERS or (home, target) in ALLOWED, f"{home} imports {target}"
        else:
            assert target not in LAYERS | set(ABOVE), f"{home or path.stem} imports {target}"


@pytest.mark.parametrize("layer", sorted(LAYERS | {"landuse/network"}))
def test_rooms_of_a_layer_import_one_another_in_one_direction(layer: str) -> None:
    folder = PACKAGE / layer
    graph: dict[str, set[str]] = defaultdict(set)
    for path in folder.rglob("*.py"):
        room = path.relative_to(folder).with_suffix("").parts[0]
        for name in imported(path):
            parts = Path(*name.split(".")[1:])
            if parts.is_relative_to(layer) and parts != Path(layer):
                graph[room].add(parts.relative_to(layer).parts[0])
    for room, targets in graph.items():
        targets.discard(room)
    graphlib.TopologicalSorter(graph).prepare()  # Raises CycleError where rooms form a circle.


def test_a_name_of_a_module_stands_once_in_the_package() -> None:
    counts = Counter(path.stem for path in MODULES)
    assert {name for name, count in counts.items() if count > 1} <= REPEATED


def module_at(path: Path) -> str:
    parts = path.relative_to(PACKAGE.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def reached_from(start: str, imports: Mapping[str, frozenset[str]]) -> set[str]:
    """Modules of the package that a module imports, itself or through others."""
    found, ahead = {start}, [start]
    while ahead:
        new = (imports[ahead.pop()] & imports.keys()) - found
        found |= new
        ahead += new
    return found


def test_roads_and_land_know_no_city_model() -> None:
    imports = {module_at(path): imported(path) for path in MODULES}
    assert CITY_MODEL in imports
    for name in imports:
        if set(name.split(".")[1:2]) & KNOW_NO_CITY:
            assert CITY_MODEL not in reached_from(name, imports), name


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
