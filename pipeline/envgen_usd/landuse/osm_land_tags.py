"""Tags of OpenStreetMap ─► classes of landuse, and widths of roads and ways."""

from collections.abc import Mapping

from envgen_usd.models.landuse import LanduseClass

ROADS: Mapping[str, float] = {
    "motorway": 11.0,
    "motorway_link": 6.0,
    "trunk": 10.0,
    "trunk_link": 6.0,
    "primary": 9.0,
    "primary_link": 6.0,
    "secondary": 8.0,
    "secondary_link": 6.0,
    "tertiary": 7.0,
    "tertiary_link": 6.0,
    "unclassified": 6.0,
    "residential": 6.0,
    "living_street": 5.0,
}
"""Values of the tag ``highway`` that are roads, with a default width in metres."""
ACCESS_WIDTH = 3.5
"""Width of ``highway=service``, metres; a larger value widens driveways."""
PATHS: Mapping[str, float] = {
    "footway": 1.8,
    "cycleway": 2.0,
    "pedestrian": 4.0,
    "steps": 2.0,
    "path": 1.4,
    "bridleway": 1.6,
    "track": 2.6,
}
"""Values of ``highway`` that are ways for people on foot or on land, with a default width in
metres."""
_PATH_WIDTHS = (0.3, 12.0)
"""Widths of paths that are believed, metres."""
_OF_EARTH = frozenset({"path", "bridleway", "track"})
"""Paths that are paved only where the map says so."""
_PAVED = (
    "paved",
    "asphalt",
    "concrete",
    "paving_stones",
    "sett",
    "cobblestone",
    "unhewn",
    "bricks",
)
"""How values of ``surface`` of paved ways begin."""
_AT_STREETS = frozenset({"sidewalk", "crossing", "traffic_island", "access_aisle", "link"})
"""Values of ``footway`` and ``cycleway`` for what belongs to a street and is built with it."""
UNPAVED = frozenset({"parking_aisle", "emergency_access"})
"""Values of ``service`` that are no ways of their own: they lie within other paved ground."""
LINES: Mapping[str, Mapping[str, tuple[LanduseClass, float]]] = {
    "waterway": {
        "river": (LanduseClass.WATER, 10.0),
        "canal": (LanduseClass.WATER, 8.0),
        "stream": (LanduseClass.WATER, 2.0),
    },
    "man_made": {
        "pier": (LanduseClass.QUAY, 2.5),
        "quay": (LanduseClass.QUAY, 4.0),
        "breakwater": (LanduseClass.QUAY, 6.0),
    },
    "railway": {
        "rail": (LanduseClass.RAIL, 4.0),
        "light_rail": (LanduseClass.RAIL, 4.0),
        "narrow_gauge": (LanduseClass.RAIL, 3.0),
    },
}
"""Class of lines above ground that are neither roads nor ways, and a default width in metres."""
AREAS: Mapping[str, Mapping[str, LanduseClass]] = {
    # Harbours are mapped as industrial land, too.
    "industrial": {"port": LanduseClass.QUAY, "container_terminal": LanduseClass.QUAY},
    "man_made": dict.fromkeys(("pier", "quay", "breakwater"), LanduseClass.QUAY),
    "landuse": {
        "harbour": LanduseClass.QUAY,
        "port": LanduseClass.QUAY,
        "residential": LanduseClass.LAWN,
        "farmyard": LanduseClass.LAWN,
        "industrial": LanduseClass.RUBBLE,
        "commercial": LanduseClass.RUBBLE,
        "retail": LanduseClass.RUBBLE,
        "railway": LanduseClass.RUBBLE,
        "construction": LanduseClass.RUBBLE,
        "garages": LanduseClass.PARKING,
        "forest": LanduseClass.WOOD,
        "grass": LanduseClass.GRASS,
        "meadow": LanduseClass.GRASS,
        "allotments": LanduseClass.ALLOTMENT,
        "cemetery": LanduseClass.PARK,
        "recreation_ground": LanduseClass.PARK,
        "village_green": LanduseClass.PARK,
        "farmland": LanduseClass.FIELD,
        "vineyard": LanduseClass.CROP,
        "orchard": LanduseClass.ORCHARD,
        "plant_nursery": LanduseClass.CROP,
        "basin": LanduseClass.WATER,
        "reservoir": LanduseClass.WATER,
    },
    "natural": {
        "wood": LanduseClass.WOOD,
        "scrub": LanduseClass.WOOD,
        "grassland": LanduseClass.GRASS,
        "heath": LanduseClass.GRASS,
        "water": LanduseClass.WATER,
    },
    "waterway": {"riverbank": LanduseClass.WATER, "dock": LanduseClass.WATER},
    "leisure": {
        "park": LanduseClass.PARK,
        "common": LanduseClass.PARK,
        "playground": LanduseClass.PARK,
        "pitch": LanduseClass.PARK,
        "garden": LanduseClass.PARK,
    },
    "amenity": {"parking": LanduseClass.PARKING, "marketplace": LanduseClass.SQUARE},
    "place": {"square": LanduseClass.SQUARE},
    "highway": {"pedestrian": LanduseClass.SQUARE},
    "harbour": dict.fromkeys(("yes", "container", "fishing", "commercial"), LanduseClass.QUAY),
}
"""Landuse class by area tag; the smaller of two areas lies on top."""
OF_LINES = frozenset({"highway", "man_made"})
"""Keys that closed ways have as lines, too: only ``area=yes`` makes areas of them."""
LANE = 3.2
"""Lane width of roads without a tagged width, metres; a larger value widens roads."""
_LANES = frozenset(map(str, range(1, 31)))
"""Numbers of lanes that are believed; the widest toll plazas have fewer."""
_WIDEST = 1000.0
"""Greatest width that is believed, metres: that of a large river."""


def has_landuse(tags: Mapping[str, str], *, is_area: bool) -> bool:
    """True for ways, or with `is_area` for closed ones and relations, that are of a class."""
    kind = tags.get("highway", "")
    is_way = kind in ROADS or path_width(tags) > 0.0
    is_closed_way = tags.get("type") != "multipolygon"
    has_class = is_area and area_class(tags, is_way=is_closed_way) is not None
    return has_class or is_way or line_class(tags) is not None


def path_width(tags: Mapping[str, str]) -> float:
    """Width of a path or a service way above ground, metres; 0 for all else."""
    kind = tags.get("highway", "")
    if kind == "service":
        return 0.0 if tags.get("service") in UNPAVED else width_of(tags, ACCESS_WIDTH)
    is_away = {tags.get(key, "no") for key in ("bridge", "tunnel", "indoor", "area")} != {"no"}
    if kind not in PATHS or is_away or tags.get("layer", "0").startswith("-"):
        return 0.0
    said = width_of(tags, PATHS[kind])
    return said if _PATH_WIDTHS[0] <= said <= _PATH_WIDTHS[1] else PATHS[kind]


def is_paved_path(tags: Mapping[str, str]) -> bool:
    """True for a path that is paved beside the streets and no part of one."""
    kind, surface = tags.get("highway", ""), tags.get("surface", "")
    if kind not in PATHS or _AT_STREETS & {tags.get("footway"), tags.get("cycleway")}:
        return False
    return surface.startswith(_PAVED) or (not surface and kind not in _OF_EARTH)


def line_class(tags: Mapping[str, str]) -> tuple[LanduseClass, float] | None:
    """Class and default width of a line that is neither road nor way; `None` under ground."""
    if tags.get("tunnel", "no") != "no":
        return None
    for key, values in LINES.items():
        if tags.get(key) in values:
            return values[tags[key]]
    return None


def area_class(tags: Mapping[str, str], *, is_way: bool = False) -> LanduseClass | None:
    """Class of a relation, or of a closed way; `None` without one."""
    for key, values in AREAS.items():
        is_line = is_way and key in OF_LINES and tags.get("area") != "yes"
        if tags.get(key) in values and not is_line:
            return values[tags[key]]
    return None


def width_of(tags: Mapping[str, str], otherwise: float) -> float:
    """Width in metres: the tagged width, else the number of lanes times 3.2 m, else a default.

    Numbers that no width of a street or a river is are passed over.
    """
    try:
        width = float(tags["width"].removesuffix("m"))
    except (KeyError, ValueError):
        width = 0.0
    if 0.0 < width <= _WIDEST:
        return width
    lanes = tags.get("lanes", "")
    return LANE * int(lanes) if lanes in _LANES else otherwise
