"""What every source of landuse offers: rules, a network, or a file."""

from collections.abc import Sequence
from typing import Protocol

from envgen_usd.chunks import Chunk
from envgen_usd.models.landuse import LanduseMap
from envgen_usd.models.profile import Profile
from envgen_usd.models.surface import RoadSurface


class LanduseProvider(Protocol):
    """Makes the landuse beside a road."""

    def generate(
        self, surface: RoadSurface, chunks: Sequence[Chunk], profile: Profile, seed: int
    ) -> dict[Chunk, LanduseMap]:
        """Returns the landuse of chunks.

        A chunk's landuse follows from the road, the profile and the seed; it does not depend on
        which other chunks are asked for.

        Args:
            surface: The whole road.
            chunks: Tiles.
            profile: Environment.
            seed: The user's seed.
        """
        ...
