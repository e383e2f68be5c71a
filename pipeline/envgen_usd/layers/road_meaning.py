"""Class, part and material of road surfaces."""

from collections.abc import Mapping
from dataclasses import dataclass

from envgen_usd.models.attribute_values import Attribute
from envgen_usd.models.city_model import ThematicSurface
from envgen_usd.models.environment_profile import Profile
from envgen_usd.models.figure_types import heaviest
from envgen_usd.models.lanes import WALKED
from envgen_usd.models.road_surface import KERBS


@dataclass(frozen=True, order=True)
class RoadMeaning:
    """Meaning and look of a road surface; surfaces that share them become a single mesh.

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
_GROUND = {"median", "border", "none"}
_FUNCTIONS = {"2": "sidewalk", "3": "biking", "5": "sidewalk", "footpath": "sidewalk"}
"""Lane types of TrafficArea functions (SIG3D code list) that exclude cars."""


def road_meaning(
    surface: ThematicSurface, owner: Mapping[str, Attribute], profile: Profile
) -> RoadMeaning:
    """Returns class, part and material of a road surface.

    Attributes of this program decide (``opendrive_lane_type``, ``opendrive_kind``, ``colour``).
    Surfaces of other programs follow from their CityGML class and function.

    Args:
        surface: Surface.
        owner: Attributes of the enclosing spaces, innermost first.
        profile: Environment; gives the look of roads.
    """
    facts = {**owner, **surface.attributes}
    lane_type = str(facts.get("opendrive_lane_type", "")) or _foreign_type(surface, facts)
    kind = str(facts.get("opendrive_kind", ""))
    label = _label(lane_type)
    if surface.kind == "Marking" or kind in {"mark", "crosswalk"}:
        return RoadMeaning("road", _mark_part(kind), surface.material or _paint(facts, profile))
    if kind in KERBS or lane_type == "curb":
        return RoadMeaning(
            "sidewalk" if lane_type in {*WALKED, "curb"} else "road",
            "kerb",
            surface.material or heaviest(profile.road.kerb_materials),
        )
    return RoadMeaning(label, lane_type, surface.material or _material(lane_type, profile))


def _foreign_type(surface: ThematicSurface, facts: Mapping[str, Attribute]) -> str:
    if surface.kind == "AuxiliaryTrafficArea":
        return "border"
    return _FUNCTIONS.get(str(facts.get("function", "")).lower(), "driving")


def _label(lane_type: str) -> str:
    if lane_type in WALKED:
        return "sidewalk"
    return "terrain" if lane_type in _GROUND else "road"


def _mark_part(kind: str) -> str:
    return "crosswalk" if kind == "crosswalk" else "lane_marking"


def _paint(facts: Mapping[str, Attribute], profile: Profile) -> str:
    colour = str(facts.get("colour", "")) or profile.road.marking_colour
    return "marking_yellow" if colour in {"yellow", "orange"} else "marking_white"


def _material(lane_type: str, profile: Profile) -> str:
    if lane_type in WALKED:
        return heaviest(profile.road.sidewalk_materials)
    if lane_type in _GROUND:
        return profile.ground_materials.get("verge", "grass_verge")
    worn = lane_type in _SHOULDER
    return "asphalt_worn" if worn else heaviest(profile.road.materials)
