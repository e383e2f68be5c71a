"""What an object is: its template by type, subtype and name.

Types and subtypes are those of 13.1 (1.4 to 1.9). Where a file says only ``-1`` or ``none`` the
name decides: exporters write the name of their model there.
"""

import re
from dataclasses import dataclass

from envgen_usd.models.road_objects import RoadObject

FLAT = "flat"
"""Template of what lies on the road: the road surface shows it."""
UNKNOWN = "unknown"
"""Template of what nothing is known about."""


@dataclass(frozen=True)
class Kind:
    """A kind of object.

    Attributes:
        template: Asset kind, ``building``, ``barrier`` or one of `FLAT` and `UNKNOWN`.
        function: CityGML code of the feature's function (SIG3D code list of CityFurniture), empty
            where none fits.
        height: Metres, where the file gives none.
        section: Cross-section of a barrier: ``guard_rail``, ``jersey``, ``railing``, ``fence`` or
            ``wall``.
    """

    template: str
    function: str = ""
    height: float = 0.0
    section: str = ""


_BARRIERS = {
    "guardrail": Kind("barrier", "1440", 0.75, "guard_rail"),
    "jerseybarrier": Kind("barrier", "1440", 0.81, "jersey"),
    "railing": Kind("barrier", "1440", 1.1, "railing"),
    "rail": Kind("barrier", "1440", 1.1, "railing"),
    "fence": Kind("barrier", "1440", 1.5, "fence"),
    "hedge": Kind("hedge", "", 1.2, "wall"),
    "wall": Kind("barrier", "", 1.5, "wall"),
    "noiseprotection": Kind("barrier", "", 3.0, "wall"),
    "soundbarrier": Kind("barrier", "", 3.0, "wall"),
    "barrier": Kind("barrier", "1440", 0.8, "wall"),
}
_BEAM = Kind("barrier", "1440", 0.3, "beam")
_RAILS = {"guard_rail", "railing"}
_LIFTED, _SLIM = 0.2, 0.45
"""Metres above the road from which a rail of at most that height is a beam alone."""
_THINGS = {
    "flat": Kind(FLAT),
    "structure": Kind(FLAT),
    "building": Kind("building", "", 6.0),
    "tree": Kind("tree", "", 8.0),
    "bush": Kind("bush", "", 1.5),
    "street_light": Kind("street_light", "1150", 8.0),
    "traffic_light_pole": Kind("pole", "1080", 3.5),
    "sign_post": Kind("pole", "1070", 2.5),
    "delineator": Kind("delineator", "1320", 1.0),
    "call_box": Kind("emergency_call_box", "1030", 1.8),
    "pole": Kind("pole", "1270", 3.0),
    "bollard": Kind("bollard", "1320", 0.9),
    "hydrant": Kind("hydrant", "1330", 0.9),
    "cone": Kind("traffic_cone", "1320", 0.5),
    "barrel": Kind("barrel", "1320", 1.0),
    "bench": Kind("bench", "", 0.8),
    "bin": Kind("bin", "1200", 1.0),
    "control_box": Kind("control_box", "1060", 1.2),
    "gantry": Kind("gantry", "1270", 5.5),
    "bus_stop": Kind("bus_stop", "1110", 2.5),
    "vehicle": Kind("vehicle", "", 1.5),
    "person": Kind("person", "", 1.75),
    "obstacle": Kind("obstacle", "", 1.0),
    "sign": Kind("traffic_sign", "1070", 2.3),
    "part": Kind(FLAT),
}
_SUBTYPES = (
    (r"^(bush|shrub|hedge)$", "bush"),
    (r"streetlamp|streetlight|lamp", "street_light"),
    (r"emergencycallbox", "call_box"),
    (r"trafficlight", "traffic_light_pole"),
    (r"trafficsign", "sign_post"),
    (r"permanentdelineator|delineator|guide.?post", "delineator"),
    (r"bollard", "bollard"),
    (r"hydrant", "hydrant"),
    (r"controllerbox|controlbox", "control_box"),
    (r"cone", "cone"),
    (r"barrel|drum", "barrel"),
    (r"bench", "bench"),
    (r"trash|bin$|wastebin|dustbin", "bin"),
)
"""Patterns of subtypes and names of poles and obstacles."""
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
    "roadmark": "flat",
    "roadsurface": "flat",
    "crosswalk": "flat",
    "parkingspace": "flat",
    "parking": "flat",
    "trafficisland": "flat",
    "patch": "flat",
    "island": "flat",
    "wind": "part",
    "tunnel": "structure",
    "bridge": "structure",
    **dict.fromkeys(("car", "van", "bus", "trailer", "truck", "tram", "train"), "vehicle"),
    **dict.fromkeys(("bike", "motorbike"), "vehicle"),
    "pedestrian": "person",
}
_NAMES = (
    (r"stencil|stopline|chevron|crosshatch|(solid|dashed|broken).*(white|yellow)|^sgrm", "flat"),
    (r"originreference|luminaire_(arm|head)", "part"),
    (r"cylinderpost|streetl(amp|ight)|lamp_?post", "street_light"),
    (r"signal_?post|trafficlightpole", "traffic_light_pole"),
    (r"signpost", "sign_post"),
    (r"^speed_\d|stopsign|^sign_", "sign"),
    (r"bush|shrub|hedge", "bush"),
    (r"pine|ash\d|cypress|eucalyptus|oak|palm|maple|birch|tree|larch|elm|willow", "tree"),
    (r"house|building|storey|garage", "building"),
    (r"busstop", "bus_stop"),
)
"""Patterns of the names that exporters give to models."""


def kind_of(thing: RoadObject) -> Kind:
    """The kind of an object."""
    type_, subtype = _plain(thing.type), _plain(thing.subtype)
    name = _plain(thing.name)
    if type_ in _BARRIERS:
        kind = next(
            (_BARRIERS[key] for key in (subtype, name) if key in _BARRIERS), _BARRIERS[type_]
        )
        return _BEAM if kind.section in _RAILS and _is_beam(thing) else kind
    if type_ in {"pole", "obstacle", "vegetation"}:
        found = _match(_SUBTYPES, subtype) or _match(_SUBTYPES, name) or _match(_NAMES[6:8], name)
        return _THINGS[found or _TYPES[type_]]
    if type_ in _TYPES:
        return _THINGS[_TYPES[type_]]
    found = _match(_NAMES, name) or _match(_SUBTYPES, name)
    if found is None:
        found = next((key for key in _TYPES if name.startswith(key)), None)
        found = None if found is None else _TYPES[found]
    return _THINGS[found] if found else Kind(UNKNOWN)


def _is_beam(thing: RoadObject) -> bool:
    """True if no more than the beam of a rail is meant; its posts are objects of their own."""
    low = [min(r.z_offset) for r in thing.repeats if r.distance == 0 and min(r.z_offset) > 0]
    high = [max(r.height) for r in thing.repeats if r.distance == 0]
    return bool(low) and min(low) >= _LIFTED and max(high) <= _SLIM


def _plain(text: str) -> str:
    """Lower case, without a model's folders and file ending."""
    return re.sub(r"^.*[/\\]|\.(flt|osgb|fbx|osg)\b.*$", "", text).strip().lower()


def _match(patterns: tuple[tuple[str, str], ...], text: str) -> str | None:
    return next((found for pattern, found in patterns if re.search(pattern, text)), None)
