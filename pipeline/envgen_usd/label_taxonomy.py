"""The label taxonomy, read from `schemas/labels.toml`."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib import resources

from envgen_usd.toml_files import read_toml


@dataclass(frozen=True)
class Label:
    """A class of the label images.

    Attributes:
        name: Token in the `class` taxonomy of UsdSemantics.
        id: Value in a semantic image; the KITTI-360 / Cityscapes id.
        colour: RGB of the colour image.
        has_instances: True if the instance image separates the instances.
        cityscapes: Token in the `cityscapes` taxonomy; the name in Cityscapes and KITTI-360.
        cityscapes_id: `id` in cityscapesScripts.
        cityscapes_train_id: `trainId` in cityscapesScripts; 255 is left out in training.
        cityscapes_has_instances: `hasInstances` in cityscapesScripts.
        kitti_360_id: `id` in kitti360Scripts.
        kitti_360_train_id: `trainId` in kitti360Scripts; 255 is left out in training.
        kitti_360_has_instances: `hasInstances` in kitti360Scripts.
        article_id: Id of the seven classes of the article; 255 for void and the finer classes.
        article_train_id: 0 to 6 for the seven classes of the article; 255 for the others.
    """

    name: str
    id: int
    colour: tuple[int, int, int]
    has_instances: bool
    cityscapes: str
    cityscapes_id: int
    cityscapes_train_id: int
    cityscapes_has_instances: bool
    kitti_360_id: int
    kitti_360_train_id: int
    kitti_360_has_instances: bool
    article_id: int
    article_train_id: int


@dataclass(frozen=True)
class _Taxonomy:
    label: tuple[Label, ...]
    parts: Mapping[str, int]


@cache
def labels() -> tuple[Label, ...]:
    """All classes, by id."""
    return tuple(sorted(_table().label, key=lambda row: row.id))


@cache
def label(name: str) -> Label:
    """The class of that name; raises `KeyError` for an unknown name."""
    return {entry.name: entry for entry in labels()}[name]


@cache
def parts() -> dict[str, int]:
    """Values of the part images, by token of the `part` taxonomy; 0 means no part."""
    return dict(_table().parts)


@cache
def _table() -> _Taxonomy:
    return read_toml(resources.files("envgen_usd.schemas") / "labels.toml", _Taxonomy)
