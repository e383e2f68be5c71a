import numpy as np
import pytest

from envgen_usd.chunks import CELL_SIZE
from envgen_usd.landuse.network.shipped_weights import find_weights
from envgen_usd.landuse.network.training.baselines import by_distance, by_majority
from envgen_usd.landuse.network.training.landuse_evaluation import (
    by_network,
    evaluation_windows,
    score,
    table,
)
from envgen_usd.landuse.network.training.landuse_measures import (
    confusion_of,
    distances,
    matched,
    mean_iou,
    plot_shapes,
)
from envgen_usd.landuse.network.training.weights_file import read_network
from envgen_usd.models.landuse import LanduseClass

GRASS, LAWN, ROAD = LanduseClass.GRASS, LanduseClass.LAWN, LanduseClass.ROAD


@pytest.fixture(scope="module")
def windows():
    return evaluation_windows("determined", 2, 3)


def test_mean_iou_of_a_quarter_that_is_wrong():
    truth = np.array([[GRASS, GRASS], [LAWN, LAWN]], dtype=np.uint8)
    made = np.array([[GRASS, GRASS], [LAWN, GRASS]], dtype=np.uint8)
    assert mean_iou(confusion_of(truth, made)) == pytest.approx((2 / 3 + 1 / 2) / 2)


def test_road_does_not_count():
    truth = np.array([[ROAD, GRASS]], dtype=np.uint8)
    assert mean_iou(confusion_of(truth, np.full((1, 2), GRASS, dtype=np.uint8))) == 1.0


def test_the_shape_of_a_rectangle_seen_from_the_road():
    plots = np.zeros((64, 64), dtype=np.int32)
    plots[10:40, 20:30] = 7  # 30 cells to the north, 10 to the east
    plots[0:5, 0:5] = 8  # not wholly in the window
    north = np.stack([np.zeros((32, 32)), np.ones((32, 32))])
    assert plot_shapes(plots, north) == pytest.approx(
        np.array([[300 * CELL_SIZE**2, 30 * CELL_SIZE, 10 * CELL_SIZE]])
    )


def test_distance_of_shapes_that_are_all_larger_by_one_figure():
    shapes = np.array([[100.0, 20.0, 5.0], [200.0, 25.0, 8.0]])
    assert distances([shapes], [shapes + np.array([10.0, 2.0, 1.0])]) == pytest.approx(
        (10.0, 2.0, 1.0)
    )
    assert np.all(np.isnan(distances([shapes], [np.empty((0, 3))])))


def test_plots_match_from_half_an_overlap():
    truth, made = np.zeros((2, 20, 20), dtype=np.int32)
    truth[2:12, 2:12], made[2:12, 4:14] = 1, 5
    truth[15:19, 2:12], made[15:19, 10:20] = 2, 6
    assert matched(truth, made) == (1, 2, 2)


def test_the_truth_scores_full_marks(windows):
    found = score(windows, lambda window, _: window.sample.channels, 2)
    assert found.miou > 0.96  # repair fills verges that are narrower than a cell
    assert found.channels == 1.0
    assert found.plots > 0.9  # repair drops some that the window cuts
    assert found.diversity == 0.0
    assert found.area < 60.0


def test_a_determined_window_is_the_same_when_drawn_again(windows):
    again = evaluation_windows("determined", 2, 3)
    for one, other in zip(windows, again, strict=True):
        assert np.array_equal(one.sample.channels, other.sample.channels)


def test_baselines_score_below_the_truth(windows):
    samples = [window.sample for window in windows]
    most, near = (score(windows, made(samples), 1) for made in (by_majority, by_distance))
    assert most.miou < near.miou < 1.0
    assert table({"majority": most, "distance": near}).count("\n") == 3


def test_the_shipped_weights_come_near_the_truth_on_unseen_roads(windows):
    made = by_network(read_network(find_weights(None)))
    assert score(windows, made, 1).miou > 0.8
