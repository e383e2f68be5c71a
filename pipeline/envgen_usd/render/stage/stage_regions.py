"""Parts of a stage that are read together."""

from dataclasses import dataclass
from functools import cached_property

from envgen_usd.models.array_types import FloatArray
from envgen_usd.render.render_scene import Geometry, Merged, Use
from envgen_usd.render.stage.merged_meshes import merge
from envgen_usd.render.stage.placed_parts import Template


@dataclass(frozen=True)
class Region:
    """A prim whose children are payloads.

    Attributes:
        number: Number of the region in the order of the stage; 0 is what is in no payload.
        bounds: 2 x 3, minimum and maximum corner, world.
        size: Bytes of its content.
    """

    number: int
    bounds: FloatArray
    size: int = 0


@dataclass(frozen=True)
class Content:
    """Geometry of a region.

    Attributes:
        geometries: Meshes.
        uses: Their placements.
        templates: Keeps the prototypes alive that it shares.
        known: Its merged meshes, if a file holds them.
    """

    geometries: tuple[Geometry, ...]
    uses: tuple[Use, ...]
    templates: tuple[Template, ...] = ()
    known: Merged | None = None

    @cached_property
    def merged(self) -> Merged:
        """Meshes that are placed a few times, merged."""
        return self.known or merge(self.geometries, self.uses)

    @cached_property
    def size(self) -> int:
        """Bytes of the arrays; shared prototypes count for each region."""
        arrays = ((each.points, each.normals, each.uvs, each.triangles) for each in self.geometries)
        own = sum(array.nbytes for group in arrays for array in group)
        return own + sum(use.matrices.nbytes for use in self.uses)
