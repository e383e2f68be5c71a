"""Products of regions in files that other processes may read: arrays and JSON, and no code.

A file holds values of the classes in `_CLASSES`, whoever wrote it. So a folder from elsewhere can
do no more than be refused.
"""

import json
import math
import zipfile
import zlib
from collections.abc import Mapping, Sequence
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
from envgen_usd.landuse.roadside import Roadside
from envgen_usd.models.ground import HeightMap, Water
from envgen_usd.models.landuse import LanduseClass, LanduseMap, Plot
from envgen_usd.models.road_objects import Origin
from envgen_usd.models.road_piece import RoadPiece
from envgen_usd.models.road_surface import JunctionSite, LaneLine, Patch, RoadLine, RoadSurface
from envgen_usd.terrain.height_lattice import Extent, Lattice
from envgen_usd.whole_files import make_folder, whole_file

_MODELS = (
    *(Chunk, Extent, HeightMap, Issue, JunctionSite, LandLayout, LaneLine, LanduseMap, Lattice),
    *(Origin, Patch, Plot, RoadLine, RoadPiece, Roadside, RoadSurface, Water),
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
        pools = _Pools()
        tree = json.dumps(_encoded(product, pools)).encode()
        named: dict[str, Any] = pools.joined()
        with whole_file(self._folder / _name(stage, region)) as part, part.open("wb") as file:
            np.savez_compressed(file, np.frombuffer(tree, np.uint8), allow_pickle=False, **named)


def _name(stage: str, region: str) -> str:
    return f"{stage}_{region}.npz"


class _Pools:
    """Arrays of a product, one after another, in one array for each type of numbers.

    A product has thousands of small arrays, and a file of each would take longer than its content.
    """

    def __init__(self) -> None:
        self._parts: dict[str, list[np.ndarray]] = {}
        self._sizes: dict[str, int] = {}

    def add(self, array: np.ndarray) -> list[Any]:
        """Keeps an array; returns JSON that finds it: type, place of its first number, shape."""
        kind = array.dtype.str
        place = self._sizes.get(kind, 0)
        self._parts.setdefault(kind, []).append(array.ravel())
        self._sizes[kind] = place + array.size
        return [kind, place, list(array.shape)]

    def joined(self) -> dict[str, np.ndarray]:
        """The arrays by type."""
        return {kind: np.concatenate(parts) for kind, parts in self._parts.items()}


def _read(path: Path) -> Any:  # noqa: ANN401 - whatever was written
    with np.load(path, allow_pickle=False) as file:
        tree = json.loads(file[_TREE].tobytes())
        pools = {name: file[name] for name in file.files if name != _TREE}
    return _decoded(tree, pools)


def _encoded(value: object, pools: _Pools) -> Any:  # noqa: ANN401 - JSON
    """A value as JSON that refers to arrays by type and place."""
    if isinstance(value, Enum):
        return {"enum": type(value).__name__, "value": value.value}
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, np.ndarray):
        if value.dtype != object:
            return {"array": pools.add(value)}
        texts = shapely.to_wkb(value) if len(value) else []
        sizes = np.array([len(text) for text in texts], np.int64)
        content = np.frombuffer(b"".join(texts), np.uint8)
        return {"shapes": [pools.add(content), pools.add(sizes)]}
    if isinstance(value, Sequence):
        return {"tuple": [_encoded(each, pools) for each in value]}
    if is_dataclass(value) and type(value).__name__ in _CLASSES:
        parts = {f.name: _encoded(getattr(value, f.name), pools) for f in fields(value)}
        return {"model": type(value).__name__, "fields": parts}
    raise TypeError(f"{type(value).__name__} is no product of a region")


def _array(place: Any, pools: Mapping[str, np.ndarray]) -> np.ndarray:  # noqa: ANN401 - JSON
    """An array of its own: a view would keep the whole product for the part that is wanted."""
    kind, first, shape = place
    return pools[kind][first : first + math.prod(shape)].reshape(shape).copy()


def _decoded(tree: Any, pools: Mapping[str, np.ndarray]) -> Any:  # noqa: ANN401 - JSON
    """The value that `_encoded` made JSON of."""
    if not isinstance(tree, dict):
        return tree
    if "array" in tree:
        return _array(tree["array"], pools)
    if "shapes" in tree:
        content, sizes = (_array(place, pools) for place in tree["shapes"])
        ends = np.cumsum(sizes).tolist()
        whole = content.tobytes()
        texts = [whole[end - size : end] for end, size in zip(ends, sizes.tolist(), strict=True)]
        return np.array(shapely.from_wkb(np.array(texts, object)), object) if texts else _none()
    if "tuple" in tree:
        return tuple(_decoded(each, pools) for each in tree["tuple"])
    if "enum" in tree:
        return _ENUMS[tree["enum"]](tree["value"])
    parts = {name: _decoded(each, pools) for name, each in tree["fields"].items()}
    return _CLASSES[tree["model"]](**parts)


def _none() -> np.ndarray:
    return np.empty(0, object)
