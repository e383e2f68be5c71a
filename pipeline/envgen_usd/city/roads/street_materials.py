"""Materials of a street, drawn from the weights of the environment."""

from dataclasses import dataclass

from envgen_usd.models.environment_profile import RoadLook
from envgen_usd.models.road_surface import Patch
from envgen_usd.seeds import Draws


@dataclass(frozen=True)
class StreetMaterials:
    """Materials of a road or a junction.

    Attributes:
        lanes: Of lanes that cars drive on.
        sidewalk: Of sidewalks.
        kerb: Of kerbs.
    """

    lanes: str
    sidewalk: str
    kerb: str


def street_materials(patch: Patch, look: RoadLook, seed: int) -> StreetMaterials:
    """Returns the materials of the street that a patch belongs to.

    All patches of a road outside junctions agree in all chunks, and so do those of a junction.

    Args:
        patch: Any patch.
        look: Weights of the environment.
        seed: The user's seed.
    """
    kind, name = ("junction", patch.junction) if patch.junction else ("road", patch.road)
    draws = Draws(seed, "street materials", kind, name)
    return StreetMaterials(
        lanes=draws.choice("lanes", look.materials),
        sidewalk=draws.choice("sidewalk", look.sidewalk_materials),
        kerb=draws.choice("kerb", look.kerb_materials),
    )
