"""The report of a study as an HTML page, with its charts as files of their own."""

from collections import defaultdict
from html import escape
from pathlib import Path

import numpy as np

from envgen_usd.build_report import STYLE
from envgen_usd.study.pages.line_charts import Line, line_chart
from envgen_usd.study.pages.study_tables import Table, write_tables
from envgen_usd.study.study_classes import CLASSES
from envgen_usd.study.study_folder import RUNS
from envgen_usd.study.study_protocol import ARMS, StudyPlan
from envgen_usd.study.study_summary import Row, Summary, named_size
from envgen_usd.whole_files import make_folder, write_whole

REPORT = "report.html"
_FIGURES = "figures"
_MATRICES = 8
"""Largest number of confusion matrices; the others are in the results of the runs."""


def write_study_report(plan: StudyPlan, summary: Summary, out: Path) -> None:
    """Writes tables, charts and ``report.html``.

    Raises:
        EnvgenError: A file cannot be written.
    """
    make_folder(out / _FIGURES)
    tables = write_tables(summary, out)
    charts = {
        "learning_curves": ("mIoU on test images over steps", _learning_curves(plan, summary)),
        "ratio": ("mIoU over the share of real images", _over_ratio(summary)),
        "pareto": ("mIoU over the number of real images, and Pareto front", _front(summary)),
    }
    for name, (_, chart) in charts.items():
        write_whole(out / _FIGURES / f"{name}.svg", chart + "\n")
    parts = [
        "<!doctype html><html lang=en><meta charset=utf-8><title>Study</title>"
        f"<style>{STYLE}</style><h1>Real and synthetic images</h1>",
        _described(plan, summary),
        *(html_table(table) for table in tables),
        *(f"<h2>{escape(title)}</h2>{chart}" for title, chart in charts.values()),
        "<h2>Confusion matrices</h2><p>Rows are true classes; % of the row.</p>",
        *(_matrix(row) for row in _chosen(summary)),
        "<h2>Predictions</h2><p>Picture, truth, prediction; black is void.</p>",
        *_predictions(plan, summary),
        "</html>",
    ]
    write_whole(out / REPORT, "\n".join(parts) + "\n")


def _described(plan: StudyPlan, summary: Summary) -> str:
    options, protocol = plan.options, plan.protocol
    result = next(iter(summary.results.values()))
    seconds = sum(each.seconds for each in summary.results.values())
    split = "a random split" if protocol.random_split else "whole sequences are left out"
    rows = [
        ("left out and scored", ", ".join(f"{f.name} ({len(f.test)})" for f in plan.folds)),
        ("split", split),
        ("network", f"{options.network}, {options.width} x {options.height}"),
        ("steps", f"{options.iterations or options.epochs} x {options.batch} images"),
        ("options", str(options)),
        ("repetitions", str(len(summary.seeds))),
        ("runs", f"{len(summary.results)} in {seconds:.0f} s on {result.device}"),
        *((f"arm {name}", ARMS[name]) for name in protocol.arms),
    ]
    table = Table("Protocol", ("", ""), tuple(rows))
    few = "<p class=warning>One repetition: intervals hold images only, not seeds.</p>"
    return html_table(table) + (few if len(summary.seeds) == 1 else "")


def _learning_curves(plan: StudyPlan, summary: Summary) -> str:
    """Mean over folds and seeds at each step, with the deviation."""
    values: defaultdict[str, defaultdict[int, list[float]]] = defaultdict(lambda: defaultdict(list))
    largest = plan.protocol.sizes[-1]
    for cell, run in plan.cells.items():
        if cell.size == largest and cell.arm == "mix" and run in summary.results:
            for step, _, score in summary.results[run].curve:
                values[f"{100 * cell.ratio:g} % real"][step].append(score)
    lines = [
        Line(
            name,
            tuple(
                (step, float(m := np.mean(v)), float(m - np.std(v)), float(m + np.std(v)))
                for step, v in steps.items()
            ),
        )
        for name, steps in values.items()
    ]
    return line_chart(lines, "step", f"mIoU, mix of {named_size(largest)}")


def _over_ratio(summary: Summary) -> str:
    places = dict.fromkeys((row.arm, row.size) for row in summary.rows)
    lines = [
        Line(
            f"{arm} {named_size(size)}",
            tuple(
                (row.ratio, row.miou.value, row.miou.low, row.miou.high)
                for row in summary.rows
                if (row.arm, row.size) == (arm, size)
            ),
        )
        for arm, size in places
        if arm in {"mix", "real_only"}
    ]
    return line_chart(lines, "share of real images", "mIoU")


def _front(summary: Summary) -> str:
    arms = dict.fromkeys(row.arm for row in summary.rows)
    lines = [
        Line(arm, tuple(_point(row) for row in summary.rows if row.arm == arm), joined=False)
        for arm in arms
    ]
    best = [row for row in summary.rows if (row.arm, row.size, row.ratio) in summary.pareto]
    lines.append(Line("Pareto front", tuple(_point(row) for row in best)))
    return line_chart(lines, "real images", "mIoU", log_x=True)


def _point(row: Row) -> tuple[float, float, float, float]:
    return row.real, row.miou.value, row.miou.low, row.miou.high


def _chosen(summary: Summary) -> list[Row]:
    """Rows whose confusion is shown: real alone, mixes and synthetic alone of the largest size."""
    largest = summary.rows[-1].size
    rows = [row for row in summary.rows if row.size == largest and row.arm in {"mix", "added"}]
    return rows[:_MATRICES]


def _matrix(row: Row) -> str:
    shares = 100.0 * row.confusion / np.maximum(row.confusion.sum(1, keepdims=True), 1)
    body = tuple(
        (name, *(f"{value:.1f}" for value in line))
        for name, line, true in zip(CLASSES, shares.tolist(), row.confusion.sum(1), strict=True)
        if true
    )
    title = f"{row.arm}, N {named_size(row.size)}, r {row.ratio:g}"
    return html_table(Table(title, ("", *CLASSES), body), 3)


def _predictions(plan: StudyPlan, summary: Summary) -> list[str]:
    """A sheet for each mix of the largest size, of the first repetition."""
    largest, seed = plan.protocol.sizes[-1], summary.seeds[0]
    shown: dict[str, str] = {}
    for cell, run in plan.cells.items():
        if cell.size == largest and cell.arm in {"mix", "added"} and cell.seed == seed:
            shown.setdefault(run.name, f"{cell.arm}, r {cell.ratio:g}, {cell.fold}")
    return [
        f'<figure><img src="{RUNS}/{escape(name)}.jpg" alt="" loading="lazy">'
        f"<figcaption>{escape(title)}</figcaption></figure>"
        for name, title in shown.items()
    ]


def html_table(table: Table, level: int = 2) -> str:
    """A table in HTML below its title."""
    cells = "".join(
        "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in table.rows
    )
    head = "".join(f"<th>{escape(name)}</th>" for name in table.head)
    title = f"<h{level}>{escape(table.title)}</h{level}>"
    return f"{title}<table><tr>{head}</tr>{cells}</table>"
