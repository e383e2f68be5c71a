"""Optical flow from depth, two poses, and the motion of each pixel's body."""

from dataclasses import dataclass

import numpy as np

from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.render.cameras.camera_pose import Pose
from envgen_usd.render.cameras.camera_rig import Camera
from envgen_usd.render.limb_motion import LimbMotion, PoseSurfaces
from envgen_usd.render.render_scene import Floats, Moment


@dataclass(frozen=True)
class BodyMotion:
    """What moves from a frame to the next.

    Attributes:
        bodies: H x W, number of the body at each pixel; -1 for what stands still.
        motions: K x 4 x 4, from the place of a body's points in this frame to that in the next,
            world; not a number for a body that is not there any more.
        limbs: What bends; `None` if nothing does.
    """

    bodies: IntArray
    motions: FloatArray
    limbs: LimbMotion | None = None

    @classmethod
    def between(
        cls,
        bodies: IntArray,
        owners: IntArray,
        moment: Moment,
        following: Moment,
        surfaces: PoseSurfaces | None = None,
    ) -> "BodyMotion":
        """The motion between two moments.

        A body that is hidden in the next frame moves on if another body of its object is shown:
        the phases of a walk replace each other. Where both are poses of the same mesh, each point
        moves to its place in the next pose.

        Args:
            bodies: H x W, as in the class.
            owners: K, object of each body.
            moment: Moment of this frame.
            following: Moment of the next frame.
            surfaces: Surfaces of the bodies; `None` keeps all bodies rigid.
        """
        motions = np.full_like(moment.matrices, np.nan)
        there = np.isin(owners, owners[following.shown]) & moment.shown
        motions[there] = following.matrices[there] @ np.linalg.inv(moment.matrices[there])
        if surfaces is None:
            return cls(bodies, motions)
        successors = surfaces.successors(moment, following)
        return cls(bodies, motions, LimbMotion(surfaces, successors, moment, following))


def optical_flow(
    camera: Camera,
    depth: Floats,
    pose: Pose,
    following: Pose | None,
    motion: BodyMotion | None = None,
) -> Floats:
    """Where each pixel's surface is in the next frame, less where it is in this frame.

    The flow is exact: the point at a pixel's centre moves with its body, or with the triangle of a
    body that bends, and is projected by the camera at its next pose. The sky is at infinity. What
    hides the point there does not count.

    Args:
        camera: The camera, with any lens.
        depth: H x W, metres as of the camera; 0 in the sky.
        pose: Pose of the frame.
        following: Pose of the next frame of the drive; `None` at its end.
        motion: What moves; `None` if nothing does.

    Returns:
        H x W x 2, pixels to the right and down; NaN where the point is not before the camera, and
        where there is no next frame, or the body is gone in it.
    """
    height, width = depth.shape
    if following is None:
        return np.full((height, width, 2), np.nan, np.float32)
    rows, columns = np.indices((height, width)).reshape(2, -1)
    places = np.column_stack(((columns - camera.cx) / camera.fx, (rows - camera.cy) / camera.fy))
    directions = camera.lens.directions(places)
    metres = depth.reshape(-1).astype(np.float64)
    along = np.ones(len(metres)) if camera.lens.has_ranges else directions[:, 2]
    # A point at infinity moves with the rotation alone: its distance is 1 and it has no offset.
    is_sky = metres == 0.0
    reach = np.where(is_sky, 1.0, metres / along)
    turn = np.linalg.inv(following.matrix) @ pose.matrix
    points: FloatArray = directions * reach[:, None] @ turn[:3, :3].T
    points += np.where(is_sky[:, None], 0.0, turn[:3, 3])
    if motion is not None:
        moving = np.flatnonzero(motion.bodies.reshape(-1) >= 0)
        turns = np.linalg.inv(following.matrix) @ motion.motions @ pose.matrix
        own = turns[motion.bodies.reshape(-1)[moving]]  # M x 4 x 4
        here = directions[moving] * reach[moving, None]
        points[moving] = np.einsum("nij,nj->ni", own[:, :3, :3], here) + own[:, :3, 3]
        if motion.limbs is not None:
            world = here @ pose.matrix[:3, :3].T + pose.matrix[:3, 3]
            bent, there = motion.limbs.moved(world, motion.bodies.reshape(-1)[moving])
            back = np.linalg.inv(following.matrix)
            points[moving[bent]] = there @ back[:3, :3].T + back[:3, 3]
    seen = camera.lens.project(points) * (camera.fx, camera.fy) + (camera.cx, camera.cy)
    flow = seen - np.column_stack((columns, rows))
    return flow.reshape(height, width, 2).astype(np.float32)
