"""The mirror image of a map's road file: traffic on the left instead of the right."""

from dataclasses import replace

from lxml import etree

from envgen_usd.geometry.mirrored_opendrive import mirror_document, mirrored_points
from envgen_usd.streets.mapped_roads import MappedRoads


def mirrored_roads(roads: MappedRoads) -> MappedRoads:
    """Roads with east and west swapped, as `mapped_roads` writes them, for traffic on the left."""
    root = etree.fromstring(roads.xml)
    mirror_document(root)
    xml = etree.tostring(root, xml_declaration=True, encoding="UTF-8", pretty_print=True)
    land = tuple(replace(point, place=mirrored_points(point.place)) for point in roads.land)
    return replace(roads, xml=xml, land=land)
