"""Smooths edges: a second sample of the geometry at the corners of pixels.

Each pixel weighs its centre by a half and its four corners by an eighth, as NVIDIA's Quincunx
(2001). As in multisampling, a surface is shaded once a pixel: a corner takes its colour from the
pixel beside it that shows the same surface.
"""

from dataclasses import dataclass, replace

from OpenGL import GL as gl  # noqa: N811

from envgen_usd.models.array_types import BoolArray, FloatArray
from envgen_usd.render.cameras.camera_rig import Camera
from envgen_usd.render.drawing.label_pass import LabelTarget
from envgen_usd.render.opengl import gpu
from envgen_usd.render.opengl.draw_list import DrawList
from envgen_usd.render.opengl.shader_looks import Looks


@dataclass(frozen=True)
class EdgeInput:
    """What is known at the centres of pixels.

    Attributes:
        pixels: Labels and depth.
        colours: Texture of the colours.
        openness: Texture of what covers pixels in part.
    """

    pixels: gpu.Target
    colours: int
    openness: int


class EdgeSamples:
    """Samples at the corners of a camera's pixels."""

    def __init__(self, camera: Camera, draws: DrawList, looks: Looks) -> None:
        """Creates textures with a row and a column more than the image."""
        self.camera = replace(
            camera,
            width=camera.width + 1,
            height=camera.height + 1,
            cx=camera.cx + 0.5,
            cy=camera.cy + 0.5,
        )
        size = self.camera.width, self.camera.height
        self._corners = LabelTarget(size, draws, looks, with_planes=True)
        self._coloured = gpu.render_target(size, (gl.GL_RGBA16F,))
        self._resolved = gpu.render_target((camera.width, camera.height), (gl.GL_RGBA16F,))
        self._choose = gpu.Program("screen.vert", "corner_colours.frag")
        self._mean = gpu.Program("screen.vert", "edge_mean.frag")

    def smooth(self, shown: EdgeInput, clip: FloatArray, seen: BoolArray) -> gpu.Target:
        """The weighted mean of the pixels' colours and the corners' colours.

        Args:
            shown: The pixels' centres.
            clip: 4 x 4, clip matrix of `camera`; the draw list already looks from there.
            seen: N, instances at the pixels' centres.
        """
        self._corners.clear()
        self._corners.draw(clip, seen)
        gl.glDisable(gl.GL_DEPTH_TEST)
        labels = (*shown.pixels.colours, *self._corners.target.colours)
        names = ("pixel_labels", "pixel_depth", "corner_labels", "corner_planes")
        textures = dict(zip(names, labels, strict=True))
        self._coloured.bind()
        _draw_screen(
            self._choose, {**textures, "colours": shown.colours, "openness": shown.openness}
        )
        self._resolved.bind()
        coloured = {"centres": shown.colours, "corners": self._coloured.colours[0]}
        coloured |= {name: textures[name] for name in ("pixel_depth", "corner_planes")}
        _draw_screen(self._mean, {**coloured, "openness": shown.openness})
        return self._resolved


def _draw_screen(program: gpu.Program, textures: dict[str, int]) -> None:
    program.use()
    for unit, (name, texture) in enumerate(textures.items()):
        gpu.bind_texture(unit, texture)
        program.set(**{name: unit})
    gl.glDrawArrays(gl.GL_TRIANGLES, 0, 3)
