"""Sets what shaders need to know of a material."""

from collections.abc import Sequence

from envgen_usd.render import gpu
from envgen_usd.render.scene import Material
from envgen_usd.render.textures import TextureTable

COLOUR_UNIT = 0
SURFACE_UNIT = 1


class Looks:
    """The materials of a scene with their textures on the graphics card."""

    def __init__(self, materials: Sequence[Material]) -> None:
        """Uploads all textures, so that no later call changes what texture units hold."""
        self._materials = materials
        textures = TextureTable()
        self._colours = [textures.colour(material) for material in materials]
        self._surfaces = [textures.surface(material) for material in materials]

    def set_cut(self, program: gpu.Program, index: int) -> None:
        """Sets what decides whether a fragment is there."""
        material = self._materials[index]
        threshold = cut_threshold(material)
        program.set(threshold=threshold)
        if threshold > 0.0:
            gpu.bind_texture(COLOUR_UNIT, self._colours[index])

    def set_look(self, program: gpu.Program, index: int) -> None:
        """Sets everything that a fragment's colour follows from."""
        material = self._materials[index]
        textures = material.textures
        program.set(
            base_colour=(1.0, 1.0, 1.0) if "diffuse" in textures else material.diffuse,
            emissive=material.emissive,
            metallic=material.metallic,
            plain_roughness=material.roughness,
            is_foliage=int(cut_threshold(material) > 0.0),
            uses_vertex_colour=int(material.vertex_colour),
            uses_surface_map=int("normal" in textures or "roughness" in textures),
        )
        gpu.bind_texture(COLOUR_UNIT, self._colours[index])
        gpu.bind_texture(SURFACE_UNIT, self._surfaces[index])


def cut_threshold(material: Material) -> float:
    """Least opacity at which a surface is there; 0 where it always is.

    Pixels have one label each, so nothing is see-through in part: an opacity texture without a
    threshold cuts at one half.
    """
    if "opacity" not in material.textures:
        return 0.0
    return material.opacity_threshold or 0.5
