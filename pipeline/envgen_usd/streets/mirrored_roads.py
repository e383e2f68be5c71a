"""The mirror image of a map's road file: traffic on the left instead of the right."""

from dataclasses import replace

from lxml import etree

from envgen_usd.geometry.mirrored_opendrive import mirror_document, mirrored_points
from envgen_usd.streets.island_objects import ISLAND_SIGN, KEEP_LEFT, KEEP_RIGHT
from envgen_usd.streets.mapped_roads import MappedRoads


def mirrored_roads(roads: MappedRoads) -> MappedRoads:
    """Roads with east and west swapped, as `mapped_roads` writes them, for traffic on the left."""
    root = etree.fromstring(roads.xml)
    mirror_document(root)
    for sign in root.iterfind(f"road/signals/signal[@type='{KEEP_RIGHT}']"):
        # Signs of the map say what stands there; those on islands follow the traffic.
        if sign.get("id", "").startswith(ISLAND_SIGN):
            sign.set("type", KEEP_LEFT)
            sign.set("name", f"sign {KEEP_LEFT}")
    xml = etree.tostring(root, xml_declaration=True, encoding="UTF-8", pretty_print=True)
    land = tuple(replace(point, place=mirrored_points(point.place)) for point in roads.land)
    return replace(roads, xml=xml, land=land)
