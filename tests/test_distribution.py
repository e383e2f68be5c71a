"""Distributions of figures against closed forms and against scipy."""

from dataclasses import dataclass

import numpy as np
import pytest
from scipy.stats import kstest, norm, spearmanr

from envgen_usd.environment_files import read_profile
from envgen_usd.errors import EnvgenError
from envgen_usd.models.building_rules import BuildingRules
from envgen_usd.models.distribution import (
    Correlation,
    Quantiles,
    RangeOf,
    drawn,
    drawn_count,
    mean_of,
    quantiles_of,
    share_below,
    value_at,
)
from envgen_usd.models.figure_types import Share
from envgen_usd.seeds import Draws, generator
from envgen_usd.toml_files import read_toml

SKEWED = Quantiles((1.0, 2.0, 4.0, 8.0, 16.0), 40)


def test_quantiles_stand_for_their_ends_where_a_range_is_expected():
    assert (SKEWED[0], SKEWED[1], len(SKEWED)) == (1.0, 16.0, 2)
    assert tuple(SKEWED) == (1.0, 16.0)
    assert max(SKEWED) == 16.0


def test_values_lie_linearly_between_quantiles():
    assert value_at(SKEWED, 0.5) == 4.0
    assert value_at(SKEWED, 0.625) == 6.0
    assert value_at((2.0, 6.0), 0.25) == 3.0
    assert share_below(SKEWED, 6.0) == 0.625
    assert share_below(SKEWED, 99.0) == 1.0
    assert share_below((2.0, 6.0), 3.0) == 0.25
    # The area under a piecewise linear quantile function.
    assert mean_of(SKEWED) == pytest.approx((1.5 + 3 + 6 + 12) / 4)


def test_equal_quantiles_have_the_middle_of_their_shares():
    assert share_below(Quantiles((0.0, 3.0, 3.0, 3.0, 9.0)), 3.0) == 0.5


def test_draws_from_estimated_quantiles_have_the_distribution_of_the_samples():
    samples = generator(1, "samples").exponential(5.0, 4000)
    learnt = quantiles_of(samples, 101, 0.0)
    assert learnt.samples == 4000
    figures = drawn(generator(2, "draws"), learnt, 4000)
    assert kstest(figures, samples).pvalue > 0.01
    trimmed = quantiles_of(samples, 11, 0.1)
    assert tuple(trimmed) == pytest.approx(np.quantile(samples, (0.1, 0.9)), abs=1e-3)


def test_ranges_are_drawn_as_before():
    first, second = generator(3, "a"), generator(3, "a")
    assert drawn(first, (2.0, 9.0)) == second.uniform(2.0, 9.0)
    np.testing.assert_array_equal(drawn(first, (2.0, 9.0), 7), second.uniform(2.0, 9.0, 7))
    assert drawn_count(first, (2.0, 9.0)) == second.integers(2, 10)


def test_a_figure_takes_a_single_number_in_either_form():
    """So that another distribution of a figure changes no other figure."""
    ranged, tabled = generator(4, "a"), generator(4, "a")
    drawn(ranged, (2.0, 9.0), 5)
    drawn(tabled, SKEWED, 5)
    assert ranged.random() == tabled.random()


def test_whole_numbers_keep_their_shares():
    storeys = Quantiles((1.0, 1.0, 2.0, 2.0, 2.0))
    counts = [drawn_count(generator(n, "c"), storeys) for n in range(600)]
    assert set(counts) == {1, 2}
    # Values up to 1.5 lie below the share 3 / 8.
    assert np.mean(np.array(counts) == 1) == pytest.approx(3 / 8, abs=0.06)
    draws = [Draws(n, "c").whole("n", storeys) for n in range(600)]
    assert np.mean(np.array(draws) == 1) == pytest.approx(3 / 8, abs=0.06)


def linked(r: float) -> Correlation:
    """A building's width and depth, the first linked with its plot's width."""
    known = {"plot_width": Quantiles((10.0, 20.0, 30.0))}
    rows = ((1.0,), (r, 1.0), (0.0, 0.5, 1.0))
    return Correlation((*known, "width", "depth"), rows, known, 50)


def test_correlated_shares_are_uniform_and_depend_as_stated():
    random = generator(5, "copula")
    plots, free = random.random(3000), random.random((3000, 2))
    tied = [
        linked(0.8).tied(
            {"plot_width": 10.0 + 20.0 * p},
            {"width": w, "depth": d, "storeys": 0.5},
        )
        for p, (w, d) in zip(plots, free, strict=True)
    ]
    widths, depths = (np.array([shares[name] for shares in tied]) for name in ("width", "depth"))
    assert tied[0].keys() == {"width", "depth"}
    for shares in (widths, depths):
        assert kstest(shares, "uniform").pvalue > 0.01
    # Rank correlation of a Gaussian copula: 6 / pi * asin(r / 2).
    for first, second, r in ((plots, widths, 0.8), (widths, depths, 0.5), (plots, depths, 0.0)):
        expected = 6.0 / np.pi * np.arcsin(r / 2.0)
        assert spearmanr(first, second).statistic == pytest.approx(expected, abs=0.05)


def test_what_is_known_moves_the_middle_of_what_depends_on_it():
    shares = linked(0.8).tied({"plot_width": 25.0}, {"width": 0.5, "depth": 0.5})
    assert shares["width"] == pytest.approx(norm.cdf(0.8 * norm.ppf(0.75)))


@pytest.mark.parametrize(
    ("make", "fault"),
    [
        (lambda: Quantiles((1.0,)), "at least two"),
        (lambda: Quantiles((1.0, float("nan"))), "finite"),
        (lambda: Quantiles((2.0, 1.0)), "ascending"),
        (lambda: Quantiles((1.0, 2.0), -1), "samples"),
        (lambda: Correlation(("a", "a"), ((1.0,), (0.0, 1.0)), {}), "different names"),
        (lambda: Correlation(("a", "b"), ((1.0,), (0.0, 1.0)), {"b": SKEWED}), "b first"),
        (lambda: Correlation(("a", "b"), ((1.0,), (1.0,)), {}), "2 rows"),
        (lambda: Correlation(("a", "b"), ((1.0,), (0.5, 0.9)), {}), "end in 1.0"),
        (lambda: Correlation(("a", "b"), ((1.0,), (1.5, 1.0)), {}), "positive definite"),
        (lambda: Correlation(("a", "b"), ((1.0,), (float("nan"), 1.0)), {}), "positive definite"),
    ],
)
def test_what_is_no_distribution_is_refused(make, fault):
    with pytest.raises(ValueError, match=fault):
        make()


@dataclass(frozen=True)
class Sheet:
    """A file with a single figure."""

    width: RangeOf[Share]


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        (
            "{ quantiles = [0.1, 0.5, 1.2], samples = 9 }",
            "expected a number from 0 to 1",
        ),
        ("{ quantiles = [0.5, 0.1] }", "ascending"),
        ("{ samples = 30 }", "missing quantiles"),
        ("{ quantiles = [0.1, 0.5], of = 3 }", "unknown of"),
        ("0.3", r"expected a range \[low, high\]"),
    ],
)
def test_a_wrong_table_of_quantiles_is_named(tmp_path, text, fault):
    path = tmp_path / "sheet.toml"
    path.write_text(f"width = {text}\n", encoding="utf-8")
    with pytest.raises(EnvgenError, match=f"sheet.toml: width.*{fault}"):
        read_toml(path, Sheet)


def test_a_file_may_hold_either_form(tmp_path):
    path = tmp_path / "sheet.toml"
    path.write_text("width = { quantiles = [0.1, 0.2, 0.9], samples = 30 }\n", encoding="utf-8")
    assert read_toml(path, Sheet).width == Quantiles((0.1, 0.2, 0.9), 30)
    path.write_text("width = [0.1, 0.9]\n", encoding="utf-8")
    assert read_toml(path, Sheet).width == (0.1, 0.9)


def test_only_figures_that_depend_on_one_another_are_correlated():
    rules = read_profile("1", "residential").buildings
    values = {**vars(rules), "correlation": linked(0.8)}
    assert BuildingRules(**values).correlation == linked(0.8)
    known = linked(0.8).known
    other = Correlation((*known, "chimney"), linked(0.8).matrix[:2], known)
    with pytest.raises(ValueError, match="chimney"):
        BuildingRules(**{**values, "correlation": other})
