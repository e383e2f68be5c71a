"""Signs that follow from streets, in the catalogue of the environment's country."""

from collections.abc import Mapping
from dataclasses import replace

from lxml import etree

from envgen_usd.streets.island_objects import ISLAND_SIGN, KEEP_RIGHT
from envgen_usd.streets.mapped_furniture import PRIORITY_SIGN
from envgen_usd.streets.mapped_roads import MappedRoads

_CATALOGUES: Mapping[str, tuple[str, Mapping[str, str]]] = {
    "2": ("US", {"205": "r1-2", "206": "r1-1", KEEP_RIGHT: "r4-7"})
}
"""Country of the signs, and their code by the German one, for each country of an environment; the
others have the German ones. Source: MUTCD, sections 2B.05, 2B.08 and 2B.32."""


def with_national_signs(roads: MappedRoads, country: str) -> MappedRoads:
    """Roads whose signs at junctions and on islands are those of a country.

    Signs with a code of the map stay: they say what stands there.

    Args:
        roads: The roads of a map.
        country: Country of the environment.
    """
    if country not in _CATALOGUES:
        return roads
    name, codes = _CATALOGUES[country]
    root = etree.fromstring(roads.xml)
    for sign in root.iterfind("road/signals/signal"):
        code = codes.get(sign.get("type", ""))
        if code and sign.get("id", "").startswith((PRIORITY_SIGN, ISLAND_SIGN)):
            sign.set("country", name)
            sign.set("type", code)
            sign.set("name", f"sign {code}")
    xml = etree.tostring(root, xml_declaration=True, encoding="UTF-8", pretty_print=True)
    return replace(roads, xml=xml)
