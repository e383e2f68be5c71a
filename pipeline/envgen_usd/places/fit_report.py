"""The report of a learnt environment as an HTML page: values, and histograms of both sides."""

from collections.abc import Iterator, Mapping, Sequence
from html import escape
from pathlib import Path

import numpy as np
from scipy.stats import wasserstein_distance

from envgen_usd.build_report import STYLE
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.distribution import Correlation, Quantiles
from envgen_usd.places.environment_fit import LEAST_SAMPLES, Learnt, LearntValue
from envgen_usd.places.street_figures import StreetFigures
from envgen_usd.whole_files import write_whole

FIGURES: Mapping[str, str] = {
    "area": "footprint, m²",
    "height": "height, m",
    "setback": "setback from the carriageway, m",
    "gaps": "gap to the next building, m",
    "coverage": "built share of a building's land",
    "frontage": "plot width, m",
    "plot_depth": "plot depth, m",
}
"""Figures of the histograms with their titles."""
_BINS = 24
_SIZE = (360, 140)
"""Width and height of a histogram, pixels."""


def write_fit_report(path: Path, source: str, learnt: Learnt) -> None:
    """Writes the page.

    Args:
        path: File to write.
        source: Name of the place.
        learnt: The environment with the figures of both sides.

    Raises:
        EnvgenError: The file cannot be written.
    """
    title = f"{escape(source)}: learnt environment"
    body = [f"<h1>{title}</h1>", "<h2>Values</h2>", _table(learnt.values)]
    body += ["<h2>Real (bars) and generated (line)</h2>"]
    real, town = learnt.figures, learnt.town
    body += [
        part
        for name, heading in FIGURES.items()
        for part in _histogram(heading, getattr(real, name), getattr(town, name, None))
    ]
    body += ["<h2>Streets</h2>", *_widths(learnt.streets)]
    write_whole(
        path,
        f'<!doctype html><html lang="en"><meta charset="utf-8"><title>{title}</title>'
        f"<style>{STYLE}</style><body>{''.join(body)}</body></html>",
    )


def _table(values: Sequence[LearntValue]) -> str:
    rows = "".join(
        f"<tr><td>{value.table}.{value.key}</td><td>{value.samples}</td>"
        f"<td>{escape(_shown(value))}</td></tr>"
        for value in values
    )
    return f"<table><tr><th>value</th><th>samples</th><th>learnt</th></tr>{rows}</table>"


def _shown(value: LearntValue) -> str:
    match value.value:
        case Quantiles(quantiles=quantiles):
            low, middle, high = (quantiles[i * (len(quantiles) - 1) // 10] for i in (1, 5, 9))
            return f"{middle:.3g}, in 80 % of the cases {low:.3g} to {high:.3g}"
        case Correlation(figures=figures):
            return f"of {', '.join(figures)}"
        case Mapping() as weights:
            total = sum(weights.values())
            return ", ".join(f"{name} {share / total:.0%}" for name, share in weights.items())
        case None:
            return f"the environment's value stays: fewer than {LEAST_SAMPLES} samples"
        case other:
            return str(other)


def _histogram(heading: str, real: FloatArray, town: FloatArray | None) -> Iterator[str]:
    real = real[np.isfinite(real)]
    town = np.empty(0) if town is None else town[np.isfinite(town)]
    if len(real) < 2:
        return
    ends = np.quantile(np.concatenate([real, town]), (0.0, 0.98))
    bins = np.linspace(ends[0], max(ends[1], ends[0] + 1e-6), _BINS + 1)
    shares = [np.histogram(s, bins)[0] / max(len(s), 1) for s in (real, town)]
    highest = max(float(np.max(shares)), 1e-9)
    width, height = _SIZE
    step = width / _BINS
    bars = "".join(
        f'<rect x="{n * step:.1f}" y="{height * (1 - s / highest):.1f}" width="{step - 1:.1f}" '
        f'height="{height * s / highest:.1f}" fill="#9db8d2"/>'
        for n, s in enumerate(shares[0].tolist())
    )
    line = " ".join(
        f"{(n + 0.5) * step:.1f},{height * (1 - s / highest):.1f}"
        for n, s in enumerate(shares[1].tolist())
    )
    drawn = f'<polyline points="{line}" fill="none" stroke="#c0392b" stroke-width="2"/>'
    away = f", distance {wasserstein_distance(real, town):.3g}" if len(town) else ""
    yield (
        f'<figure><svg width="{width}" height="{height}" role="img">{bars}'
        f"{drawn if len(town) else ''}</svg><figcaption>{heading}: {bins[0]:.3g} to "
        f"{bins[-1]:.3g}; {len(real)} real, {len(town)} generated{away}</figcaption></figure>"
    )


def _widths(streets: StreetFigures) -> Iterator[str]:
    for name, widths in (("lanes", streets.lane_width), ("sidewalks", streets.sidewalk_width)):
        if len(widths):
            low, middle, high = np.quantile(widths, (0.1, 0.5, 0.9))
            text = f"{middle:.2f} m, in 80 % of the cases {low:.2f} to {high:.2f}"
        else:
            text = "no width is stated"
        yield f"<p>Width of {name}: {text} ({len(widths)} samples). The road file decides it.</p>"
