import numpy as np
import pytest

from envgen_usd.landuse.specks import remove_specks


def test_specks_and_holes_take_the_class_around_them():
    clean = np.full((40, 60), 2, dtype=np.uint8)
    clean[:, 30:] = 4
    spoilt = clean.copy()
    spoilt[5, 5] = spoilt[20:22, 8:10] = 7
    spoilt[10:12, 40] = 2
    assert np.array_equal(remove_specks(spoilt, 5), clean)


def test_what_is_large_enough_stays():
    classes = np.full((20, 20), 2, dtype=np.uint8)
    classes[3:6, 3:6] = 7
    assert np.array_equal(remove_specks(classes, 9), classes)
    assert np.all(remove_specks(classes, 10) == 2)


@pytest.mark.parametrize("least", [0, 1])
def test_nothing_is_too_small_for_a_coarse_raster(least):
    classes = np.random.default_rng(0).integers(2, 8, (30, 30)).astype(np.uint8)
    assert np.array_equal(remove_specks(classes, least), classes)


def test_noise_without_any_area_is_left_alone():
    classes = np.indices((9, 9)).sum(axis=0).astype(np.uint8) % 2
    assert np.array_equal(remove_specks(classes, 4), classes)
