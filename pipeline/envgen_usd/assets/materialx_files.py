"""Materials with texture bombing as MaterialX documents, for tools that read these.

They stay beside the stage: usd-core knows no node of MaterialX, and its validators refuse a
Material that names one.
"""

from xml.etree import ElementTree as ET

from envgen_usd.assets.material_layers import MaterialLook

VERSION = "1.39"


def has_materialx(look: MaterialLook) -> bool:
    """True for materials that `hextiledimage` can show: it divides bricks, and has no opacity."""
    pattern = look.pattern
    return bool(look.texture) and pattern.patch > 0.0 and not any(pattern.unit)


def materialx_document(look: MaterialLook, textures: str) -> str:
    """The MaterialX document of a material, with a ``surfacematerial`` of its name.

    Args:
        look: A material with `has_materialx`.
        textures: Relative path from the document to the folder of textures.
    """
    root = ET.Element("materialx", version=VERSION, colorspace="lin_rec709")
    place = ET.SubElement(root, "geompropvalue", name="st", type="vector2")
    _value(place, "geomprop", "string", "st")
    colour = _bombed(root, "hextiledimage", "colour", "color3", look)
    file = _value(colour, "file", "filename", f"{textures}/{look.texture}_colour.jpg")
    file.set("colorspace", "srgb_texture")
    surface = ET.Element("standard_surface", name="surface", type="surfaceshader")
    _value(surface, "base", "float", "1")
    _link(surface, "base_color", "color3", "colour")
    _value(surface, "specular_roughness", "float", f"{look.roughness:g}")
    if "normal" in look.maps:
        normal = _bombed(root, "hextilednormalmap", "normal", "vector3", look)
        _value(normal, "file", "filename", f"{textures}/{look.relief}_normal.jpg")
        _link(surface, "normal", "vector3", "normal")
    root.append(surface)
    material = ET.SubElement(root, "surfacematerial", name=look.name, type="material")
    _link(material, "surfaceshader", "surfaceshader", "surface")
    ET.indent(root)
    return '<?xml version="1.0"?>\n' + ET.tostring(root, encoding="unicode") + "\n"


def _bombed(root: ET.Element, node: str, name: str, kind: str, look: MaterialLook) -> ET.Element:
    """A node that bombs an image; its patches turn as far as ours and keep their size."""
    element = ET.SubElement(root, node, name=name, type=kind)
    _link(element, "texcoord", "vector2", "st")
    turn = look.pattern.turn
    _value(element, "rotationrange", "vector2", f"{-turn:g}, {turn:g}")
    _value(element, "scalerange", "vector2", "1, 1")
    return element


def _value(element: ET.Element, name: str, kind: str, value: str) -> ET.Element:
    return ET.SubElement(element, "input", name=name, type=kind, value=value)


def _link(element: ET.Element, name: str, kind: str, node: str) -> None:
    ET.SubElement(element, "input", name=name, type=kind, nodename=node)
