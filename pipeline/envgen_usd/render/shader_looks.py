"""Sets the material uniforms of shaders."""

from collections.abc import Sequence

from envgen_usd.render import gpu
from envgen_usd.render.gpu_textures import TextureTable
from envgen_usd.render.render_scene import Material

COLOUR_UNIT = 0
SURFACE_UNIT = 1


class Looks:
    """The materials of a scene with their textures on the GPU."""

    def __init__(self, materials: Sequence[Material]) -> None:
        """Uploads all textures, so that no later call changes the bindings of texture units."""
        self._materials = materials
        textures = TextureTable()
        self._colours = [textures.colour(material) for material in materials]
        self._surfaces = [textures.surface(material) for material in materials]

    def set_cut(self, program: gpu.Program, index: int) -> None:
        """Sets the opacity test of a fragment."""
        material = self._materials[index]
        threshold = cut_threshold(material)
        program.set(threshold=threshold)
        if threshold > 0.0:
            gpu.bind_texture(COLOUR_UNIT, self._colours[index])

    def set_look(self, program: gpu.Program, index: int) -> None:
        """Sets all uniforms of a fragment's colour."""
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
    """Least opacity of a visible surface; 0 disables the test.

    A pixel has a single label, so partial transparency is not supported. An opacity texture without
    a threshold cuts at one half.
    """
    if "opacity" not in material.textures:
        return 0.0
    return material.opacity_threshold or 0.5
