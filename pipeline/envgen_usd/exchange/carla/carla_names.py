"""Names that CARLA's import reads: of meshes, of materials, and of the map.

Sources: CARLA's `SSTags.h`, `MoveAssetsCommandlet.cpp`, `PrepareAssetsForCookingCommandlet.cpp` and
`Tagger.cpp`, and its page "Generate Pedestrian Navigation".
"""

import re
from hashlib import sha256

from envgen_usd.errors import EnvgenError

ROAD, MARKING, CURB = "Road_Road", "Road_Marking", "Road_Curb"
SIDEWALK, TERRAIN = "Road_Sidewalk", "Terrain"
GREEN = "Road_Grass_Terrain"
"""Green beside lanes: grass for pedestrians, terrain for the semantic tag."""
SIGN, SIGNAL = "TrafficSign", "TrafficLight"
_PARTS = {"lane_marking": MARKING, "crosswalk": MARKING, "kerb": CURB, "curb": CURB}
_ROADS = {"road": ROAD, "sidewalk": SIDEWALK, "terrain": GREEN}
_TAGS = {
    **_ROADS,
    "terrain": TERRAIN,
    "parking": TERRAIN,
    "building": "Building",
    "pole": "Pole",
    "vegetation": "Vegetation",
    "static": "Static",
    "wall": "Wall",
    "fence": "Fence",
    "guard_rail": "GuardRail",
    "bridge": "Bridge",
    "tunnel": "Wall",
    "traffic_light": SIGNAL,
    "traffic_sign": SIGN,
    "car": "Car",
    "truck": "Truck",
    "bus": "Bus",
    "train": "Train",
    "motorcycle": "Motorcycle",
    "bicycle": "Bicycle",
    "person": "Pedestrian",
    "rider": "Rider",
}
"""Class to the folder of CARLA's tagger, or to a name of roads."""
_DROPPED = {"light": "lamp", "sign": "plate"}
"""CARLA leaves out meshes and materials with these words: it sets lights and signs itself."""
_LONGEST = 63
"""Characters of a name that Blender keeps, one byte each; a larger value would be cut."""


def name_start(layer: str, label: str | None, part: str | None) -> str:
    """Begin of the name of a mesh, which decides its tag and who may walk on it.

    Args:
        layer: Layer of the stage, e.g. ``Roads``.
        label: Class, or `None`.
        part: Part, or `None`.
    """
    if layer == "Roads":
        return _PARTS.get(part or "") or _ROADS.get(label or "") or _TAGS.get(label or "", "Other")
    return _TAGS.get(label or "", "Other")


def mesh_name(start: str, *words: str) -> str:
    """Name of a mesh: its begin, and words of its meaning; too long names end with a hash."""
    name = "_".join([start, *(_kept(word) for word in words if word)])
    if len(name) > _LONGEST:
        name = f"{name[: _LONGEST - 9]}_{sha256(name.encode()).hexdigest()[:8]}"
    return name


def material_name(name: str) -> str:
    """Name of a material, without words by which CARLA would leave out its meshes."""
    return _kept(name)


def map_name(stem: str) -> str:
    """Name of the map, which is that of all its files.

    Args:
        stem: Name of the road's file without its suffix.

    Raises:
        EnvgenError: CARLA would leave out all meshes of a map with this name.
    """
    name = re.sub(r"\W+", "_", stem, flags=re.ASCII).strip("_") or "map"
    words = [word for word in _DROPPED if word in name.lower()]
    if words:
        raise EnvgenError(
            f"--road {stem}.xodr: CARLA leaves out all meshes with '{words[0]}' in their names, "
            "and the map's name is part of each; copy the road to a file with another name"
        )
    return name


def _kept(text: str) -> str:
    """ASCII letters, digits and underscores, without the words that CARLA looks for."""
    plain = re.sub(r"\W", "_", text, flags=re.ASCII)
    for word, other in _DROPPED.items():
        plain = re.sub(word, other, plain, flags=re.IGNORECASE)
    return plain
