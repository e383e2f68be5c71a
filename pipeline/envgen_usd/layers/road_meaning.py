"""What a surface of a road is: its class, its part, and its material."""

from collections.abc import Mapping
from dataclasses import dataclass

from envgen_usd.models.city import Attribute, ThematicSurface
from envgen_usd.models.profile import Profile


@dataclass(frozen=True, order=True)
class RoadMeaning:
    """Surfaces that mean and look the same become one mesh.

    Attributes:
        label: Token in the `class` taxonomy.
        part: Token in the `part` taxonomy.
        material: Material of the library.
    """

    label: str
    part: str
    material: str

    @property
    def name(self) -> str:
        """Name of the mesh's prim."""
        return f"{self.label}_{self.part}_{self.material}"


_SHOULDER = {"shoulder", "stop", "restricted", "biking"}
_FOOT = {"sidewalk", "walking"}
_GROUND = {"median", "border", "none"}
_FUNCTIONS = {"2": "sidewalk", "3": "biking", "5": "sidewalk", "footpath": "sidewalk"}
"""TrafficArea functions of the SIG3D code list that are not for cars, as lane types."""


def road_meaning(
    surface: ThematicSurface, owner: Mapping[str, Attribute], profile: Profile
) -> RoadMeaning:
    """Says what a surface of a road is.

    Attributes that this program wrote (``opendrive_lane_type``, ``opendrive_kind``, ``colour``)
    decide; a foreign file's surfaces are told apart by their CityGML class and function.

    Args:
        surface: The surface.
        owner: Attributes of the space that it bounds and of those around, inner ones first.
        profile: Says how roads look.
    """
    facts = {**owner, **surface.attributes}
    lane_type = str(facts.get("opendrive_lane_type", "")) or _foreign_type(surface, facts)
    kind = str(facts.get("opendrive_kind", ""))
    label = _label(lane_type)
    if surface.kind == "Marking" or kind in {"mark", "crosswalk"}:
        return RoadMeaning("road", _mark_part(kind), surface.material or _paint(facts, profile))
    if kind == "kerb" or lane_type == "curb":
        return RoadMeaning(
            "sidewalk" if lane_type in {*_FOOT, "curb"} else "road",
            "kerb",
            surface.material or "curb_stone",
        )
    return RoadMeaning(label, lane_type, surface.material or _material(lane_type, profile))


def _foreign_type(surface: ThematicSurface, facts: Mapping[str, Attribute]) -> str:
    if surface.kind == "AuxiliaryTrafficArea":
        return "border"
    return _FUNCTIONS.get(str(facts.get("function", "")).lower(), "driving")


def _label(lane_type: str) -> str:
    if lane_type in _FOOT:
        return "sidewalk"
    return "terrain" if lane_type in _GROUND else "road"


def _mark_part(kind: str) -> str:
    return "crosswalk" if kind == "crosswalk" else "lane_marking"


def _paint(facts: Mapping[str, Attribute], profile: Profile) -> str:
    colour = str(facts.get("colour", "")) or profile.road.marking_colour
    return "marking_yellow" if colour in {"yellow", "orange"} else "marking_white"


def _material(lane_type: str, profile: Profile) -> str:
    if lane_type in _FOOT:
        return profile.road.sidewalk_material
    if lane_type in _GROUND:
        return profile.ground_materials.get("verge", "grass_verge")
    return "asphalt_worn" if lane_type in _SHOULDER else profile.road.material
