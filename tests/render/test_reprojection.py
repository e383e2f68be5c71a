"""What a frame shows is where its depth says: the next frame shows the same there."""

from itertools import pairwise

import numpy as np

from envgen_usd.render.frames.frame_export import render_frames
from envgen_usd.render.frames.frame_set import read_frames
from envgen_usd.render.trajectories.trajectory import Trajectory


def test_depth_leads_to_the_same_label_in_the_next_frame(opengl, street, tmp_path):
    assert opengl
    outputs = "semantic", "depth"
    render_frames(street, tmp_path, 4, trajectory=Trajectory("drive", 1.0), outputs=outputs)
    frames = read_frames(tmp_path)
    camera = frames.camera
    same, shown = [], []
    for here, there in pairwise(frames):
        row, column = np.nonzero(here.depth)
        depth = here.depth[row, column].astype(float)
        across = (column - camera.cx) / camera.fx * depth
        down = (row - camera.cy) / camera.fy * depth
        place = np.stack((across, down, depth, np.ones_like(depth)))
        x, y, z, _ = np.linalg.inv(there.camera_to_world) @ here.camera_to_world @ place
        ahead = np.flatnonzero(z > camera.near)
        right = np.round(camera.fx * x[ahead] / z[ahead] + camera.cx).astype(int)
        low = np.round(camera.fy * y[ahead] / z[ahead] + camera.cy).astype(int)
        seen = (right >= 0) & (right < camera.width) & (low >= 0) & (low < camera.height)
        ahead, right, low = ahead[seen], right[seen], low[seen]
        # What something else hides by now is nearer there.
        shown.append(np.abs(there.depth[low, right] - z[ahead]) < 0.02 + 0.01 * z[ahead])
        labels = here.semantic[row[ahead], column[ahead]], there.semantic[low, right]
        same.append(labels[0] == labels[1])
    seen = np.concatenate(shown)
    assert seen.mean() > 0.9
    assert np.concatenate(same)[seen].mean() > 0.995
