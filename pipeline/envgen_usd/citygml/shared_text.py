"""Text fragments that all versions of CityGML share."""

import re
from collections.abc import Mapping
from xml.sax.saxutils import escape, quoteattr

from envgen_usd.citygml.generic_attributes import xml_text
from envgen_usd.citygml.gml_geometry_text import GeometryText
from envgen_usd.citygml.implicit_pose import rotation
from envgen_usd.errors import EnvgenError
from envgen_usd.models.attribute_values import Attribute
from envgen_usd.models.city_model import CityObject, Placement

_NAMES = ("description", "name")
_NCNAME = re.compile(r"[^\W\d][\w.\-·]*")


def start_tag(prefix: str, name: str, gml_id: str) -> tuple[str, str]:
    """Returns the start tag and the end tag of a feature; elements of the core have no prefix.

    Raises:
        EnvgenError: The id is not an NCName.
    """
    if not _NCNAME.fullmatch(gml_id):
        raise EnvgenError(f"'{gml_id}' cannot be the gml:id of a {name}: it is not an NCName")
    tag = name if prefix == "core" else f"{prefix}:{name}"
    return f'<{tag} gml:id="{gml_id}">', f"</{tag}>"


def is_name(name: str, value: Attribute) -> bool:
    """True for an attribute that is a ``gml:description`` or ``gml:name``, or several names."""
    several = isinstance(value, tuple) and len(value) > 1
    texts = value if isinstance(value, tuple) and several and name == "name" else (value,)
    return name in _NAMES and all(isinstance(text, str) for text in texts)


def names_text(attributes: Mapping[str, Attribute]) -> str:
    """Returns the ``gml:description`` and ``gml:name`` elements of the attributes."""
    return "".join(
        f"<gml:{name}>{xml_text(str(text))}</gml:{name}>"
        for name in _NAMES
        if name in attributes and is_name(name, value := attributes[name])
        for text in (value if isinstance(value, tuple) else (value,))
    )


def shell_ids(feature: CityObject) -> list[str]:
    """Returns the ids of the polygons that form the solid of a feature."""
    return [
        f"{surface.id}.{p}"
        for wall in feature.surfaces
        for surface in (wall, *wall.openings)
        if surface.lod == feature.solid_lod
        for p in range(len(surface.polygons))
    ]


def href(target: str) -> str:
    """Returns the attribute that references a feature of this file, or of another."""
    return f"xlink:href={quoteattr(target if '#' in target else f'#{target}')}"


def implicit_text(placement: Placement, geometry: GeometryText) -> str:
    """Returns ``ImplicitGeometry``: the pose of a template."""
    rows = rotation(placement.heading, placement.pitch, placement.roll).tolist()
    matrix = " ".join(f"{row[0]!r} {row[1]!r} {row[2]!r} 0" for row in rows)
    return (
        f"<ImplicitGeometry><transformationMatrix>{matrix} 0 0 0 1</transformationMatrix>"
        f"<libraryObject>{escape(placement.template)}</libraryObject>"
        f"<referencePoint>{geometry.position(placement.position)}</referencePoint>"
        "</ImplicitGeometry>"
    )
