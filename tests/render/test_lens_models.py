"""Lens models: places that OpenCV 5.0 computed, closed forms, and the way back."""

import numpy as np
import pytest

from envgen_usd.render.cameras.lens_models import BrownConrady, KannalaBrandt, Mei, Pinhole

POINTS = np.array(
    [(0.2, -0.1, 1.0), (-0.9, 0.7, 2.0), (1.5, 1.0, 2.5), (-3.0, -1.0, 1.0), (0.5, 4.0, 0.4)]
)
FOCAL, CENTRE = np.array([500.0, 510.0]), np.array([320.0, 240.0])
BROWN = BrownConrady("brown_conrady", -0.28, 0.07, 0.0002, -0.0006, 0.01)
KANNALA = KannalaBrandt("kannala_brandt", 0.05, -0.012, 0.004, -0.001)
KITTI_360 = Mei(
    "mei",
    2.2134047507854890,
    1.6798235660113681e-02,
    1.6548773243373522,
    4.2223943394772046e-04,
    4.2462134260997584e-04,
)
LENSES = [Pinhole(), BROWN, KANNALA, KITTI_360, Mei("mei", 0.9, -0.1, 0.02)]


@pytest.mark.parametrize(
    ("lens", "pixels"),
    [
        (BROWN, [(418.574625, 189.724391), (113.483668, 403.79209), (582.096224, 418.384552)]),
        (
            KANNALA,
            [
                (418.616951, 189.705355),
                (112.92172, 404.282102),
                (584.566378, 419.905137),
                (-315.253819, 24.013701),
                (417.731533, 1037.489308),
            ],
        ),
        (
            KITTI_360,
            [
                (350.604457, 224.393242),
                (256.490331, 290.394247),
                (400.716334, 294.889761),
                (133.687268, 176.674248),
                (348.340067, 470.973927),
            ],
        ),
    ],
    ids=["projectPoints", "fisheye.projectPoints", "omnidir.projectPoints"],
)
def test_points_land_where_opencv_projects_them(lens, pixels):
    places = lens.project(POINTS[: len(pixels)])
    np.testing.assert_allclose(places * FOCAL + CENTRE, pixels, atol=1e-6)


@pytest.mark.parametrize("lens", LENSES, ids=lambda lens: lens.model)
def test_directions_are_the_inverse_of_places(lens):
    rng = np.random.default_rng(0)
    angle = rng.uniform(0.0, np.radians(89.0 if lens.has_ranges else 35.0), 2000)
    turn = rng.uniform(0.0, 2.0 * np.pi, 2000)
    angle[0] = 0.0
    directions = np.column_stack(
        (np.sin(angle) * np.cos(turn), np.sin(angle) * np.sin(turn), np.cos(angle))
    )
    places = lens.project(directions * rng.uniform(0.1, 90.0, (2000, 1)))
    np.testing.assert_allclose(lens.directions(places), directions, atol=1e-9)


def test_an_equidistant_lens_has_the_angle_as_radius():
    angle = np.radians([0.0, 30.0, 60.0, 90.0, 100.0, 101.0])
    directions = np.column_stack((np.sin(angle), 0 * angle, np.cos(angle)))
    places = KannalaBrandt("kannala_brandt", field=200.5).project(directions)
    np.testing.assert_allclose(places[:5, 0], angle[:5], atol=1e-12)
    assert np.isnan(places[5]).all()


def test_the_unified_model_is_the_stereographic_projection_for_a_unit_xi():
    """Its radius is then tan(angle / 2)."""
    angle = np.radians([10.0, 45.0, 85.0])
    directions = np.column_stack((0 * angle, np.sin(angle), np.cos(angle)))
    places = Mei("mei", 1.0).project(directions)
    np.testing.assert_allclose(places[:, 1], np.tan(angle / 2), atol=1e-12)


@pytest.mark.parametrize("lens", [KANNALA, KITTI_360], ids=lambda lens: lens.model)
def test_outside_of_the_image_circle_there_is_no_direction(lens):
    edge = lens.project(np.array([(1.0, 0.0, 1e-9)]))[0, 0]
    inside, outside = lens.directions(np.array([(edge * 0.999, 0.0), (edge * 1.001, 0.0)]))
    assert inside[2] == pytest.approx(0.0, abs=0.01)
    assert np.isnan(outside).all()
    assert np.isnan(lens.project(np.array([(1.0, 0.0, -0.01)]))).all()


def test_a_barrel_lens_shows_nothing_where_its_image_would_fold():
    """r - 0.3 r^3 is largest at r = 1 / sqrt(0.9), with the value 2 / (3 sqrt(0.9))."""
    lens = BrownConrady("brown_conrady", -0.3)
    radius, largest = 1 / np.sqrt(0.9), 2 / (3 * np.sqrt(0.9))
    places = np.array([(0.0, largest - 1e-3), (0.0, largest + 1e-3)])
    below, above = lens.directions(places)
    assert 0.0 < below[1] / below[2] < radius
    assert np.isnan(above).all()
    ahead = np.array([(0.0, radius - 0.01, 1.0), (0.0, radius + 0.01, 1.0), (0.0, 0.0, -1.0)])
    assert np.isnan(lens.project(ahead)).all(axis=1).tolist() == [False, True, True]
