"""The seven classes of the study, and which label values they have in data sets."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

import numpy as np

from envgen_usd.datasets.class_ids import id_table
from envgen_usd.errors import EnvgenError
from envgen_usd.label_taxonomy import labels
from envgen_usd.models.array_types import ByteArray
from envgen_usd.toml_files import read_toml

VOID = 255
"""Class value that neither loss nor score counts."""
UNKNOWN = 254
"""Class value of a label value that a class map does not name; images with it are refused."""
CLASSES = tuple(entry.name for entry in sorted(labels(), key=lambda e: e.article_train_id)[:7])
"""Names of the classes by their value, 0 to 6 (the article's seven)."""
ClassTable: TypeAlias = ByteArray
"""256 values: the class of each label value."""
_GARAGE, _POLE_GROUP, _TRAFFIC_LIGHT_POLE = 34, 18, 37
"""Ids of KITTI-360 that the article counts as building and as pole."""
_CAMVID_MERGED = {"parking": "sidewalk", "wall": "building", "bridge": "building"}
"""CamVid's eleven classes count these with another class; so do frames beside CamVid."""


@dataclass(frozen=True)
class _ClassMap:
    """A class map: values of label images by class.

    Attributes:
        classes: Name of a class of `CLASSES` to its label values.
        void: Values that are not counted; empty: only 255.
    """

    classes: Mapping[str, tuple[int, ...]]
    void: tuple[int, ...] = (VOID,)


def number_table() -> ClassTable:
    """Labels that already are 0 to 6 and 255."""
    table = np.full(256, UNKNOWN, np.uint8)
    table[: len(CLASSES)] = range(len(CLASSES))
    table[VOID] = VOID
    return table


def street_table() -> ClassTable:
    """Ids of Cityscapes and KITTI-360, which our semantic images have, too."""
    table = id_table("article_train_id").copy()
    table[_GARAGE] = CLASSES.index("building")
    table[[_POLE_GROUP, _TRAFFIC_LIGHT_POLE]] = CLASSES.index("pole")
    return table


def camvid_frame_table(*, has_terrain: bool = False) -> ClassTable:
    """Ids of our semantic images, merged as CamVid merges its classes.

    Args:
        has_terrain: True beside images that have a class for grass. CamVid's eleven classes count
            grass with trees.
    """
    table, ids = street_table(), {entry.name: entry.id for entry in labels()}
    for finer, name in _CAMVID_MERGED.items():
        table[ids[finer]] = CLASSES.index(name)
    table[ids["tunnel"]] = CLASSES.index("building")
    if not has_terrain:
        table[table == CLASSES.index("terrain")] = CLASSES.index("vegetation")
    return table


def segnet_table() -> ClassTable:
    """CamVid in the layout of SegNet's tutorial: 12 values; road markings are road."""
    table = np.full(256, UNKNOWN, np.uint8)
    names = ("sky", "building", "pole", "road", "sidewalk", "vegetation")
    table[: len(names)] = [CLASSES.index(name) for name in names]
    table[len(names) : 12] = VOID
    table[VOID] = VOID
    return table


def mapped_table(path: Path) -> ClassTable:
    """The table of a class map.

    Args:
        path: TOML file with a table ``classes`` (name of a class = list of label values) and a list
            ``void``.

    Raises:
        EnvgenError: The file cannot be read, names an unknown class, or a value twice.
    """
    content = read_toml(path, _ClassMap)
    unknown = [name for name in content.classes if name not in CLASSES]
    if unknown:
        raise EnvgenError(
            f"{path}: classes: unknown class {', '.join(unknown)}; known: {', '.join(CLASSES)}"
        )
    table = np.full(256, UNKNOWN, np.uint8)
    rows = [(CLASSES.index(name), values) for name, values in content.classes.items()]
    for number, values in [*rows, (VOID, content.void)]:
        for value in values:
            if not 0 <= value < len(table):
                raise EnvgenError(f"{path}: label value {value} is not from 0 to 255")
            if table[value] != UNKNOWN:
                raise EnvgenError(f"{path}: label value {value} stands twice; leave one out")
            table[value] = number
    return table
