"""What the land around depends on, of the roads of a part of a map."""

from dataclasses import dataclass

from envgen_usd.chunks import Chunk
from envgen_usd.errors import Issue
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.frozen_model import Model
from envgen_usd.models.road_surface import LaneLine


@dataclass(frozen=True, repr=False, eq=False)
class RoadPiece(Model):
    """The roads of a region, as far as the land of other regions depends on them.

    Attributes:
        edges: E x 2 x 3, metres, edges of the outline in the region, the road to their left.
        decks: T x 3 x 3, metres, triangles of bridges and tunnels in the region.
        chunks: Chunks, also of other regions, that have land beside these roads.
        lanes: Lanes of the roads whose middle lies in the region.
        issues: Issues of these roads, and of junctions whose first road is one of them.
    """

    edges: FloatArray
    decks: FloatArray
    chunks: tuple[Chunk, ...]
    lanes: tuple[LaneLine, ...]
    issues: tuple[Issue, ...]
