"""Implicit geometry of other programs: what the template is, and how large it stands there."""

import numpy as np
from lxml import etree

from envgen_usd.citygml.geometry_read import local_name
from envgen_usd.models.arrays import FloatArray

_RELATIVE = ("relativeGMLGeometry", "relativeGeometry")
_BY_CLASS = {"SolitaryVegetationObject": "tree"}


def place_templates(feature: etree._Element) -> None:
    """Gives features with implicit geometry the name of a template and its size, in place.

    The size is that of the relative geometry, scaled by the transformation; it becomes generic
    attributes as our own files have them. Features whose template is a file keep its name; trees
    are ``tree``.

    Args:
        feature: Top-level feature, with references put in place.
    """
    for implicit in list(feature.iter("{*}ImplicitGeometry")):
        holder = implicit.getparent()
        space = None if holder is None else holder.getparent()
        if space is None:
            continue
        _name(implicit, _BY_CLASS.get(local_name(space), ""))
        relatives = [child for child in implicit if local_name(child) in _RELATIVE]
        if relatives:
            for axis, extent in zip("xyz", _size(implicit, relatives), strict=True):
                _attribute(space, f"placement_size_{axis}", float(extent))
        for relative in relatives:
            implicit.remove(relative)


def _name(implicit: etree._Element, name: str) -> None:
    library = implicit.find("{*}libraryObject")
    if library is None:
        library = etree.SubElement(implicit, "libraryObject")
    library.text = name or library.text or ""


def _size(implicit: etree._Element, relatives: list[etree._Element]) -> FloatArray:
    """Extent along the template's axes, 3, metres; zero where it is not known."""
    numbers = [
        float(number)
        for relative in relatives
        for positions in relative.iter("{*}posList", "{*}pos")
        for number in (positions.text or "").split()
    ]
    extent: FloatArray = np.zeros(3)
    if len(numbers) >= 3 and len(numbers) % 3 == 0:
        points = np.array(numbers).reshape(-1, 3)
        extent = (points.max(axis=0) - points.min(axis=0)) * _scale(implicit)
    return extent


def _scale(implicit: etree._Element) -> FloatArray:
    matrix = implicit.findtext("{*}transformationMatrix")
    if matrix is None or len(matrix.split()) != 16:
        return np.ones(3)
    rows = np.array(matrix.split(), dtype=np.float64).reshape(4, 4)
    scale: FloatArray = np.linalg.norm(rows[:3, :3], axis=0)
    return scale


def _attribute(space: etree._Element, name: str, value: float) -> None:
    attribute = etree.SubElement(space, "genericAttribute")
    number = etree.SubElement(attribute, "DoubleAttribute")
    etree.SubElement(number, "name").text = name
    etree.SubElement(number, "value").text = repr(value)
