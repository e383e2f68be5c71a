"""The label taxonomy: one table, `schemas/labels.toml`."""

import tomllib
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Any


@dataclass(frozen=True)
class Label:
    """One class of the label images.

    Attributes:
        name: Token in the `class` taxonomy of UsdSemantics.
        id: Value in a semantic image; the KITTI-360 / Cityscapes id.
        train_id: 0 to 6 for the seven classes of the article, 255 for void and the finer ones.
        colour: RGB of the colour image.
        has_instances: True if instances are told apart in the instance image.
        cityscapes: Token in the `cityscapes` taxonomy.
    """

    name: str
    id: int
    train_id: int
    colour: tuple[int, int, int]
    has_instances: bool
    cityscapes: str


@cache
def labels() -> tuple[Label, ...]:
    """All classes, by id."""
    rows = [Label(**{**row, "colour": tuple(row["colour"])}) for row in _table()["label"]]
    return tuple(sorted(rows, key=lambda row: row.id))


@cache
def label(name: str) -> Label:
    """The class of that name; KeyError if there is none."""
    return {entry.name: entry for entry in labels()}[name]


@cache
def parts() -> dict[str, int]:
    """Values of the part images, by token of the `part` taxonomy; 0 is no part."""
    return {str(name): int(number) for name, number in _table()["parts"].items()}


@cache
def _table() -> dict[str, Any]:
    text = (resources.files("envgen_usd.schemas") / "labels.toml").read_text(encoding="utf-8")
    return tomllib.loads(text)
