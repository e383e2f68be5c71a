"""Tables of a study as Markdown, CSV and LaTeX."""

import csv
import io
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from envgen_usd.study.paired_bootstrap import Interval
from envgen_usd.study.study_classes import CLASSES
from envgen_usd.study.study_summary import Row, Summary, named_size
from envgen_usd.whole_files import write_whole


@dataclass(frozen=True)
class Table:
    """A table.

    Attributes:
        title: What it shows.
        head: Names of the columns.
        rows: Cells as text.
    """

    title: str
    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


def write_tables(summary: Summary, out: Path) -> tuple[Table, ...]:
    """Writes ``table.{md,csv,tex}`` and ``results.csv``, and returns the tables.

    Raises:
        EnvgenError: A file cannot be written.
    """
    tables = (
        article_table(summary.rows),
        scores_table(summary.rows),
        class_table(summary.rows),
        gain_table(summary),
        replaceable_table(summary),
    )
    write_whole(out / "table.md", "\n\n".join(markdown(table) for table in tables) + "\n")
    write_whole(out / "table.csv", comma_separated(tables[0]))
    write_whole(out / "table.tex", latex(tables[0]))
    write_whole(out / "results.csv", comma_separated(_plain_results(summary.rows)))
    return tables


def article_table(rows: Sequence[Row]) -> Table:
    """Global and mean class accuracy and mIoU of mixes: a row a ratio, columns for each size."""
    mixes = {(row.size, row.ratio): row for row in rows if row.arm == "mix"}
    sizes = list(dict.fromkeys(size for size, _ in mixes))
    ratios = sorted({ratio for _, ratio in mixes}, reverse=True)
    head = ["real / synthetic, %"]
    for size in sizes:
        name = named_size(size)
        head += [f"global, {name}", f"class, {name}", f"mIoU, {name}"]
    body = []
    for ratio in ratios:
        cells = [f"{100 * ratio:g} / {100 - 100 * ratio:g}"]
        for size in sizes:
            row = mixes.get((size, ratio))
            cells += (
                [_percent(i) for i in (row.overall, row.mean_class, row.miou)] if row else [""] * 3
            )
        body.append(tuple(cells))
    return Table("Accuracy over the share of real images, %", tuple(head), tuple(body))


def scores_table(rows: Sequence[Row]) -> Table:
    """All arms with intervals, and each fold."""
    folds = list(rows[0].by_fold) if rows else []
    head = ("arm", "N", "r", "real", "synthetic", "mIoU", "± seeds", "class", "global", *folds)
    body = [
        (
            row.arm,
            named_size(row.size),
            f"{row.ratio:g}",
            f"{row.real:.0f}",
            f"{row.synthetic:.0f}",
            _with_interval(row.miou),
            f"{row.deviation:.3f}",
            f"{row.mean_class.value:.3f}",
            f"{row.overall.value:.3f}",
            *(f"{row.by_fold[fold]:.3f}" for fold in folds),
        )
        for row in rows
    ]
    return Table(
        "All arms; mIoU with its 95 % interval, and by what was left out", head, tuple(body)
    )


def class_table(rows: Sequence[Row]) -> Table:
    """Intersection over union by class."""
    body = [
        (row.arm, named_size(row.size), f"{row.ratio:g}", *map(_number, row.iou.tolist()))
        for row in rows
    ]
    return Table("Intersection over union by class", ("arm", "N", "r", *CLASSES), tuple(body))


def gain_table(summary: Summary) -> Table:
    """Differences between arms, and equivalent real images."""
    body = []
    for each in summary.comparisons:
        known = summary.equivalent.get((each.size, each.ratio), math.nan)
        equal = (
            ("off the curve" if known is None else _count(known))
            if (each.first, each.second) == ("mix", "real_only")
            else ""
        )
        body.append(
            (
                f"{each.first} − {each.second}",
                named_size(each.size),
                f"{each.ratio:g}",
                f"{each.real:.0f}",
                signed_points(each.gain),
                equal,
            )
        )  # fmt: skip
    head = ("difference", "N", "r", "real", "points of mIoU", "equivalent real images")
    return Table("Gains, paired 95 % intervals", head, tuple(body))


def replaceable_table(summary: Summary) -> Table:
    """Replaceable shares beside those of real images alone."""
    body = [
        (
            named_size(each.size),
            f"{100 * each.loss:g}",
            _share(each.mix),
            _share(each.real_only),
        )
        for each in summary.replaceable
    ]
    head = ("N", "loss, points", "replaced by synthetic images", "left out without replacement")
    return Table("Real images that can go", head, tuple(body))


def markdown(table: Table) -> str:
    """The table in Markdown, with its title."""
    lines = [f"**{table.title}**", "", _line(table.head), _line(["---"] * len(table.head))]
    return "\n".join([*lines, *(_line(row) for row in table.rows)])


def comma_separated(table: Table) -> str:
    """The table as comma-separated values."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerows((table.head, *table.rows))
    return text.getvalue()


def latex(table: Table) -> str:
    """The table as a LaTeX ``tabular``, for ``booktabs``."""
    rows = [" & ".join(map(_escaped, row)) + r" \\" for row in (table.head, *table.rows)]
    lines = [
        rf"\begin{{tabular}}{{l{'r' * (len(table.head) - 1)}}}",
        r"\toprule",
        rows[0],
        r"\midrule",
        *rows[1:],
        r"\bottomrule",
        r"\end{tabular}",
    ]
    return "\n".join(lines) + "\n"


def _plain_results(rows: Sequence[Row]) -> Table:
    """Every figure as a number, for programs."""
    head = ["arm", "size", "ratio", "real", "synthetic", "deviation"]
    head += [f"{m}{end}" for m in ("global", "class", "miou") for end in ("", "_low", "_high")]
    body = []
    for row in rows:
        ends = [
            value
            for each in (row.overall, row.mean_class, row.miou)
            for value in (each.value, each.low, each.high)
        ]
        numbers = [row.ratio, row.real, row.synthetic, row.deviation, *ends, *row.iou.tolist()]
        cells = [f"{number:.6g}" for number in numbers]
        body.append((row.arm, named_size(row.size), *cells))
    return Table("results", (*head, *(f"iou_{name}" for name in CLASSES)), tuple(body))


def _line(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"


def _escaped(text: str) -> str:
    return text.replace("%", r"\%").replace("±", r"$\pm$").replace("_", r"\_")


def _percent(each: Interval) -> str:
    return f"{100 * each.value:.1f} ± {50 * (each.high - each.low):.1f}"


def _with_interval(each: Interval) -> str:
    return f"{each.value:.3f} [{each.low:.3f}, {each.high:.3f}]"


def signed_points(each: Interval) -> str:
    """A difference of scores and its interval, in points."""
    return f"{100 * each.value:+.1f} [{100 * each.low:+.1f}, {100 * each.high:+.1f}]"


def _number(value: float) -> str:
    return "–" if math.isnan(value) else f"{value:.3f}"


def _share(value: float) -> str:
    return "none" if math.isnan(value) else f"{100 * value:.0f} %"


def _count(value: float) -> str:
    return "" if math.isnan(value) else f"{value:.0f}"
