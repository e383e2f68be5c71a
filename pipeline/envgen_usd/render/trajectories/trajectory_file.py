"""Reads camera poses from a file: a table (CSV), or the ``cameras.json`` of an earlier run."""

import csv
import json
from collections.abc import Iterable, Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from envgen_usd.errors import EnvgenError
from envgen_usd.models.array_types import FloatArray
from envgen_usd.render.cameras.camera_pose import Pose, on_grid

FILE_ENDINGS = (".csv", ".json")
_NEEDED = ("x", "y", "z", "yaw")
_COLUMNS = (*_NEEDED, "pitch", "roll", "time", "route")
_FARTHEST = 1e7
"""Largest coordinate of a pose, metres; a larger value allows places with coarser coordinates."""
_SKEW = 1e-4
"""Largest deviation of a rotation's columns from unit length and right angles.

A larger value accepts coarser files.
"""


def read_poses(path: Path) -> tuple[Pose, ...]:
    """Reads the camera poses of a file.

    A ``.csv`` file has a header and a row for each pose: ``x``, ``y``, ``z`` of the camera in
    metres (world, z up), and ``yaw`` in degrees, counter-clockwise from the x axis. ``pitch`` (up
    is positive), ``roll`` (right side down is positive), ``time`` in seconds, and ``route`` are
    optional. A ``.json`` file has a table ``frames`` with ``camera_to_world`` (4 x 4), as
    ``cameras.json`` has.

    Raises:
        EnvgenError: The file or a row cannot be used; the message names both.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "it is no UTF-8 text"
        raise EnvgenError(f"{path}: the trajectory cannot be read: {reason}") from error
    poses = _from_json(path, text) if path.suffix.lower() == ".json" else _from_csv(path, text)
    if not poses:
        raise EnvgenError(f"{path}: the trajectory has no poses")
    _check_times(path, poses)
    return poses


def _from_csv(path: Path, text: str) -> tuple[Pose, ...]:
    rows = csv.DictReader(text.splitlines(), skipinitialspace=True, strict=True)
    try:
        names = [name.strip() for name in rows.fieldnames or ()]
        missing = [name for name in _NEEDED if name not in names]
        unknown = [name for name in names if name not in _COLUMNS]
        if missing or unknown:
            faults = [f"missing column {', '.join(missing)}"] if missing else []
            faults += [f"unknown column {', '.join(unknown)}"] if unknown else []
            raise EnvgenError(f"{path}: {'; '.join(faults)}; known: {', '.join(_COLUMNS)}")
        rows.fieldnames = names
        return tuple(_from_row(row, f"{path}: row {rows.line_num}") for row in rows)
    except csv.Error as error:
        raise EnvgenError(f"{path}: row {rows.line_num}: {error}") from error


def _from_row(row: Mapping[str | None, Any], where: str) -> Pose:
    if None in row:
        raise EnvgenError(f"{where}: has more values than the header has names")
    figures = {
        name: _number(row[name] or "", f"{where}: {name}", empty=name not in _NEEDED)
        for name in _COLUMNS
        if name in row
    }
    place = np.array([figures[name] for name in "xyz"], np.float64)
    angles = np.radians([figures.get(name) or 0.0 for name in ("yaw", "pitch", "roll")])
    matrix = np.eye(4)
    matrix[:3, :3] = _axes(*angles.tolist())
    matrix[:3, 3] = place
    return _pose(matrix, figures.get("route") or 0.0, figures.get("time"), where)


def _number(text: str, where: str, *, empty: bool) -> float | None:
    if empty and not text.strip():
        return None
    try:
        return float(text)
    except ValueError:
        raise EnvgenError(f"{where}: expected a number, not {text!r}") from None


def _axes(yaw: float, pitch: float, roll: float) -> FloatArray:
    """Columns: right, down and ahead of the camera in the world; radians."""
    ahead = np.array([np.cos(yaw) * np.cos(pitch), np.sin(yaw) * np.cos(pitch), np.sin(pitch)])
    level = np.array([np.sin(yaw), -np.cos(yaw), 0.0])
    down = np.cross(ahead, level)
    right = np.cos(roll) * level + np.sin(roll) * down
    return np.stack((right, np.cross(ahead, right), ahead), axis=1)


def _from_json(path: Path, text: str) -> tuple[Pose, ...]:
    expected = f"{path}: expected JSON with a table 'frames', as cameras.json has"
    try:
        content = json.loads(text)
    except ValueError as error:
        raise EnvgenError(f"{expected} ({error})") from error
    if not isinstance(content, dict) or "frames" not in content:
        raise EnvgenError(expected)
    rows = content["frames"]
    if not isinstance(rows, list):
        raise EnvgenError(f"{path}: 'frames' is no list of poses")
    return tuple(_from_record(row, f"{path}: frames[{n}]") for n, row in enumerate(rows))


def _from_record(row: Any, where: str) -> Pose:  # noqa: ANN401 - JSON of any content
    if not isinstance(row, dict) or "camera_to_world" not in row:
        raise EnvgenError(f"{where}: missing camera_to_world")
    try:
        matrix = np.array(row["camera_to_world"], np.float64)
        figures = [row.get(name, 0) for name in ("route", "turn", "time")]
        route, turn, time = (None if value is None else float(value) for value in figures)
    except (TypeError, ValueError) as error:
        raise EnvgenError(f"{where}: expected numbers ({error})") from error
    time = time if "time" in row else None
    return _pose(matrix, route or 0.0, time, where, turn or 0.0)


def _pose(
    matrix: FloatArray, route: float, time: float | None, where: str, turn: float = 0.0
) -> Pose:
    """Checks the figures of a pose."""
    if matrix.shape != (4, 4) or not np.isfinite(matrix).all():
        raise EnvgenError(f"{where}: camera_to_world is not 4 x 4 finite numbers")
    if np.abs(matrix[:3, 3]).max() > _FARTHEST:
        raise EnvgenError(f"{where}: lies farther than {_FARTHEST:g} m from the origin")
    turned = matrix[:3, :3]
    if np.abs(turned.T @ turned - np.eye(3)).max() > _SKEW or np.linalg.det(turned) < 0.0:
        raise EnvgenError(f"{where}: camera_to_world is no rotation and translation")
    if not (np.isfinite([route, turn]).all() and route == int(route) and turn == int(turn)):
        raise EnvgenError(f"{where}: route and turn are whole numbers")
    if time is not None and not np.isfinite(time):
        raise EnvgenError(f"{where}: time is not a finite number")
    placed = matrix.copy()
    placed[:3, 3] = on_grid(matrix[:3, 3])
    placed[3] = 0.0, 0.0, 0.0, 1.0
    return Pose(placed, int(route), int(turn), time)


def _check_times(path: Path, poses: Iterable[Pose]) -> None:
    """Times grow along a route."""
    for number, (one, other) in enumerate(pairwise(poses), 1):
        if (
            one.time is None
            or other.time is None
            or (one.route, one.turn)
            != (
                other.route,
                other.turn,
            )
        ):
            continue
        if other.time <= one.time:
            raise EnvgenError(
                f"{path}: pose {number}: time {other.time:g} s is not after {one.time:g} s"
                " of the pose before it on its route; give poses that are no drive a route each,"
                " or no time"
            )
