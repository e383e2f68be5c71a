"""Implicit geometry of other programs: templates and their placement."""

from dataclasses import replace

import numpy as np
from lxml import etree

from envgen_usd.chunks import snap
from envgen_usd.citygml.gml_geometry_read import GeometryReader
from envgen_usd.geometry.flat_arrays import join, turned
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.city_model import CONSTRUCTIONS
from envgen_usd.models.polygon_arrays import Polygons
from envgen_usd.xml_events import local_name

_RELATIVE = ("relativeGMLGeometry", "relativeGeometry")
_BY_CLASS = {"SolitaryVegetationObject": "tree"}


def place_templates(feature: etree._Element) -> None:
    """Gives features with implicit geometry a template name and a size, in place.

    The size is that of the relative geometry, scaled by the transformation. It becomes generic
    attributes, as in our files. A template file keeps its name; trees become ``tree``.
    Constructions keep their relative geometry, see `placed_shape`.

    Args:
        feature: Top-level feature with resolved references.
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
    """Returns the relative geometry of a template at its placement; empty without geometry.

    Follows CityGML 3.0 (20-010, 7.2.4): the transformation matrix multiplies the template's
    coordinates, and the reference point is added. Faces of mirrored templates are reversed.

    Args:
        implicit: An ``ImplicitGeometry``, or the element around it.
        reference_point: 3, metres, in the target frame.

    Raises:
        ValueError: The matrix does not have 16 numbers.
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
    """Extent along the template's axes, 3, metres; zero if unknown."""
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
