"""Reads counts of what stands in real streets: a CSV file."""

import csv
import math
from dataclasses import dataclass
from pathlib import Path

from envgen_usd.errors import EnvgenError

COLUMNS = ("kind", "variant", "count", "spacing", "area")
_NEEDED = 3


@dataclass(frozen=True)
class Observed:
    """A row: how often something was counted.

    Attributes:
        kind: Kind of asset, e.g. ``bin``; ``street_tree`` for trees along streets.
        variant: ``set=variant``, a variant whose set is unambiguous, an asset of the kind, or empty
            for the kind as a whole.
        count: Number that was counted.
        spacing: Metres of street for each, or `None`.
        area: Square metres that were searched, or `None`.
        line: Line of the file.
    """

    kind: str
    variant: str
    count: int
    spacing: float | None
    area: float | None
    line: int


def read_counts(path: Path) -> tuple[Observed, ...]:
    """Reads a CSV file with the columns `COLUMNS`; the last two may be missing or empty.

    Raises:
        EnvgenError: The file cannot be read, or a row does not match; the message names its line.
    """
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            rows = list(csv.reader(file))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise EnvgenError(f"{path}: cannot be read as CSV: {error}") from error
    header = tuple(cell.strip() for cell in rows[0]) if rows else ()
    if header[:_NEEDED] != COLUMNS[:_NEEDED] or not set(header) <= set(COLUMNS):
        raise EnvgenError(
            f"{path}: line 1: expected the columns {','.join(COLUMNS)}, of which the last two may "
            f"be missing; not {','.join(header)}"
        )
    counts = []
    for number, cells in enumerate(rows[1:], start=2):
        if any(cell.strip() for cell in cells):
            counts.append(_row(dict(zip(header, cells, strict=False)), number, path))
    if not counts:
        raise EnvgenError(f"{path}: holds no counts below its first line")
    return tuple(counts)


def _row(cells: dict[str, str], line: int, path: Path) -> Observed:
    where = f"{path}: line {line}"
    kind = cells.get("kind", "").strip()
    if not kind:
        raise EnvgenError(f"{where}: kind is missing")
    text = cells.get("count", "").strip()
    if not text.isdigit():
        raise EnvgenError(f"{where}: count: expected a whole number, not '{text}'")
    spacing, area = (_figure(cells.get(name, ""), name, where) for name in COLUMNS[_NEEDED:])
    return Observed(kind, cells.get("variant", "").strip(), int(text), spacing, area, line)


def _figure(text: str, name: str, where: str) -> float | None:
    """A number above 0, or `None` for an empty cell."""
    if not text.strip():
        return None
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not (math.isfinite(value) and value > 0.0):
        raise EnvgenError(f"{where}: {name}: expected a number above 0, not '{text.strip()}'")
    return value
