"""What tags of OpenStreetMap mean for an environment (wiki.openstreetmap.org/wiki/Map_features)."""

from collections.abc import Mapping

STREETS: Mapping[str, float] = {
    "primary": 9.0,
    "secondary": 8.0,
    "tertiary": 7.0,
    "unclassified": 6.0,
    "residential": 6.0,
    "living_street": 5.0,
    "trunk": 10.0,
}
"""Values of ``highway`` with houses beside them, and a width in metres where none is tagged."""
LANE = 3.2
"""Lane width of streets without a tagged width, metres; a larger value widens streets."""
SIDEWALK = 2.0
"""Width of a sidewalk without a tagged width, metres."""
LANDUSE: Mapping[str, str] = {
    "residential": "residential",
    "allotments": "",
    "farmyard": "",
    "industrial": "industrial",
    "commercial": "industrial",
    "retail": "industrial",
    "railway": "industrial",
}
"""Values of ``landuse`` with the area type that they are, empty for neither."""
RESIDENTIAL_KINDS = (
    "house",
    "detached",
    "semidetached_house",
    "terrace",
    "apartments",
    "residential",
    "bungalow",
    "dormitory",
)
"""Values of ``building`` of houses and flats."""
KINDS: Mapping[str, str] = {
    **dict.fromkeys(RESIDENTIAL_KINDS, "residential"),
    **dict.fromkeys(("industrial", "warehouse", "factory", "hangar", "commercial"), "industrial"),
}
"""Values of ``building`` with the area type that they are."""
ANCILLARY = frozenset(
    {
        "garage",
        "garages",
        "carport",
        "shed",
        "hut",
        "roof",
        "cabin",
        "greenhouse",
        "barn",
        "stable",
        "sty",
        "cowshed",
        "service",
        "kiosk",
        "toilets",
        "transformer_tower",
        "bunker",
        "container",
        "construction",
        "ruins",
    }
)
"""Values of ``building`` that stand beside a main building, or are no building yet."""
ROOFS: Mapping[str, str] = {
    "flat": "flat",
    "skillion": "shed",
    "gabled": "gabled",
    "saltbox": "gabled",
    "gabled_height_moved": "gabled",
    "hipped": "hipped",
    "half-hipped": "hipped",
    "side_hipped": "hipped",
    "pyramidal": "pyramidal",
    "cone": "pyramidal",
    "dome": "dome",
    "onion": "onion",
    "mansard": "mansard",
    "gambrel": "mansard",
    "round": "barrel",
    "sawtooth": "sawtooth",
}
"""Values of ``roof:shape`` with the roof's name in an environment; domes and onions, which
environments do not draw, keep their own."""
MATERIALS: Mapping[str, str] = {
    "brick": "brick",
    "plaster": "plaster",
    "stucco": "plaster",
    "concrete": "concrete",
    "metal": "metal",
    "wood": "wood",
    "timber_framing": "wood",
    "stone": "stone",
    "sandstone": "stone",
    "glass": "glass",
    "roof_tiles": "roof_tiles",
    "slate": "roof_slate",
    "tar_paper": "bitumen",
    "gravel": "gravel",
}
"""Values of ``building:material`` and ``roof:material`` with the begin of a material's name."""
BARRIERS: Mapping[str, str] = {
    "hedge": "hedge",
    "fence": "fence",
    "wall": "wall",
    "retaining_wall": "wall",
}
"""Values of ``barrier`` that enclose plots."""

SHOPS = frozenset(
    {
        "restaurant",
        "cafe",
        "fast_food",
        "bar",
        "pub",
        "ice_cream",
        "pharmacy",
        "bank",
        "post_office",
        "bureau_de_change",
        "casino",
        "internet_cafe",
    }
)
"""Values of ``amenity`` with a shop front."""


def has_shop_front(tags: Mapping[str, str]) -> bool:
    """True for what has a shop front."""
    return tags.get("shop", "no") not in {"no", "vacant"} or tags.get("amenity") in SHOPS


RAILWAYS = frozenset({"rail", "light_rail", "tram", "narrow_gauge"})
"""Values of ``railway`` with rails that are in use."""


def line_kind(tags: Mapping[str, str]) -> str:
    """``hedge``, ``fence``, ``wall``, ``tree_row`` or ``rail``; empty for all other ways.

    Railways on bridges and in tunnels are none: they do not lie on the land.
    """
    if tags.get("railway") in RAILWAYS:
        away = {tags.get("bridge", "no"), tags.get("tunnel", "no")} != {"no"}
        return "" if away or tags.get("layer", "0").startswith("-") else "rail"
    if tags.get("natural") == "tree_row":
        return "tree_row"
    return BARRIERS.get(tags.get("barrier", ""), "")


def landuse_of_kind(kind: str) -> str:
    """Area type of a kind of building; empty where the kind does not tell."""
    return KINDS.get(kind, "")
