"""Boxes are found block by block; the truth tests each box by itself."""

import numpy as np
import pytest

from envgen_usd.render.opengl.box_blocks import BoxBlocks


def boxes_of(rng, count=4000):
    """Boxes of all sizes over a map of 600 m, some of them long and some flat."""
    middles = rng.uniform((-300, -300, -5), (300, 300, 40), (count, 3))
    halves = rng.uniform(0.05, 4.0, (count, 3)) * rng.choice((1.0, 1.0, 30.0), (count, 1))
    return np.stack((middles - halves, middles + halves), axis=1)


def touching(boxes, planes, point, reach):
    """By the corner of each box that lies farthest within a plane, and by its nearest point."""
    low, high = boxes[:, 0] - point, boxes[:, 1] - point
    found = np.ones(len(boxes), bool)
    for plane in planes:
        corner = np.where(plane[:3] > 0.0, high, low)
        found &= corner @ plane[:3] + plane[3] >= 0.0
    return found & (np.linalg.norm(np.clip(0.0, low, high), axis=1) <= reach)


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("reach", [np.inf, 150.0])
def test_the_boxes_within_planes_and_reach_are_found(seed, reach):
    rng = np.random.default_rng(seed)
    boxes, point = boxes_of(rng), rng.uniform((-200, -200, 0), (200, 200, 10))
    normals = rng.standard_normal((rng.integers(1, 6), 3))
    planes = np.column_stack((normals, rng.uniform(-20, 60, len(normals))))
    found = BoxBlocks(boxes).touching(planes, point, reach)
    assert found.tolist() == touching(boxes, planes, point, reach).tolist()


def test_a_plane_beyond_everything_keeps_all_or_nothing():
    boxes = boxes_of(np.random.default_rng(1), 50)
    blocks, up = BoxBlocks(boxes), np.array([[0.0, 0.0, 1.0, 1e3]])
    assert blocks.touching(up, np.zeros(3)).all()
    assert not blocks.touching(-up, np.zeros(3)).any()


def test_a_single_box_is_a_block():
    box = np.array([[[0.0, 0.0, 0.0], [500.0, 1.0, 1.0]]])
    planes = np.array([[1.0, 0.0, 0.0, -400.0]])
    assert BoxBlocks(box).touching(planes, np.zeros(3)).tolist() == [True]
    assert BoxBlocks(box).touching(planes - [[0, 0, 0, 200.0]], np.zeros(3)).tolist() == [False]


def test_every_box_is_a_member_of_one_block_whose_outline_holds_it():
    boxes = boxes_of(np.random.default_rng(2), 500)
    blocks = BoxBlocks(boxes)
    members = [blocks.members(chosen) for chosen in np.eye(len(blocks.outlines), dtype=bool)]
    assert sorted(np.concatenate(members).tolist()) == list(range(500))
    for numbers, (low, high) in zip(members, blocks.outlines, strict=True):
        assert (boxes[numbers, 0] >= low).all()
        assert (boxes[numbers, 1] <= high + 1e-9).all()


def test_groups_are_found_as_wholes_where_they_moved_and_hidden_ones_nowhere():
    boxes = boxes_of(np.random.default_rng(3), 300)
    groups = np.where(np.arange(300) < 60, np.arange(300) % 3, -1)
    blocks = BoxBlocks(boxes, groups)
    low = np.array([[900.0, 0, 0], [-900.0, 0, 0], [np.nan] * 3])
    blocks.move(np.stack((low, low + 1.0), axis=1))
    east = blocks.touching(np.array([[1.0, 0.0, 0.0, -800.0]]), np.zeros(3))
    assert np.flatnonzero(east).tolist() == np.flatnonzero(groups == 0).tolist()
    near = blocks.touching(np.array([[0.0, 0.0, 1.0, 1e3]]), np.zeros(3), 895.0)
    assert not near[groups >= 0].any()
    assert near[groups < 0].all()
