"""Reads traces of ASAM OSI: GroundTruth and SensorView, .osi or .mcap, by `betterosi`.

An OSI position is the middle of the bounding box, and the yaw is counter-clockwise from +x
(osi_common.proto, BaseMoving). The trace has to be in the frame of the road file;
`proj_frame_offset` leads from there to a map projection, so it is not added.
"""

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from envgen_usd.errors import EnvgenError, Issue
from envgen_usd.models.actors import Trace
from envgen_usd.traffic.traces.actor_kinds import ActorFacts, facts_of
from envgen_usd.traffic.traces.trace_rows import trace_of_rows


def read_osi(path: Path) -> Trace:
    """Reads a trace.

    Raises:
        EnvgenError: `betterosi` is missing, or the file cannot be read.
    """
    ids: list[str] = []
    rows: list[tuple[float, ...]] = []
    facts: dict[str, ActorFacts] = {}
    issues: list[Issue] = []
    for truth in _truths(path):
        stamp = truth.timestamp
        time = float(stamp.seconds) + float(stamp.nanos) * 1e-9 if stamp else math.nan
        for item in truth.moving_object:
            name = str(item.id.value) if item.id else ""
            if name not in facts:
                facts[name], guessed = _facts(name, item, path.name)
                issues += guessed
            ids.append(name)
            rows.append((time, *_pose(item)))
    if not ids:
        raise EnvgenError(f"{path}: holds no moving object")
    return trace_of_rows(ids, np.array(rows), facts, path.name, issues)


def _truths(path: Path) -> Iterator[Any]:
    try:
        import betterosi  # type: ignore[import-not-found]  # noqa: PLC0415 - an extra
    except ImportError as error:
        raise EnvgenError(
            "traffic --osi: needs betterosi; install the extra: pip install 'envgen-usd[osi]'"
        ) from error
    if path.suffix not in {".osi", ".mcap"}:
        raise EnvgenError(f"{path}: give a trace of ASAM OSI, .osi or .mcap")
    try:
        yield from betterosi.read(str(path), return_ground_truth=True)
    except EnvgenError:
        raise
    except Exception as error:  # decoders of several libraries, each with errors of its own
        reason = getattr(error, "strerror", None) or str(error) or type(error).__name__
        raise EnvgenError(f"{path}: cannot be read as an OSI trace: {reason}") from error


def _pose(item: Any) -> tuple[float, float, float, float]:  # noqa: ANN401 - has no types
    """Position, height of the foot, and yaw; NaN for what is missing."""
    base = item.base
    if not base or not base.position or not base.orientation:
        return math.nan, math.nan, math.nan, math.nan
    half = base.dimension.height / 2 if base.dimension else 0.0
    place = base.position
    return place.x, place.y, place.z - half, base.orientation.yaw


def _facts(name: str, item: Any, source: str) -> tuple[ActorFacts, tuple[Issue, ...]]:  # noqa: ANN401
    size = item.base.dimension if item.base else None
    given = (size.length, size.width, size.height) if size else None
    kind = _word(item.type)
    classification = item.vehicle_classification
    if classification and kind in {"", "vehicle", "unknown", "other"}:
        kind = _word(classification.type)
    names = ("" if kind in {"unknown", "other", "vehicle"} else kind, item.model_reference or "")
    return facts_of(name, names, given, source)


def _word(value: Any) -> str:  # noqa: ANN401
    """Name of an enumeration's value without its prefix, in lower case."""
    name = str(getattr(value, "name", value) or "")
    return name.lower().removeprefix("type_")
