"""How much of the sky each pixel's surface sees, from depth and from a map of heights."""

import numpy as np
from OpenGL import GL as gl  # noqa: N811

from envgen_usd.render import gpu
from envgen_usd.render.rig import Camera, Pose
from envgen_usd.render.shadows import DEPTH, HEIGHTS, ShadowView


class Occlusion:
    """Ambient occlusion in corners, and the share of the sky that houses and trees leave free."""

    def __init__(self, camera: Camera) -> None:
        """Makes two textures of the camera's size."""
        self._camera = camera
        self._gather = gpu.Program("screen.vert", "occlusion.frag")
        self._smooth = gpu.Program("screen.vert", "smooth.frag")
        size = camera.width, camera.height
        self._rough = gpu.render_target(size, (gl.GL_RG8,))
        self._smoothed = gpu.render_target(size, (gl.GL_RG8,))

    @property
    def result(self) -> int:
        """Texture: corners' light in red, the sky's share in green, 1 where nothing is hidden."""
        return self._smoothed.colours[0]

    def draw(self, depth: int, heights: int, above: ShadowView, pose: Pose) -> None:
        """Works out the occlusion of one frame.

        Args:
            depth: Texture with metres along the optical axis.
            heights: Depth texture, seen from above.
            above: The view of that texture.
            pose: Of the camera.
        """
        gl.glDisable(gl.GL_DEPTH_TEST)
        eye = pose.matrix[:3, 3]
        gpu.bind_texture(0, depth)
        gpu.bind_texture(1, heights)
        self._rough.bind()
        self._gather.use()
        self._gather.set(
            **self._camera.lens_uniforms(),
            camera_axes=pose.matrix[:3, :3],
            depth_map=0,
            height_map=1,
            heights_clip=above.clip_from(eye),
            heights_range=(float(above.middle[2] - eye[2]), DEPTH),
            heights_side=2.0 * HEIGHTS.reach,
        )
        gl.glDrawArrays(gl.GL_TRIANGLES, 0, 3)
        gpu.bind_texture(1, self._rough.colours[0])
        self._smoothed.bind()
        self._smooth.use()
        self._smooth.set(
            **self._camera.lens_uniforms(), camera_axes=np.eye(3), depth_map=0, rough_map=1
        )
        gl.glDrawArrays(gl.GL_TRIANGLES, 0, 3)
