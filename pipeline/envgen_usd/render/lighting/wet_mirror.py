"""Mirrored houses, trees and lamps in wet ground."""

from OpenGL import GL as gl  # noqa: N811

from envgen_usd.render.cameras.camera_pose import Pose
from envgen_usd.render.cameras.camera_rig import Camera
from envgen_usd.render.lighting.sky_texture import SkyTexture
from envgen_usd.render.opengl import gpu


class WetMirror:
    """Replaces the mirrored sky by what the picture shows in the mirrored direction."""

    def __init__(self, camera: Camera) -> None:
        """Creates a picture of the camera's size."""
        self._camera = camera
        self._program = gpu.Program("screen.vert", "wet_mirror.frag")
        self._target = gpu.render_target((camera.width, camera.height), (gl.GL_RGBA16F,))

    def draw(self, picture: gpu.Target, depth: int, sky: SkyTexture, pose: Pose) -> gpu.Target:
        """Returns the picture with mirrored images.

        Args:
            picture: Colours; alpha is the share of mirrored light in a pixel.
            depth: Texture of depth along the optical axis, metres.
            sky: Light of the frame.
            pose: Pose of the camera.
        """
        gl.glDisable(gl.GL_DEPTH_TEST)
        gpu.bind_texture(0, picture.colours[0])
        gpu.bind_texture(1, depth)
        self._target.bind()
        self._program.use()
        self._program.set(
            **sky.bind(),
            **self._camera.lens_uniforms(),
            camera_axes=pose.matrix[:3, :3],
            colours=0,
            depth_map=1,
        )
        gl.glDrawArrays(gl.GL_TRIANGLES, 0, 3)
        return self._target
