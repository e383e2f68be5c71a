"""Where moving bodies are in a frame of a camera, and in the next."""

from dataclasses import dataclass

from envgen_usd.render.cameras.camera_pose import Pose
from envgen_usd.render.drawing.drawn_frame import Frame
from envgen_usd.render.frames.optical_flow import BodyMotion
from envgen_usd.render.frames.shots import Shot
from envgen_usd.render.render_scene import Moment
from envgen_usd.render.stage.moving_objects import MovingObjects


@dataclass(frozen=True)
class FrameMoments:
    """Moments of a frame and of the next; all `None` if nothing moves."""

    moving: MovingObjects | None
    now: Moment | None = None
    following: Moment | None = None

    def beside(self, pose: Pose) -> tuple[Moment, Moment] | None:
        """The moment and one beside it, for velocities."""
        if self.moving is None or self.now is None:
            return None
        return self.now, self.moving.at(self.moving.beside(pose.time))

    def motion(self, frame: Frame) -> BodyMotion | None:
        """Motion of each pixel's body to the next frame; `None` without one."""
        if self.moving is None or self.now is None or self.following is None:
            return None
        if frame.bodies is None:
            return None
        owners, surfaces = self.moving.parts.owners, self.moving.surfaces
        return BodyMotion.between(frame.bodies, owners, self.now, self.following, surfaces)


def frame_moments(shot: Shot, number: int, moving: MovingObjects | None) -> FrameMoments:
    """Moments of a frame and of the next; what overlaps the vehicle then is hidden."""
    if moving is None:
        return FrameMoments(None)
    pose, following = shot.poses[number], shot.following(number)
    then = moving.at(following.time, shot.vehicle(following)) if following else None
    return FrameMoments(moving, moving.at(pose.time, shot.vehicle(pose)), then)
