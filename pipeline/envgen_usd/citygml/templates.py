"""Implicit geometry of other programs: what the template is, and how it stands there."""

from dataclasses import replace

import numpy as np
from lxml import etree

from envgen_usd.chunks import snap
from envgen_usd.citygml.geometry_read import GeometryReader, local_name
from envgen_usd.geometry.collections import join, turned
from envgen_usd.models.arrays import FloatArray
from envgen_usd.models.city import CONSTRUCTIONS
from envgen_usd.models.polygons import Polygons

_RELATIVE = ("relativeGMLGeometry", "relativeGeometry")
_BY_CLASS = {"SolitaryVegetationObject": "tree"}


def place_templates(feature: etree._Element) -> None:
    """Gives features with implicit geometry the name of a template and its size, in place.

    The size is that of the relative geometry, scaled by the transformation; it becomes generic
    attributes as our own files have them. Features whose template is a file keep its name; trees
    are ``tree``. Constructions keep their relative geometry, see `placed_shape`.

    Args:
        feature: Top-level feature, with references put in place.
    """
    for implicit in list(feature.iter("{*}ImplicitGeometry")):
        holder = implicit.getparent()
        space = None if holder is None else holder.getparent()
        if space is None or (_is_shaped(space) and _relatives(implicit)):
            continue
        _name(implicit, _BY_CLASS.get(local_name(space), ""))
        relatives = _relatives(implicit)
        if relatives:
            for axis, extent in zip("xyz", _size(implicit, relatives), strict=True):
                _attribute(space, f"placement_size_{axis}", float(extent))
        for relative in relatives:
            implicit.remove(relative)


def placed_shape(implicit: etree._Element, reference_point: FloatArray) -> Polygons:
    """Returns the relative geometry of a template where it stands; empty where there is none.

    As CityGML 3.0 (20-010, 7.2.4) has it: coordinates of the template are multiplied by the
    transformation matrix, and the reference point is added. Mirrored faces are turned.

    Args:
        implicit: An ``ImplicitGeometry`` or what is around one.
        reference_point: 3, metres, in the frame that the shape is wanted in.

    Raises:
        ValueError: The matrix has not 16 numbers.
    """
    local = GeometryReader(np.zeros(3))
    shapes = [local.polygons(each) for name in _RELATIVE for each in implicit.iter(f"{{*}}{name}")]
    shape = join(shapes)
    text = next((each.text or "" for each in implicit.iter("{*}transformationMatrix")), "")
    matrix = np.array(text.split() or np.eye(4).ravel(), dtype=np.float64).reshape(4, 4)
    points = snap(shape.points @ matrix[:3, :3].T + matrix[:3, 3] + reference_point)
    placed = replace(shape, points=points)
    return turned(placed) if np.linalg.det(matrix[:3, :3]) < 0 else placed


def _is_shaped(space: etree._Element) -> bool:
    return local_name(space) in CONSTRUCTIONS


def _relatives(implicit: etree._Element) -> list[etree._Element]:
    return [child for child in implicit if local_name(child) in _RELATIVE]


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
