"""What all that stands in a chunk has to know."""

from dataclasses import dataclass

from envgen_usd.chunks import Chunk
from envgen_usd.city.building import FINEST_MODELLING, Modelling
from envgen_usd.city.footprints import Footprints
from envgen_usd.city.ground import Ground
from envgen_usd.city.obstacles import RoadPlan
from envgen_usd.models.surface import RoadSurface


@dataclass(frozen=True)
class Scene:
    """A chunk and what stands in it already.

    Attributes:
        chunk: The tile.
        surface: All roads of the map.
        road: The roads near the chunk, in plan.
        taken: What stands in the chunk and around it, in plan.
        ground: Heights of the chunk and around it.
        seed: The user's seed.
        modelling: How buildings are modelled.
    """

    chunk: Chunk
    surface: RoadSurface
    road: RoadPlan
    taken: Footprints
    ground: Ground
    seed: int
    modelling: Modelling = FINEST_MODELLING
