"""Products of regions in files that other processes may read: arrays and JSON, and no code.

A file holds values of the classes in `_CLASSES`, whoever wrote it. So a folder from elsewhere can
do no more than be refused.
"""

import json
import zipfile
import zlib
from collections.abc import Callable, Sequence
from dataclasses import fields, is_dataclass
from enum import Enum
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import shapely

from envgen_usd.chunks import Chunk
from envgen_usd.errors import Issue, Severity
from envgen_usd.landuse.land_layout import LandLayout
from envgen_usd.models.ground import HeightMap, Water
from envgen_usd.models.landuse import LanduseClass, LanduseMap, Plot
from envgen_usd.models.road_surface import LaneLine, RoadLine, RoadSurface
from envgen_usd.terrain.height_lattice import Extent, Lattice
from envgen_usd.whole_files import make_folder, whole_file

_MODELS = (
    *(Chunk, Extent, HeightMap, Issue, LandLayout, LaneLine, LanduseMap, Lattice, Plot),
    *(RoadLine, RoadSurface, Water),
)
_CLASSES: dict[str, type[Any]] = {kind.__name__: kind for kind in _MODELS}
_ENUMS: dict[str, type[Enum]] = {kind.__name__: kind for kind in (LanduseClass, Severity)}
_DAMAGE = (
    *(AttributeError, EOFError, KeyError, OSError, TypeError, ValueError),
    *(shapely.errors.GEOSException, zipfile.BadZipFile, zlib.error),
)
"""What reading a damaged file raises."""
_TREE = "arr_0"
"""Name that NumPy gives to the array without one: the JSON."""
_KEPT = 9
"""Products that a process keeps in memory: those around a region. Larger ones are read anew."""
_SMALL = frozenset(("layout", "plots"))
"""Stages whose products are kept in memory."""


class ProductStore:
    """A folder with a file for each product of a region, shared by all processes of a build."""

    def __init__(self, folder: Path) -> None:
        """Takes a folder, which need not exist."""
        self._folder = folder
        self._read = lru_cache(_KEPT)(lambda name: _read(folder / name))

    def has(self, stage: str, region: str) -> bool:
        """Tells whether a product is there; a damaged one is not."""
        if not (self._folder / _name(stage, region)).exists():
            return False
        try:
            self.read(stage, region)
        except _DAMAGE:
            return False
        return True

    def read(self, stage: str, region: str) -> Any:  # noqa: ANN401 - whatever the stage makes
        """Returns a product."""
        name = _name(stage, region)
        return self._read(name) if stage in _SMALL else _read(self._folder / name)

    def write(self, stage: str, region: str, product: object) -> None:
        """Writes a product whole or not at all."""
        make_folder(self._folder)
        arrays: list[np.ndarray] = []
        tree = json.dumps(_encoded(product, arrays)).encode()
        named: dict[str, Any] = {f"a{number}": array for number, array in enumerate(arrays)}
        with whole_file(self._folder / _name(stage, region)) as part, part.open("wb") as file:
            np.savez_compressed(file, np.frombuffer(tree, np.uint8), allow_pickle=False, **named)


def _name(stage: str, region: str) -> str:
    return f"{stage}_{region}.npz"


def _read(path: Path) -> Any:  # noqa: ANN401 - whatever was written
    with np.load(path, allow_pickle=False) as file:
        tree = json.loads(file[_TREE].tobytes())
        return _decoded(tree, lambda number: file[f"a{number}"])


def _encoded(value: object, arrays: list[np.ndarray]) -> Any:  # noqa: ANN401 - JSON
    """A value as JSON that refers to arrays by number."""
    if isinstance(value, Enum):
        return {"enum": type(value).__name__, "value": value.value}
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, np.ndarray):
        if value.dtype != object:
            return {"array": _added(arrays, value)}
        texts = shapely.to_wkb(value) if len(value) else []
        sizes = np.array([len(text) for text in texts], np.int64)
        content = np.frombuffer(b"".join(texts), np.uint8)
        return {"shapes": [_added(arrays, content), _added(arrays, sizes)]}
    if isinstance(value, Sequence):
        return {"tuple": [_encoded(each, arrays) for each in value]}
    if is_dataclass(value) and type(value).__name__ in _CLASSES:
        parts = {f.name: _encoded(getattr(value, f.name), arrays) for f in fields(value)}
        return {"model": type(value).__name__, "fields": parts}
    raise TypeError(f"{type(value).__name__} is no product of a region")


def _added(arrays: list[np.ndarray], array: np.ndarray) -> int:
    arrays.append(array)
    return len(arrays) - 1


def _decoded(tree: Any, array: Callable[[int], np.ndarray]) -> Any:  # noqa: ANN401 - JSON
    """The value that `_encoded` made JSON of."""
    if not isinstance(tree, dict):
        return tree
    if "array" in tree:
        return array(tree["array"])
    if "shapes" in tree:
        content, sizes = (array(number) for number in tree["shapes"])
        ends = np.cumsum(sizes).tolist()
        whole = content.tobytes()
        texts = [whole[end - size : end] for end, size in zip(ends, sizes.tolist(), strict=True)]
        return np.array(shapely.from_wkb(np.array(texts, object)), object) if texts else _none()
    if "tuple" in tree:
        return tuple(_decoded(each, array) for each in tree["tuple"])
    if "enum" in tree:
        return _ENUMS[tree["enum"]](tree["value"])
    parts = {name: _decoded(each, array) for name, each in tree["fields"].items()}
    return _CLASSES[tree["model"]](**parts)


def _none() -> np.ndarray:
    return np.empty(0, object)
