"""Interface of all landuse sources: rules, a network, or a file."""

from collections.abc import Sequence
from typing import Protocol

from envgen_usd.chunks import Chunk
from envgen_usd.models.environment_profile import Profile
from envgen_usd.models.landuse import LanduseMap
from envgen_usd.models.road_surface import RoadSurface


class LanduseProvider(Protocol):
    """Generates the landuse beside a road."""

    def generate(
        self, surface: RoadSurface, chunks: Sequence[Chunk], profile: Profile, seed: int
    ) -> dict[Chunk, LanduseMap]:
        """Returns the landuse of chunks.

        A chunk's landuse depends on the road, the profile and the seed, but not on the other
        requested chunks.

        Args:
            surface: The whole road.
            chunks: Tiles.
            profile: Environment.
            seed: The user's seed.
        """
        ...
