"""The scene that all objects of a chunk share."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from envgen_usd.chunks import Chunk
from envgen_usd.city.buildings.level_of_detail import FINEST_MODELLING, Modelling
from envgen_usd.city.footprints import Footprints
from envgen_usd.city.ground_heights import Ground
from envgen_usd.city.road_plan import RoadPlan
from envgen_usd.city.roads.road_index import RoadIndex


@dataclass(frozen=True)
class Scene:
    """A chunk and its existing objects.

    Attributes:
        chunk: The tile.
        roads: All roads of the map.
        road: The roads near the chunk, in plan.
        taken: What stands in the chunk and around it, in plan.
        ground: Heights of the chunk and around it.
        seed: The user's seed.
        modelling: Options of the building models.
        furnished: Ids of the roads that have each kind of object already.
    """

    chunk: Chunk
    roads: RoadIndex
    road: RoadPlan
    taken: Footprints
    ground: Ground
    seed: int
    modelling: Modelling = FINEST_MODELLING
    furnished: Mapping[str, frozenset[str]] = field(default_factory=dict)

    def has(self, kind: str, road: str) -> bool:
        """True if a road has objects of a kind, so that none are generated."""
        return road in self.furnished.get(kind, ())
