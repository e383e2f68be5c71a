import numpy as np
import pytest
from scipy.stats import kstest

from envgen_usd.seeds import Draws, generator


def test_a_stream_follows_from_seed_and_names_alone() -> None:
    first = generator(7, "city", "1_-2", 3).random(8)
    generator(7, "city", "other").random(100)
    np.testing.assert_array_equal(first, generator(7, "city", "1_-2", 3).random(8))


def test_other_seeds_and_names_give_other_streams() -> None:
    paths = [(0, "a"), (1, "a"), (0, "b"), (0, "a", "b"), (0, "ab"), (0, "a", 1), (0, "a1")]
    draws = {tuple(generator(*path).integers(0, 2**32, 4)) for path in paths}
    assert len(draws) == len(paths)


def test_a_figure_follows_from_seed_path_and_name_not_from_earlier_draws() -> None:
    first = Draws(7, "city", "plot_3").share("width")
    draws = Draws(7, "city", "plot_3")
    others = {draws.share(str(number)) for number in range(1000)}
    assert draws.share("width") == first
    assert len(others - {first}) == 1000


def test_other_seeds_paths_and_names_give_other_figures() -> None:
    paths = [(0, "a"), (1, "a"), (0, "b"), (0, "a", "b"), (0, "ab"), (0, "a", 1), (0, "a1")]
    figures = {Draws(*path).share(name) for path in paths for name in ("", "b", "1", "ab")}
    # ("a",) with "b" and ("a", "b") with "" are different places, too.
    assert len(figures) == 4 * len(paths)


def test_figures_are_uniform() -> None:
    draws = Draws(0, "uniform")
    figures = np.array([draws.share(str(number)) for number in range(20_000)])
    assert figures.min() >= 0.0
    assert figures.max() < 1.0
    assert kstest(figures, "uniform").pvalue > 0.01
    ahead, behind = figures[1:] - 0.5, figures[:-1] - 0.5
    assert abs(np.mean(ahead * behind)) < 4 / 12 / np.sqrt(len(ahead))


def test_a_name_is_drawn_once() -> None:
    draws = Draws(0, "house")
    draws.within("width", (1.0, 2.0))
    with pytest.raises(ValueError, match="'width' was drawn before"):
        draws.happens("width", 0.5)


def test_ranges_include_both_ends_and_weights_decide() -> None:
    every = [Draws(0, number) for number in range(4000)]
    stops = [draws.whole("storeys", (1.0, 4.0)) for draws in every]
    assert set(stops) == {1, 2, 3, 4}
    assert np.bincount(stops)[1:] == pytest.approx(np.full(4, 1000), abs=120)
    names = [draws.choice("roof", {"flat": 0.0, "shed": 1.0, "hipped": 3.0}) for draws in every]
    assert "flat" not in names
    assert names.count("hipped") == pytest.approx(3000, abs=120)
    lengths = [draws.within("width", (2.0, 5.0)) for draws in every]
    assert (min(lengths), max(lengths)) == pytest.approx((2.0, 5.0), abs=0.01)
    assert sum(draws.happens("bay", 0.25) for draws in every) == pytest.approx(1000, abs=120)
