"""CityGML codes of OpenDRIVE lanes: class, codes, material."""

from dataclasses import dataclass

from envgen_usd.city.roads.street_materials import StreetMaterials
from envgen_usd.models.environment_profile import Profile
from envgen_usd.models.lanes import WALKED
from envgen_usd.models.road_surface import KERB_STONE, KERBS, Patch

TRAFFIC_TYPES = frozenset(
    (
        "driving",
        "stop",
        "shoulder",
        "biking",
        "shared",
        "sidewalk",
        "parking",
        "bidirectional",
        "tram",
        "rail",
        "entry",
        "exit",
        "offRamp",
        "onRamp",
        "connectingRamp",
        "bus",
        "taxi",
        "walking",
        "slipLane",
    )
)
"""Lane types that carry traffic; the others are auxiliary (as in r:trân)."""
# SIG3D code lists TrafficArea_function, TrafficArea_usage.
_FUNCTIONS = {
    "sidewalk": "2",
    "walking": "2",
    "biking": "3",
    "shared": "1;2;3",
    "parking": "7",
    "rail": "8",
    "tram": "8",
    "shoulder": "36",
    "stop": "36",
}
_USAGES = {
    "sidewalk": "1",
    "walking": "1",
    "biking": "6",
    "shared": "2;6;1",
    "rail": "5",
    "tram": "8",
    "bus": "4",
    "taxi": "13",
}
# SIG3D code list AuxiliaryTrafficArea_function.
_AUXILIARY = {
    "kerb": "1220",
    KERB_STONE: "1220",
    "curb": "1220",
    "median": "1030",
    "border": "1000",
    "none": "1020",
}
_SURFACES = {
    "asphalt": "1",
    "asphalt_fresh": "1",
    "asphalt_old": "1",
    "asphalt_patched": "1",
    "asphalt_worn": "1",
    "paving_asphalt": "1",
    "concrete": "2",
    "curb_concrete": "2",
    "curb_stone": "2",
    "paving": "3",
    "paving_pale": "3",
    "paving_setts": "3",
    "cobble": "4",
    "gravel": "5",
    "grass": "10",
    "grass_verge": "10",
}
_FILE_MATERIALS = {"asphalt": "asphalt", "concrete": "concrete", "grass": "grass_verge"}
_WORN = frozenset(("shoulder", "stop", "restricted", "biking"))


@dataclass(frozen=True)
class LaneCodes:
    """Codes of a lane's traffic space and traffic area.

    Attributes:
        space: ``TrafficSpace`` or ``AuxiliaryTrafficSpace``.
        area: ``TrafficArea`` or ``AuxiliaryTrafficArea``.
        function: SIG3D code; several codes are joined by ``;``.
        usage: SIG3D code; empty if there is no code.
        material: Name in the material library.
        surface_material: SIG3D code; empty if there is no code.
    """

    space: str
    area: str
    function: str
    usage: str
    material: str
    surface_material: str


def lane_codes(patch: Patch, profile: Profile, street: StreetMaterials) -> LaneCodes:
    """Returns the CityGML codes of a patch of the road surface.

    Args:
        patch: Any patch except a mark.
        profile: Environment; gives materials that the file lacks.
        street: Materials of the patch's street.
    """
    material = _material(patch, profile, street)
    crosswalk = patch.kind == "crosswalk"
    traffic = patch.lane_type in TRAFFIC_TYPES and patch.kind not in KERBS
    if traffic or crosswalk:
        function = "20" if crosswalk else _FUNCTIONS.get(patch.lane_type, "1")
        usage = "1" if crosswalk else _USAGES.get(patch.lane_type, "2")
    else:
        function = _AUXILIARY.get(patch.kind, _AUXILIARY.get(patch.lane_type, "1700"))
        usage = ""
    prefix = "" if traffic or crosswalk else "Auxiliary"
    return LaneCodes(
        space=f"{prefix}TrafficSpace",
        area=f"{prefix}TrafficArea",
        function=function,
        usage=usage,
        material=material,
        surface_material=_SURFACES.get(material, ""),
    )


def mark_colour(patch: Patch, profile: Profile) -> str:
    """Returns the colour of a mark; the environment defines ``standard``."""
    if patch.colour in ("", "standard"):
        return profile.road.marking_colour
    return patch.colour


def mark_material(colour: str) -> str:
    """Returns the paint material of a colour."""
    return "marking_yellow" if colour in ("yellow", "orange") else "marking_white"


def _material(patch: Patch, profile: Profile, street: StreetMaterials) -> str:
    foot = patch.lane_type in WALKED
    if patch.kind in KERBS or patch.lane_type == "curb":
        return street.kerb
    if patch.kind == "crosswalk":
        return "marking_white" if patch.colour else street.lanes
    if patch.material in _FILE_MATERIALS:
        return _of_file(patch.material, street.sidewalk if foot else street.lanes)
    if foot:
        return street.sidewalk
    if patch.lane_type in ("median", "border", "none"):
        return profile.ground_materials.get("verge", "grass_verge")
    worn = patch.lane_type in _WORN or patch.kind == "road_surface"
    return "asphalt_worn" if worn else street.lanes


def _of_file(stated: str, drawn: str) -> str:
    """Material of a lane whose file states its kind; the drawn material if it is of that kind."""
    plain = _FILE_MATERIALS[stated]
    return drawn if _SURFACES.get(drawn) == _SURFACES[plain] else plain
