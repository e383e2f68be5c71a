"""Sets the material uniforms of shaders."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np

from envgen_usd.models.array_types import BoolArray, IntArray
from envgen_usd.render.opengl import gpu
from envgen_usd.render.opengl.gpu_textures import TextureTable
from envgen_usd.render.render_scene import Material

_COLOUR_UNIT = 0
_SURFACE_UNIT = 1
_EMISSION_UNIT = 8


class CutProgram:
    """A program for opaque materials, and its variant that tests for cut-outs."""

    def __init__(
        self, vertex: str, fragment: str, *names: str, geometry: str | None = None
    ) -> None:
        """Compiles both variants, with names defined for the preprocessor."""
        self._variants = {
            False: gpu.Program(vertex, fragment, *names, geometry=geometry),
            True: gpu.Program(vertex, fragment, *names, "CUT_OUT", geometry=geometry),
        }

    def set(self, **values: float | Sequence[float] | gpu.Matrix) -> None:
        """Sets uniforms of both variants."""
        for program in self._variants.values():
            program.use()
            program.set(**values)

    def use(self, *, cut: bool) -> gpu.Program:
        """Makes a variant current."""
        program = self._variants[cut]
        program.use()
        return program


@dataclass(frozen=True)
class _Kind:
    """What a variant of the colour program is compiled for."""

    is_foliage: bool
    uses_vertex_colour: int
    uses_surface_map: bool
    uses_emission_map: bool
    pattern: tuple[str, ...]

    @classmethod
    def of(cls, material: Material) -> "_Kind":
        """The kind of a material."""
        textures = material.textures
        mapped = "normal" in textures or "roughness" in textures
        colours = 1 if material.vertex_colour else 2 * int(material.tinted)
        glows = "emissive" in textures
        cut_out = cut_threshold(material) > 0.0
        return cls(cut_out, colours, mapped, glows, pattern_features(material))

    def names(self) -> list[str]:
        """Names for the preprocessor."""
        figures = ("is_foliage", "uses_vertex_colour", "uses_surface_map", "uses_emission_map")
        return [*(f"{name} {int(getattr(self, name))}" for name in figures), *self.pattern]


class ColourPrograms:
    """The programs of a fragment's colour: one for each kind of material and light."""

    def __init__(self, materials: Sequence[Material]) -> None:
        """Compiles nothing yet; a variant is compiled at its first use."""
        self._kinds = [_Kind.of(material) for material in materials]
        self._programs: dict[tuple[_Kind, tuple[str, ...]], gpu.Program] = {}
        self._light: tuple[str, ...] = ()
        self._uniforms: gpu.Uniforms = {}
        self._ready: set[_Kind] = set()

    def choose(self, uniforms: gpu.Uniforms, *, wet: bool, lamps: bool, sun: bool) -> None:
        """Decides about the programs of a frame; `of` chooses among them.

        Args:
            uniforms: Uniforms that all programs share.
            wet: True if water covers a share of the ground.
            lamps: True if lamps light the view.
            sun: True if the sun shines.
        """
        absent = {"wetness 0.0": not wet, "lamp_count 0": not lamps, "SUNLESS": not sun}
        self._light = tuple(name for name, is_absent in absent.items() if is_absent)
        self._uniforms, self._ready = uniforms, set()

    def of(self, material: int) -> gpu.Program:
        """Makes the program of a material current."""
        kind = self._kinds[material]
        program = self._program(kind)
        program.use()
        if kind not in self._ready:
            program.send(self._uniforms)
            self._ready.add(kind)
        return program

    def _program(self, kind: _Kind) -> gpu.Program:
        key = kind, self._light
        if key not in self._programs:
            names = *kind.names(), *self._light
            self._programs[key] = gpu.Program("mesh.vert", "colour.frag", *names)
        return self._programs[key]


def pattern_features(material: Material) -> tuple[str, ...]:
    """Names that ``colour.frag`` knows for bombing and wear; what is not named costs nothing."""
    wear, bombing = material.wear, material.bombing
    bombed = bombing.side > 0.0 and "diffuse" in material.textures
    bricks = bombed and min(bombing.unit) > 0.0
    needs = {
        "BRICKS": bricks,
        "PATCHES": bombed and not bricks,
        "GROUND": wear.stains > 0.0 or wear.lanes > 0.0,
        "LANES": wear.lanes > 0.0,
        "PAINT": wear.paint > 0.0 and wear.lanes > 0.0,
        "WALL": wear.foot > 0.0 or wear.streaks > 0.0,
    }
    return tuple(name for name, needed in needs.items() if needed)


class Looks:
    """The materials of a scene with their textures on the GPU.

    Attributes:
        units: Texture units by the names of their uniforms.
        cut_out: By material, True if its surfaces have gaps.
        alike: By material, one with the same gaps: all without gaps are drawn alike where colours
            do not matter.
    """

    units: ClassVar = {
        "colour_map": _COLOUR_UNIT,
        "surface_map": _SURFACE_UNIT,
        "emission_map": _EMISSION_UNIT,
    }

    def __init__(self, materials: Sequence[Material], kept: Path | None = None) -> None:
        """Uploads all textures, so that no later call changes the bindings of texture units.

        Args:
            materials: Looks.
            kept: Folder for textures as the GPU takes them.
        """
        self._materials = materials
        textures = TextureTable(kept)
        self._colours = [textures.colour(material) for material in materials]
        means = [textures.mean(handle) for handle in self._colours]
        self._uniforms = [_look(*each) for each in zip(materials, means, strict=True)]
        self.cut_out: BoolArray = np.array([cut_threshold(each) > 0.0 for each in materials], bool)
        own = np.arange(len(materials))
        solid = int(np.argmin(self.cut_out)) if len(materials) else 0
        self.alike: IntArray = np.where(self.cut_out, own, solid)
        self._surfaces = [textures.surface(material) for material in materials]
        self._emissions = [textures.emission(material) for material in materials]
        textures.close()

    def set_cut(self, programs: CutProgram, index: int) -> None:
        """Chooses the variant for a material, and sets its opacity test."""
        threshold = cut_threshold(self._materials[index])
        program = programs.use(cut=threshold > 0.0)
        if threshold > 0.0:
            program.set(threshold=threshold)
            gpu.bind_texture(_COLOUR_UNIT, self._colours[index])

    def set_look(self, programs: ColourPrograms, index: int) -> None:
        """Chooses the program of a material, and sets its uniforms."""
        programs.of(index).send(self._uniforms[index])
        gpu.bind_texture(_COLOUR_UNIT, self._colours[index])
        gpu.bind_texture(_SURFACE_UNIT, self._surfaces[index])
        gpu.bind_texture(_EMISSION_UNIT, self._emissions[index])


def _look(material: Material, mean: gpu.Value) -> gpu.Uniforms:
    """Uniforms of a material whose colour texture has a mean."""
    return gpu.encoded(
        {
            "base_colour": (1.0, 1.0, 1.0) if "diffuse" in material.textures else material.diffuse,
            "mean_colour": mean,
            "emissive": material.emissive,
            "metallic": material.metallic,
            "plain_roughness": material.roughness,
            **_pattern(material),
        }
    )


def _pattern(material: Material) -> dict[str, float | tuple[float, ...]]:
    """Uniforms of `texture_bombing.glsl` and `surface_wear.glsl`."""
    bombing, wear = material.bombing, material.wear
    return {
        "tile_size": material.size,
        "patch_side": bombing.side,
        "patch_turn": bombing.turn,
        "patch_unit": bombing.unit,
        "patch_bond": bombing.bond,
        "wear": (wear.lanes, wear.stains, wear.foot, wear.streaks),
        "paint_wear": wear.paint,
    }


def cut_threshold(material: Material) -> float:
    """Least opacity of a visible surface; 0 disables the test.

    A pixel has a single label, so partial transparency is not supported. An opacity texture without
    a threshold cuts at one half.
    """
    if "opacity" not in material.textures:
        return 0.0
    return material.opacity_threshold or 0.5
