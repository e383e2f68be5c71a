"""The report of a data set as an HTML page."""

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from itertools import pairwise
from pathlib import Path

import numpy as np

from envgen_usd.build_report import STYLE
from envgen_usd.datasets.dataset_index import IndexedFrame
from envgen_usd.datasets.pages.frame_statistics import DEPTHS, FrameStatistics, frame_statistics
from envgen_usd.datasets.pages.preview_sheets import Sheet
from envgen_usd.label_taxonomy import labels
from envgen_usd.models.array_types import FloatArray
from envgen_usd.whole_files import write_whole

REPORT = "report.html"
_COLOURS = ("#1f6fb4", "#e07b00", "#2a9d4a", "#b5179e", "#7a5c00")
"""Colours of the splits on the map, in their order; further splits begin again."""
_BAR = 360
"""Pixels of the longest bar."""
_MAP = 900
"""Pixels of a map's longer side."""
_DOT = 3.5
"""Radius of a frame on the map, pixels."""
_INSTANCE_BINS = 12


@dataclass(frozen=True)
class RoadMap:
    """Where the frames of a road are.

    Attributes:
        name: Name of the road file.
        lines: Reference lines of its roads, each N x 2, metres.
        places: Places of the cameras, F x 2, metres.
        splits: Split of each frame.
    """

    name: str
    lines: tuple[FloatArray, ...]
    places: FloatArray
    splits: tuple[str, ...]


def write_dataset_report(
    folder: Path,
    frames: Sequence[IndexedFrame],
    sheets: Sequence[Sheet],
    maps: Sequence[RoadMap],
    progress: Callable[[str, int, int], None] = lambda *_: None,
) -> None:
    """Writes `report.html`: numbers, class shares, depths, instances, frames, and maps.

    Args:
        folder: Folder of the data set.
        frames: Its frames.
        sheets: Contact sheets.
        maps: Roads with the places of the frames.
        progress: Called with the step's name, the parts done and the total.

    Raises:
        EnvgenError: The file cannot be written.
    """
    figures = frame_statistics(folder, frames, progress)
    splits = list(dict.fromkeys(frame.split for frame in frames))
    colours = {split: _COLOURS[n % len(_COLOURS)] for n, split in enumerate(sorted(splits))}
    counted = f"{figures.counted:,} of {len(frames):,} frames are counted"
    parts = [
        f"<!doctype html><html lang=en><meta charset=utf-8><title>Data set</title>"
        f"<style>{STYLE} rect {{ fill: #4a7fb0 }}</style>"
        f"<h1>Data set of {len(frames):,} frames</h1>",
        _numbers(frames, splits),
        f"<h2>Shares of the classes</h2><p>Share of the pixels; {counted}.</p>",
        _class_table(figures, splits),
        "<h2>Depth</h2><p>Share of the pixels with a surface, by distance in metres.</p>",
        _bars(_depth_rows(figures)),
        "<h2>Instances</h2><p>Frames by the number of instances that they show.</p>",
        _bars(_instance_rows(figures)),
        _table(("class", "different instances in the counted frames"), figures.classes.items()),
        "<h2>Where the frames are</h2>",
        *(_map(each, colours) for each in maps),
        "<h2>Frames beside their labels</h2>",
        *(_figure(sheet) for sheet in sheets),
        "</html>",
    ]
    write_whole(folder / REPORT, "\n".join(parts) + "\n")


def _numbers(frames: Sequence[IndexedFrame], splits: Sequence[str]) -> str:
    """Numbers of frames by what they differ in, for each split."""
    rows: list[tuple[object, ...]] = []
    for key in ("road", "country", "area", "seed", "weather", "rig", "camera"):
        counts = Counter((str(getattr(each, key)) or "stage", each.split) for each in frames)
        values = dict.fromkeys(value for value, _ in sorted(counts))
        rows += [(key, value, *(counts[value, split] for split in splits)) for value in values]
    total = Counter(each.split for each in frames)
    streets = {split: {(f.road, f.street) for f in frames if f.split == split} for split in splits}
    rows.append(("streets", "", *(len(streets[split]) for split in splits)))
    rows.append(("all", "", *(total[split] for split in splits)))
    return _table(("", "", *splits), rows)


def _class_table(figures: FrameStatistics, splits: Sequence[str]) -> str:
    rows: list[tuple[object, ...]] = []
    for entry in labels():
        shares = [figures.shares.get(split, {}).get(entry.name, 0.0) for split in splits]
        rows.append((entry.name, *(f"{share:.2%}" for share in shares)))
    return _table(("class", *splits), rows)


def _depth_rows(figures: FrameStatistics) -> list[tuple[str, float, str]]:
    names = [f"{a:.0f} to {b:.0f}" for a, b in pairwise(DEPTHS)]
    shares = figures.depths.tolist()
    return [
        (name, share, f"{share:.1%}")
        for name, share in zip((*names, f"over {DEPTHS[-1]:.0f}"), shares, strict=bool(shares))
    ]


def _instance_rows(figures: FrameStatistics) -> list[tuple[str, float, str]]:
    if not len(figures.instances):
        return []
    top = int(figures.instances.max())
    borders = np.unique(np.linspace(0, top + 1, _INSTANCE_BINS + 1).round().astype(int))
    counts, _ = np.histogram(figures.instances, borders)
    return [
        (f"{low} to {high - 1}", float(count), str(count))
        for low, high, count in zip(borders[:-1], borders[1:], counts.tolist(), strict=True)
    ]


def _bars(rows: Sequence[tuple[str, float, str]]) -> str:
    """Bars with a name, a length and a text each."""
    if not rows:
        return "<p>Not among the outputs.</p>"
    longest = max(value for _, value, _ in rows) or 1.0
    lines = []
    for number, (name, value, text) in enumerate(rows):
        y, width = 20 * number, _BAR * value / longest
        lines.append(
            f'<text x="130" y="{y + 14}" text-anchor="end">{escape(name)}</text>'
            f'<rect x="140" y="{y + 3}" width="{width:.1f}" height="14"/>'
            f'<text x="{146 + width:.1f}" y="{y + 14}">{escape(text)}</text>'
        )
    size = f'width="{_BAR + 220}" height="{20 * len(rows)}"'
    return f'<svg {size} font-size="13">{"".join(lines)}</svg>'


def _map(road: RoadMap, colours: Mapping[str, str]) -> str:
    """The reference lines of a road file, and a dot for each frame in the colour of its split."""
    points = np.concatenate((*road.lines, road.places))
    low = points.min(axis=0) - 5.0
    size = points.max(axis=0) + 5.0 - low
    scale = _MAP / float(size.max())

    def place(xy: FloatArray) -> FloatArray:
        moved: FloatArray = (xy - low) * (scale, -scale) + (0.0, size[1] * scale)
        return moved

    lines = [
        f'<polyline points="{" ".join(f"{x:.1f},{y:.1f}" for x, y in place(line).tolist())}"/>'
        for line in road.lines
    ]
    dots = [
        f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{_DOT}" fill="{colours[split]}"/>'
        for (x, y), split in zip(place(road.places).tolist(), road.splits, strict=True)
    ]
    names = "; ".join(
        f'<b style="color:{colours[split]}">{escape(split)}</b> {count}'
        for split, count in sorted(Counter(road.splits).items())
    )
    width, height = (size * scale).tolist()
    return (
        f"<h3>{escape(road.name)}</h3><p>{names}</p>"
        f'<svg width="{width:.0f}" height="{height:.0f}" style="background:#f4f7ef">'
        f'<g fill="none" stroke="#999" stroke-width="4">{"".join(lines)}</g>{"".join(dots)}</svg>'
    )


def _figure(sheet: Sheet) -> str:
    title = escape(sheet.title)
    return (
        f'<figure><img src="{escape(sheet.file)}" alt="{title}" loading="lazy">'
        f"<figcaption>{title}</figcaption></figure>"
    )


def _table(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    cells = "".join(
        "<tr>" + "".join(f"<td>{escape(str(cell))}</td>" for cell in row) + "</tr>" for row in rows
    )
    return f"<table><tr>{''.join(f'<th>{escape(name)}</th>' for name in head)}</tr>{cells}</table>"
