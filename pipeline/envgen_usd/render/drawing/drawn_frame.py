"""What a renderer is asked for, and what it returns. Needs no OpenGL."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from envgen_usd.models.array_types import ByteArray, IntArray
from envgen_usd.models.atmosphere import Atmosphere
from envgen_usd.render.cameras.camera_pose import Pose
from envgen_usd.render.cameras.camera_response import ideal_picture
from envgen_usd.render.lighting.headlamps import Headlamps
from envgen_usd.render.render_scene import Floats, Moment


@dataclass(frozen=True)
class FrameRequest:
    """A pose and the images that are wanted of it. Labels and depth are always drawn.

    Attributes:
        pose: Pose of the camera.
        atmosphere: Light; `None` for that of the stage.
        colour: True to draw colours.
        normals: True to draw normals.
        headlamps: Headlamps of the vehicle, which light the dark; `None` for none.
        moment: Where moving bodies are; `None` for the start of the stage.
    """

    pose: Pose
    atmosphere: Atmosphere | None = None
    colour: bool = True
    normals: bool = False
    headlamps: Headlamps | None = None
    moment: Moment | None = None


@dataclass(frozen=True)
class Frame:
    """Images of a pose, first row at the top.

    Attributes:
        radiance: H x W x 3, linear RGB; a white surface on open ground has 1. Empty if it was not
            drawn.
        scene_objects: H x W, index into `Scene.scene_objects` at each pixel's centre.
        depth: H x W, metres along the optical axis; 0 in the sky.
        white: Illuminance in klx of a white surface with a radiance of 1.
        rain: Rate of rain, mm/h.
        normals: H x W x 3, unit normals of the surfaces along the camera's axes (x right, y down, z
            ahead), towards the camera; 0 in the sky. `None` if they were not drawn.
        bodies: H x W, number of the moving body at each pixel's centre, -1 for what stands still;
            `None` on a stage where nothing moves.
    """

    radiance: Floats
    scene_objects: NDArray[np.uint32]
    depth: Floats
    white: float = 100.0
    rain: float = 0.0
    normals: Floats | None = None
    bodies: IntArray | None = None

    @property
    def rgb(self) -> ByteArray:
        """The picture of an ideal camera, H x W x 3, sRGB."""
        return ideal_picture(self.radiance)
