"""Squares of the shadow maps, for a sun from anywhere."""

import numpy as np
import pytest

from envgen_usd.render.sun_shadows import CASCADES, DEPTH, shadow_view

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
