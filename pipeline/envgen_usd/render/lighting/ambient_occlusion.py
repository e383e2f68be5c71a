"""Ambient occlusion and sky visibility of each pixel, from depth and from a height map."""

from OpenGL import GL as gl  # noqa: N811

from envgen_usd.render.cameras.camera_pose import Pose
from envgen_usd.render.cameras.camera_rig import Camera
from envgen_usd.render.lighting.height_map import HeightMap
from envgen_usd.render.opengl import gpu


class Occlusion:
    """Screen-space ambient occlusion, and the sky's share that houses and trees leave visible."""

    def __init__(self, camera: Camera) -> None:
        """Creates textures of half the camera's size, and one of its size."""
        self._camera = camera
        self._gather = gpu.Program("screen.vert", "occlusion.frag")
        self._smooth = gpu.Program("screen.vert", "smooth.frag")
        self._fill_in = gpu.Program("screen.vert", "fill_in.frag")
        size = camera.width, camera.height
        half = (size[0] + 1) // 2, (size[1] + 1) // 2
        self._rough = gpu.render_target(half, (gl.GL_RG8,))
        self._smoothed = gpu.render_target(half, (gl.GL_RG8,))
        self._whole = gpu.render_target(size, (gl.GL_RG8,))

    @property
    def result(self) -> int:
        """Texture: ambient occlusion in red, sky visibility in green; 1 means unoccluded."""
        return self._whole.colours[0]

    def draw(self, depth: int, heights: HeightMap, pose: Pose) -> None:
        """Computes the occlusion of a frame.

        Args:
            depth: Texture of depth along the optical axis, metres.
            heights: Heights around the camera.
            pose: Pose of the camera.
        """
        gl.glDisable(gl.GL_DEPTH_TEST)
        eye = pose.matrix[:3, 3]
        gpu.bind_texture(0, depth)
        gpu.bind_texture(1, heights.texture)
        self._rough.bind()
        self._gather.use()
        self._gather.set(
            **self._camera.lens_uniforms(),
            camera_axes=pose.matrix[:3, :3],
            depth_map=0,
            height_map=1,
            **heights.uniforms(eye),
        )
        gl.glDrawArrays(gl.GL_TRIANGLES, 0, 3)
        for target, program, name, source in (
            (self._smoothed, self._smooth, "rough_map", self._rough),
            (self._whole, self._fill_in, "half_map", self._smoothed),
        ):
            gpu.bind_texture(1, source.colours[0])
            target.bind()
            program.use()
            program.set(depth_map=0, **{name: 1})
            gl.glDrawArrays(gl.GL_TRIANGLES, 0, 3)
