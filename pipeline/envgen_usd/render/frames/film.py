"""What turns the drawn light of a frame into its picture."""

from dataclasses import dataclass

from envgen_usd.models.array_types import BoolArray, ByteArray
from envgen_usd.render.cameras.camera_response import (
    IDEAL,
    camera_picture,
    draw_settings,
    ideal_picture,
)
from envgen_usd.render.cameras.rain_streaks import add_rain
from envgen_usd.render.cameras.sensor_rig import MountedCamera
from envgen_usd.render.drawing.drawn_frame import Frame
from envgen_usd.render.frames.frame_light import FrameLight
from envgen_usd.seeds import generator

OPENGL, MITSUBA = "opengl", "mitsuba"
ENGINES = (OPENGL, MITSUBA)
"""Names of the option ``--engine``."""


@dataclass(frozen=True)
class Film:
    """Turns radiance into pictures.

    Attributes:
        lights: Light of the frames.
        camera: The camera.
        response: ``camera`` or ``ideal``.
        seed: Seed of the camera's settings and noise.
        outputs: Kinds of images.
        engine: ``opengl`` or ``mitsuba``.
        sensor: Name of the camera in a rig of several; these share settings, but no noise.
        inside: H x W, True within the image circle of the lens; `None` for the whole image.
    """

    lights: FrameLight
    camera: MountedCamera
    response: str
    seed: int
    outputs: frozenset[str]
    engine: str = OPENGL
    sensor: str = ""
    inside: BoolArray | None = None

    @property
    def is_traced(self) -> bool:
        """True if the path tracer makes the pictures."""
        return self.engine == MITSUBA and self.has_colour

    @property
    def has_colour(self) -> bool:
        """True if the pictures themselves are an output."""
        return "rgb" in self.outputs

    @property
    def has_normals(self) -> bool:
        """True if normals are an output."""
        return "normals" in self.outputs

    @property
    def has_boxes(self) -> bool:
        """True if boxes are an output."""
        return "boxes" in self.outputs

    @property
    def has_flow(self) -> bool:
        """True if optical flow is an output."""
        return "flow" in self.outputs

    def picture(self, number: int, frame: Frame) -> ByteArray:
        """Develops the radiance of a frame."""
        if self.response == IDEAL:
            return ideal_picture(frame.radiance)
        rng = generator(self.seed, "render", "camera", number)
        settings = draw_settings(rng)
        if self.sensor:
            rng = generator(self.seed, "render", f"noise {self.sensor}", number)
        rain = generator(self.seed, "render", f"rain {self.sensor}".strip(), number)
        radiance = add_rain(frame.radiance, frame.depth, self.camera, frame.rain, rain, self.inside)
        return camera_picture(radiance, settings, rng, self.inside, frame.white)
