"""Where materials with cut-outs (leaves) are solid."""

from collections.abc import Sequence

import numpy as np

from envgen_usd.models.array_types import BoolArray, IntArray
from envgen_usd.render.render_scene import Floats, Material
from envgen_usd.render.stage.texture_images import read_texture


class CutOuts:
    """Solid texels of all materials with an opacity threshold, in one array.

    Attributes:
        numbers: Numbers of these materials.
    """

    def __init__(self, materials: Sequence[Material]) -> None:
        """Reads the opacity of the materials."""
        cut = [n for n, material in enumerate(materials) if material.opacity_threshold > 0.0]
        self.numbers = frozenset(cut)
        self._first = np.zeros(len(materials), np.int64)
        self._sizes = np.ones((len(materials), 2), np.int64)
        self._repeats = np.ones((len(materials), 2), bool)
        masks, total = [np.empty(0, bool)], 0
        for number in cut:
            mask, repeat = _solid(materials[number])
            self._first[number] = total
            self._sizes[number] = mask.shape[1], mask.shape[0]
            self._repeats[number] = repeat
            masks.append(mask.reshape(-1))
            total += mask.size
        self._masks: BoolArray = np.concatenate(masks)

    def are_solid(self, materials: IntArray, uvs: Floats) -> BoolArray:
        """True where a surface has no gap.

        Args:
            materials: N, number of the material at each place.
            uvs: N x 2, texture coordinates, t up.
        """
        sizes, repeats = self._sizes[materials], self._repeats[materials]
        inside = np.where(repeats, uvs - np.floor(uvs), np.clip(uvs, 0.0, 1.0))
        texels = np.minimum((inside * sizes).astype(np.int64), sizes - 1)
        solid: BoolArray = self._masks[
            self._first[materials] + texels[:, 1] * sizes[:, 0] + texels[:, 0]
        ]
        return solid


def _solid(material: Material) -> tuple[BoolArray, tuple[bool, bool]]:
    """Solid texels, bottom row first, and whether they repeat along s and t."""
    cut = material.textures.get("opacity")
    if cut is None:
        return np.full((1, 1), material.opacity >= material.opacity_threshold), (True, True)
    opacity = read_texture(cut)[..., cut.channel]
    return opacity >= np.ceil(255.0 * material.opacity_threshold), cut.repeat
