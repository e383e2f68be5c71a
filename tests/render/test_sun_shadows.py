"""Squares of the shadow maps, for a sun from anywhere."""

import numpy as np
import pytest

from envgen_usd.render.lighting.sun_shadows import CASCADES, DEPTH, cascades_for, shadow_view

TOWARDS = [
    (x, y, z) for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1) if (x, y, z) != (0, 0, 0)
]


@pytest.mark.parametrize("cascade", CASCADES)
@pytest.mark.parametrize("towards", TOWARDS)
def test_a_shadow_map_keeps_lengths_whatever_the_direction_of_the_sun(cascade, towards):
    """Clip space times half the square and the depth range is a rotation of the world."""
    view = shadow_view(cascade, np.eye(4), np.array(towards, dtype=float))
    axes = view.clip[:3, :3] * np.array([[cascade.reach], [cascade.reach], [DEPTH]])
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(axes) == pytest.approx(1)
    np.testing.assert_allclose(axes[2], -np.array(towards) / np.linalg.norm(towards), atol=1e-12)


def test_a_shadow_map_is_seen_alike_from_any_camera():
    view = shadow_view(CASCADES[1], np.eye(4), np.array([0.3, -0.2, 0.9]))
    eye, point = np.array([3.0, -8.0, 1.5]), np.array([12.0, 5.0, -2.0])
    clip = view.clip @ [*(point - view.middle), 1]
    np.testing.assert_allclose(view.clip_from(eye) @ [*(point - eye), 1], clip, atol=1e-12)


@pytest.mark.parametrize("cascade", CASCADES)
@pytest.mark.parametrize("heading", [0.0, 0.7, 2.5, -1.9])
def test_a_shadow_map_lies_before_the_camera_and_moves_by_whole_texels(cascade, heading):
    towards = np.array([0.3, -0.2, 0.9])
    pose, ahead = np.eye(4), np.array([np.cos(heading), np.sin(heading), 0.0])
    # The camera looks down by 30 degrees.
    pose[:3, 2] = ahead * np.cos(np.pi / 6) - np.array([0.0, 0.0, np.sin(np.pi / 6)])
    start = shadow_view(cascade, pose, towards)
    assert start.texel == pytest.approx(2 * cascade.reach / cascade.side)
    grid = max(cascade.step, start.texel)
    for place in ([0.0, 0.0, 0.0], [0.4, 0.1, 0.0], [61.0, -35.0, 2.0]):
        pose[:3, 3] = place
        view = shadow_view(cascade, pose, towards)
        aside = view.clip[:3, :3] @ (np.array(place) + ahead * cascade.ahead - view.middle)
        assert np.abs(aside[:2]).max() <= grid / 2 / cascade.reach + 1e-9
        texels = view.clip[:2, :3] @ (view.middle - start.middle) * cascade.reach / start.texel
        np.testing.assert_allclose(texels, np.round(texels), atol=1e-6)


@pytest.mark.parametrize(
    ("focal", "share"), [(2000.0, 1), (552.0, 1), (279.0, 2), (138.0, 4), (60.0, 8)]
)
def test_coarser_images_have_coarser_shadow_maps(focal, share):
    """A map's pixel covers no more of the image than with the finest map."""
    for cascade, whole in zip(cascades_for(focal), CASCADES, strict=True):
        assert cascade.side == max(whole.side // share, 256)
        assert (cascade.reach, cascade.ahead, cascade.step) == (
            whole.reach, whole.ahead, whole.step,
        )  # fmt: skip
