"""Reads CSV files of esmini: those of `--csv_logger`, and those that its `dat2csv` writes.

Columns of the logger, as esmini 2.3 to 3.7 name them: ``Index [-]``, ``TimeStamp [s]``, and for
each entity ``#1 Entity_Name [-]`` (older: ``Entitity_Name``), ``#1 World_Position_X [m]``,
``#1 World_Heading_Angle [rad]``, ``#1 bb_x [m]`` (middle of the box from the reference point),
``#1 bb_length [m]``, ... Columns of `dat2csv`: ``time, id, name, x, y, z, h, p, r, ...``. Beside
the latter, we read ``kind``, ``length``, ``width``, ``height``, which other programs can add.
"""

import csv
import io
import math
import re
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from envgen_usd.compressed_files import LARGEST_WHOLE, read_content
from envgen_usd.errors import EnvgenError, Issue, Severity
from envgen_usd.models.actors import Trace
from envgen_usd.models.array_types import FloatArray
from envgen_usd.traffic.traces.actor_kinds import ActorFacts, Size, facts_of
from envgen_usd.traffic.traces.trace_rows import trace_of_rows

_HEADER_LINES = 20
"""Lines among which the header is sought; esmini writes up to 4 lines before it."""
_ENTITY = re.compile(r"#(\d+) enti(?:ti)?ty_name")
_REAR_AXLE = {"car": 0.3, "van": 0.3, "truck": 0.3, "bus": 0.25}
"""Distance from the rear axle to the middle of the box, as a share of the length, by kind."""


def read_csv_trace(path: Path) -> Trace:
    """Reads a trace.

    Raises:
        EnvgenError: The file cannot be read, or lacks a column.
    """
    try:
        text = read_content(path, LARGEST_WHOLE).decode("utf-8-sig", errors="replace")
        table = csv.reader(io.StringIO(text, newline=""))
        lines = [[cell.strip() for cell in line] for line in table]
    except (OSError, csv.Error) as error:
        reason = getattr(error, "strerror", None) or error
        raise EnvgenError(f"{path}: cannot be read: {reason}") from error
    for number, line in enumerate(lines[:_HEADER_LINES]):
        header = [_plain(cell) for cell in line]
        if "timestamp" in header:
            return _logged(path, header, lines[number + 1 :])
        if "time" in header:
            return _listed(path, header, lines[number + 1 :])
    raise EnvgenError(
        f"{path}: no header with a column 'time' (dat2csv) or 'TimeStamp [s]' (--csv_logger)"
    )


def _plain(cell: str) -> str:
    """Name of a column without its unit, in lower case."""
    return cell.partition("[")[0].strip().lower()


def _number(cell: str) -> float:
    try:
        return float(cell)
    except ValueError:
        return math.nan


class _Table:
    """Lines below a header."""

    def __init__(self, path: Path, header: Sequence[str], lines: Sequence[Sequence[str]]) -> None:
        self._path = path
        self._place = {name: place for place, name in reversed([*enumerate(header)]) if name}
        self.lines = [line for line in lines if any(line)]

    def has(self, name: str) -> bool:
        return name in self._place

    def texts(self, name: str) -> list[str]:
        place = self._place[name]
        return [line[place] if place < len(line) else "" for line in self.lines]

    def numbers(self, name: str, *others: str) -> FloatArray:
        """Values of a column, NaN for what is no number; the first name that exists counts."""
        for known in (name, *others):
            if known in self._place:
                return np.array([_number(cell) for cell in self.texts(known)], dtype=np.float64)
        raise EnvgenError(f"{self._path}: lacks the column '{name}'")


def _listed(path: Path, header: Sequence[str], lines: Sequence[Sequence[str]]) -> Trace:
    """A row for each actor and time (dat2csv)."""
    table = _Table(path, header, lines)
    names = table.texts("name") if table.has("name") else [""] * len(table.lines)
    column = next((each for each in ("id", "name") if table.has(each)), "")
    if not column:
        raise EnvgenError(f"{path}: lacks the columns 'id' and 'name'")
    ids = table.texts(column)
    columns = [table.numbers(name) for name in ("time", "x", "y")]
    nothing = np.full(len(ids), np.nan)
    columns.append(table.numbers("z") if table.has("z") else nothing)
    columns.append(table.numbers("h", "heading"))
    kinds = table.texts("kind") if table.has("kind") else [""] * len(ids)
    axes = ("length", "width", "height")
    sizes = np.stack([table.numbers(axis) if table.has(axis) else nothing for axis in axes], axis=1)
    facts: dict[str, ActorFacts] = {}
    issues: list[Issue] = []
    for key, name, kind, size in zip(ids, names, kinds, sizes.tolist(), strict=True):
        if key not in facts:
            given: Size = (size[0], size[1], size[2])
            facts[key], guessed = facts_of(key, (kind, name), given, path.name)
            issues += guessed
    rows = np.stack(columns, axis=1)
    if not all(table.has(axis) for axis in axes):
        rows, moved = _from_rear_axle(rows, ids, facts, path.name)
        issues += moved
    return trace_of_rows(ids, rows, facts, path.name, issues)


def _from_rear_axle(
    rows: FloatArray, ids: Sequence[str], facts: dict[str, ActorFacts], source: str
) -> tuple[FloatArray, list[Issue]]:
    """Moves reference points of vehicles to the middle of a box of usual size."""
    ahead = np.array([_REAR_AXLE.get(facts[key].kind, 0.0) * facts[key].size[0] for key in ids])
    moved = rows.copy()
    moved[:, 1] += ahead * np.cos(rows[:, 4])
    moved[:, 2] += ahead * np.sin(rows[:, 4])
    text = "gives no sizes; its places are those of rear axles"
    done = "usual sizes, and the middle of each vehicle ahead of its rear axle"
    return moved, [Issue("traffic.no_sizes", Severity.INFO, source, text, done)]


def _logged(path: Path, header: Sequence[str], lines: Sequence[Sequence[str]]) -> Trace:
    """A row for each time, with columns for each actor (--csv_logger)."""
    table = _Table(path, header, lines)
    times = table.numbers("timestamp")
    ids: list[str] = []
    facts: dict[str, ActorFacts] = {}
    issues: list[Issue] = []
    parts = []
    for number, name_column in _entities(header):
        column = f"#{number} "
        names = table.texts(name_column)
        key = next(filter(None, names), "")
        if not key:
            continue
        key = f"{key}_{number}" if key in facts else key
        box = [
            _first(table.numbers(f"{column}bb_{axis}")) for axis in ("length", "width", "height")
        ]
        facts[key], guessed = facts_of(key, (key,), (box[0], box[1], box[2]), path.name)
        issues += guessed
        place = [table.numbers(f"{column}world_position_{axis}") for axis in "xyz"]
        heading = table.numbers(f"{column}world_heading_angle")
        ahead, left = (_first(table.numbers(f"{column}bb_{axis}")) for axis in "xy")
        place[0] = place[0] + ahead * np.cos(heading) - left * np.sin(heading)
        place[1] = place[1] + ahead * np.sin(heading) + left * np.cos(heading)
        parts.append(np.stack([times, *place, heading], axis=1))
        ids += [key] * len(times)
    if not parts:
        raise EnvgenError(f"{path}: has no column '#1 Entity_Name'")
    return trace_of_rows(ids, np.concatenate(parts), facts, path.name, issues)


def _entities(header: Sequence[str]) -> Iterator[tuple[str, str]]:
    """Number of each entity, and its column of names."""
    for name in header:
        match = _ENTITY.fullmatch(name)
        if match:
            yield match[1], name


def _first(values: FloatArray) -> float:
    """First number of a column, or 0."""
    known = values[np.isfinite(values)]
    return float(known[0]) if len(known) else 0.0
