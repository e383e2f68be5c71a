"""Kind of an object: its template by type, subtype and name.

Types and subtypes are those of 13.1 (1.4 to 1.9). For the types ``-1`` and ``none`` the name
decides, because exporters write the name of their 3D model there.
"""

import re
from dataclasses import dataclass
from itertools import accumulate

from envgen_usd.models.road_objects import RoadObject
from envgen_usd.opendrive.features.name_words import Vocabulary, words_of

FLAT = "flat"
"""Template of flat objects on the road; the road surface contains them, by the kind's name."""
UNKNOWN = "unknown"
"""Template of objects of unknown kind."""


@dataclass(frozen=True)
class Kind:
    """A kind of object.

    Attributes:
        template: Asset kind, ``building``, ``barrier``, `FLAT` or `UNKNOWN`.
        name: Name of the kind, e.g. ``sign_post``; empty where it is that of the template.
        height: Metres, for objects without a height.
        section: Cross-section of a barrier: ``guard_rail``, ``jersey``, ``railing``, ``fence``,
            ``hedge`` or ``wall``.
    """

    template: str
    name: str = ""
    height: float = 0.0
    section: str = ""


_BARRIERS = {
    "guardrail": Kind("barrier", "guard_rail", 0.75, "guard_rail"),
    "jerseybarrier": Kind("barrier", "jersey_barrier", 0.81, "jersey"),
    "railing": Kind("barrier", "railing", 1.1, "railing"),
    "rail": Kind("barrier", "railing", 1.1, "railing"),
    "fence": Kind("barrier", "fence", 1.5, "fence"),
    "hedge": Kind("hedge", "", 1.2, "hedge"),
    "wall": Kind("barrier", "wall", 1.5, "wall"),
    "noiseprotection": Kind("barrier", "noise_protection", 3.0, "wall"),
    "soundbarrier": Kind("barrier", "noise_protection", 3.0, "wall"),
    "barrier": Kind("barrier", "", 0.8, "wall"),
}
_BEAM = Kind("barrier", "beam", 0.3, "beam")
_RAILS = {"guard_rail", "railing"}
_LIFTED, _SLIM = 0.2, 0.45
"""Metres: least height above the road, and largest beam height, of a rail without posts."""
_KINDS = {
    "crosswalk": Kind(FLAT, "crosswalk"),
    "road_mark": Kind(FLAT, "road_mark"),
    "road_surface": Kind(FLAT, "road_surface"),
    "parking": Kind(FLAT, "parking"),
    "island": Kind(FLAT, "island"),
    "structure": Kind(FLAT, "structure"),
    "building": Kind("building", "", 6.0),
    "tree": Kind("tree", "", 8.0),
    "bush": Kind("bush", "", 1.5),
    "street_light": Kind("street_light", "", 8.0),
    "traffic_light_pole": Kind("pole", "traffic_light_pole", 3.5),
    "sign_post": Kind("pole", "sign_post", 2.5),
    "delineator": Kind("delineator", "", 1.0),
    "call_box": Kind("emergency_call_box", "", 1.8),
    "pole": Kind("pole", "", 3.0),
    "bollard": Kind("bollard", "", 0.9),
    "hydrant": Kind("hydrant", "", 0.9),
    "cone": Kind("traffic_cone", "", 0.5),
    "barrel": Kind("barrel", "", 1.0),
    "bench": Kind("bench", "", 0.8),
    "bin": Kind("bin", "", 1.0),
    "control_box": Kind("control_box", "", 1.2),
    "gantry": Kind("gantry", "", 5.5),
    "bus_stop": Kind("bus_stop", "", 2.5),
    "vehicle": Kind("vehicle", "", 1.5),
    "person": Kind("person", "", 1.75),
    "obstacle": Kind("obstacle", "", 1.0),
    "sign": Kind("traffic_sign", "", 2.3),
    "part": Kind(FLAT, "part"),
    "other": Kind(UNKNOWN),
}
_TYPES = {
    "tree": "tree",
    "vegetation": "tree",
    "building": "building",
    "pole": "pole",
    "streetlamp": "street_light",
    "obstacle": "obstacle",
    "gantry": "gantry",
    "busstop": "bus_stop",
    "guide-post": "delineator",
    "rail-pole": "bollard",
    "roadmark": "road_mark",
    "roadsurface": "road_surface",
    "crosswalk": "crosswalk",
    "parkingspace": "parking",
    "parking": "parking",
    "trafficisland": "island",
    "patch": "road_surface",
    "island": "island",
    "wind": "part",
    "tunnel": "structure",
    "bridge": "structure",
    **dict.fromkeys(("car", "van", "bus", "trailer", "truck", "tram", "train"), "vehicle"),
    **dict.fromkeys(("bike", "motorbike"), "vehicle"),
    "pedestrian": "person",
}
_NAMED = {"pole", "obstacle", "vegetation"}
"""Types whose kind depends on subtype and name."""
_BEGINNINGS = {"".join(words_of(type_)): key for type_, key in _TYPES.items()}
"""Kinds by the words at the begin of a name."""
_FURNITURE_ROWS = (
    ("street_light", ("street lamp", "street light", "lamp", "lamp post", "street lamp post")),
    ("call_box", ("emergency call box",)),
    ("traffic_light_pole", ("traffic light", "traffic light pole", "traffic light post")),
    ("sign_post", ("traffic sign", "traffic sign pole", "traffic sign post")),
    ("delineator", ("delineator", "permanent delineator", "guide post")),
    ("bollard", ("bollard",)),
    ("hydrant", ("hydrant", "fire hydrant")),
    ("control_box", ("controller box", "control box")),
    ("cone", ("cone", "traffic cone", "road cone", "safety cone")),
    ("barrel", ("barrel", "traffic barrel", "drum", "traffic drum", "oil drum")),
    ("bench", ("bench", "park bench")),
    ("bin", ("trash", "trash bin", "trash can", "bin", "dust bin", "litter bin", "waste bin")),
    ("bush", ("bush", "shrub", "hedge")),
)
_SPECIES = (
    "birch",
    "cypress",
    "elm",
    "eucalyptus",
    "larch",
    "maple",
    "oak",
    "palm",
    "pine",
    "willow",
)
# Ash is a tree before a number or "tree"; ash bins are bins.
_TREES = ("tree", "ash #", "ash tree", *_SPECIES, *(f"{species} tree" for species in _SPECIES))
_LINES = tuple(
    f"{pattern} * {colour}"
    for pattern in ("broken", "dashed", "solid")
    for colour in ("white", "yellow")
)
_MODEL_ROWS = (
    ("road_mark", ("stencil", "stop line", "chevron", "cross hatch", "sg rm", *_LINES)),
    ("part", ("origin reference", "luminaire arm", "luminaire head")),
    ("other", ("bike rack", "parking meter", "tree grate", "tree guard", "tree pit")),
    ("street_light", ("cylinder post",)),
    ("traffic_light_pole", ("signal post",)),
    ("sign_post", ("sign post",)),
    ("gantry", ("gantry", "sign gantry")),
    ("sign", ("^ speed #", "stop sign", "^ sign")),
    *_FURNITURE_ROWS,
    ("tree", _TREES),
    ("building", ("house", "building", "storey", "garage", "farm house", "town house")),
    ("building", ("green house", "light house", "ware house")),
    ("bus_stop", ("bus stop", "bus shelter")),
)
_FURNITURE = Vocabulary(_FURNITURE_ROWS)
"""Kinds by subtypes and names of poles, obstacles and vegetation."""
_PLANTS = Vocabulary([("tree", _TREES)])
_MODELS = Vocabulary(_MODEL_ROWS)
"""Kinds by model names from exporters."""


def kind_of(road_object: RoadObject) -> Kind:
    """Returns the kind of an object."""
    texts = road_object.type, road_object.subtype, road_object.name
    type_, subtype, name = map(_plain, texts)
    if type_.lower() in _BARRIERS:
        named = (_BARRIERS.get(text.lower()) for text in (subtype, name, type_))
        kind = next(kind for kind in named if kind is not None)
        return _BEAM if kind.section in _RAILS and _is_beam(road_object) else kind
    return _KINDS[_key(type_.lower(), subtype, name)]


def _key(type_: str, subtype: str, name: str) -> str:
    """Returns the key of an object's kind, unless the object is a barrier."""
    if type_ in _NAMED:
        return (
            _FURNITURE.meaning(subtype)
            or _FURNITURE.meaning(name)
            or _PLANTS.meaning(name)
            or _TYPES[type_]
        )
    if type_ in _TYPES:
        return _TYPES[type_]
    return _MODELS.meaning(name) or _by_beginning(name) or "other"


def _by_beginning(name: str) -> str | None:
    """Returns the kind of the longest type at the begin of a name, `None` without a type."""
    beginnings = accumulate(words_of(name))
    return next((_BEGINNINGS[b] for b in reversed([*beginnings]) if b in _BEGINNINGS), None)


def _is_beam(road_object: RoadObject) -> bool:
    """Returns whether an object is only the beam of a rail; its posts are separate objects."""
    low = [min(r.z_offset) for r in road_object.repeats if r.distance == 0 and min(r.z_offset) > 0]
    high = [max(r.height) for r in road_object.repeats if r.distance == 0]
    return bool(low) and min(low) >= _LIFTED and max(high) <= _SLIM


def _plain(text: str) -> str:
    """Returns the text without folders and file extension of a model."""
    return re.sub(r"^.*[/\\]|\.(flt|osgb|fbx|osg)\b.*$", "", text).strip()


def element_length(road_object: RoadObject) -> float:
    """Returns the length of a barrier without a repeat, metres; 0 where the file gives none."""
    return road_object.length or 2 * road_object.radius
