"""Optical flow of a static world, from depth and two poses."""

import numpy as np

from envgen_usd.models.array_types import FloatArray
from envgen_usd.render.cameras.camera_pose import Pose
from envgen_usd.render.cameras.camera_rig import Camera
from envgen_usd.render.render_scene import Floats


def optical_flow(camera: Camera, depth: Floats, pose: Pose, following: Pose | None) -> Floats:
    """Where each pixel's surface is in the next frame, less where it is in this frame.

    The world does not move, so the flow is exact: the point at a pixel's centre is projected by the
    camera at its next pose. The sky is at infinity. What hides the point there does not count.

    Args:
        camera: The camera, with any lens.
        depth: H x W, metres as of the camera; 0 in the sky.
        pose: Pose of the frame.
        following: Pose of the next frame of the drive; `None` at its end.

    Returns:
        H x W x 2, pixels to the right and down; NaN where the point is not before the camera, and
        where there is no next frame.
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
    seen = camera.lens.project(points) * (camera.fx, camera.fy) + (camera.cx, camera.cy)
    flow = seen - np.column_stack((columns, rows))
    return flow.reshape(height, width, 2).astype(np.float32)
