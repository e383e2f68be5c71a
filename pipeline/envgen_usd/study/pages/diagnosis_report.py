"""Pages of a diagnosis and of realism."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from envgen_usd.build_report import STYLE
from envgen_usd.study.diagnosis import Diagnosis
from envgen_usd.study.pages.statistic_tables import distance_table, statistic_tables
from envgen_usd.study.pages.study_report import REPORT, html_table
from envgen_usd.study.pages.study_tables import Table, comma_separated, markdown, signed_points
from envgen_usd.study.segmentation_scores import scores
from envgen_usd.study.set_realism import Distance, Realism
from envgen_usd.study.study_classes import CLASSES
from envgen_usd.whole_files import make_folder, write_whole


def write_diagnosis(diagnosis: Diagnosis, out: Path) -> Table:
    """Writes ``diagnosis.md``, ``diagnosis.csv`` and ``report.html``; returns the ranked list.

    Raises:
        EnvgenError: A file cannot be written.
    """
    ranked = cause_table(diagnosis)
    tables = (
        ranked,
        _confusions(diagnosis),
        *statistic_tables(diagnosis.real, diagnosis.synthetic),
    )
    write_whole(out / "diagnosis.csv", comma_separated(ranked))
    _write_pages("diagnosis", "What synthetic images lack", tables, out)
    return ranked


def write_realism(realism: Realism, layers: Sequence[Distance], out: Path) -> tuple[Table, ...]:
    """Writes ``realism.md``, ``realism.csv`` and ``report.html``; returns the distances.

    Args:
        realism: Distances of images.
        layers: Distances of towns; may be empty.
        out: Folder to write to.

    Raises:
        EnvgenError: A file cannot be written.
    """
    make_folder(out)
    all_distances = (*realism.distances, *layers)
    write_whole(out / "realism.csv", comma_separated(distance_table("Distances", all_distances)))
    distances = [distance_table("Distances of image sets", realism.distances)]
    if layers:
        distances.append(distance_table("Distances of towns, Kolmogorov", layers))
    tables = (*distances, *statistic_tables(realism.real, realism.synthetic))
    _write_pages("realism", "Synthetic beside real images", tables, out)
    return tuple(distances)


def cause_table(diagnosis: Diagnosis) -> Table:
    """The counterfactuals by gain, with the class that gains most."""
    base = diagnosis.baseline
    start = f"{base.value:.3f} [{base.low:.3f}, {base.high:.3f}]"
    body = [("baseline", "as they are", start, "")]
    for cause in diagnosis.causes:
        best = int(np.nanargmax(cause.iou))
        change = f"{CLASSES[best]} {100 * cause.iou[best]:+.1f}"
        other = cause.counterfactual
        body.append((other.name, other.meaning, signed_points(cause.gain), change))
    head = ("change", "meaning", "mIoU, or its gain in points", "class that gains most, points")
    return Table("What costs most, by training without it", head, tuple(body))


def _confusions(diagnosis: Diagnosis) -> Table:
    """For each class the class it is mostly taken for, and the change that mends most of it."""
    body = []
    shares = diagnosis.confusion / np.maximum(diagnosis.confusion.sum(1, keepdims=True), 1)
    right = scores(diagnosis.confusion).accuracy
    for value, name in enumerate(CLASSES):
        if not diagnosis.confusion[value].sum():
            continue
        wrong = shares[value].copy()
        wrong[value] = -1.0
        other = int(wrong.argmax())
        gains = [
            float(cause.confusion[value, other] / cause.confusion[value].sum() - wrong[other])
            for cause in diagnosis.causes
        ]
        best = int(np.argmin(gains)) if gains else -1
        mended = f"{diagnosis.causes[best].counterfactual.name} {100 * gains[best]:+.1f}"
        body.append(
            (
                name,
                f"{100 * right[value]:.1f}",
                f"{CLASSES[other]} {100 * wrong[other]:.1f}",
                mended,
            )
        )
    head = ("class", "right, %", "mostly taken for, %", "change that lowers this most, points")
    return Table("Confusion of the baseline, and what explains it", head, tuple(body))


def _write_pages(name: str, title: str, tables: Sequence[Table], out: Path) -> None:
    write_whole(out / f"{name}.md", "\n\n".join(markdown(table) for table in tables) + "\n")
    page = [
        f"<!doctype html><html lang=en><meta charset=utf-8><title>{title}</title>"
        f"<style>{STYLE}</style><h1>{title}</h1>",
        *(html_table(table) for table in tables),
        "</html>",
    ]
    write_whole(out / REPORT, "\n".join(page) + "\n")
