"""Reads floating car data of SUMO (Eclipse SUMO, "FCDOutput").

x and y are the middle of the front bumper, in the frame of the network: its `netOffset` is added to
the coordinates of the road file. Angles are degrees clockwise from north. Sizes stand in the
vehicle types of route files; types without them have the sizes of their class.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import cast

import numpy as np
from lxml import etree

from envgen_usd.compressed_files import open_content
from envgen_usd.errors import EnvgenError, Issue, one_line
from envgen_usd.models.actors import Trace
from envgen_usd.models.array_types import FloatArray
from envgen_usd.traffic.traces.actor_kinds import ActorFacts, Size, facts_of, kind_of
from envgen_usd.traffic.traces.trace_rows import trace_of_rows
from envgen_usd.xml_events import safe_iterparse

CLASS_SIZES: Mapping[str, Size] = {
    "passenger": (5.0, 1.8, 1.5),
    "emergency": (6.5, 2.16, 2.86),
    "delivery": (6.5, 2.16, 2.86),
    "truck": (7.1, 2.4, 2.4),
    "trailer": (16.5, 2.55, 4.0),
    "bus": (12.0, 2.5, 3.4),
    "coach": (14.0, 2.6, 4.0),
    "tram": (22.0, 2.4, 3.2),
    "rail_urban": (109.5, 3.0, 3.6),
    "rail": (135.0, 2.84, 3.75),
    "rail_electric": (200.0, 2.95, 3.89),
    "motorcycle": (2.2, 0.9, 1.5),
    "moped": (2.1, 0.8, 1.7),
    "bicycle": (1.6, 0.65, 1.7),
    "scooter": (1.2, 0.5, 1.7),
    "pedestrian": (0.215, 0.478, 1.719),
}
"""Sizes of SUMO's vehicle classes (Eclipse SUMO, "Vehicle Type Parameter Defaults")."""
_DEFAULT_TYPES = {
    "DEFAULT_VEHTYPE": "passenger",
    "DEFAULT_TAXITYPE": "passenger",
    "DEFAULT_BIKETYPE": "bicycle",
    "DEFAULT_PEDTYPE": "pedestrian",
    "DEFAULT_RAILTYPE": "rail",
}
_AXES = ("length", "width", "height")


def read_fcd(path: Path, net: Path | None = None, types: Sequence[Path] = ()) -> Trace:
    """Reads a trace.

    Args:
        path: Floating car data, .xml or .xml.gz.
        net: Network of the simulation, .net.xml or .net.xml.gz; gives its offset. Without it, the
            frame of the trace is that of the road file.
        types: Route files or additional files with the vehicle types.

    Raises:
        EnvgenError: A file cannot be read or is of another kind.
    """
    offset = read_net_offset(net) if net else (0.0, 0.0)
    known = {key: value for file in types for key, value in read_types(file).items()}
    ids: list[str] = []
    values: list[tuple[str, ...]] = []
    time = ""
    kinds: dict[str, tuple[str, str]] = {}
    for element in _elements(path, ("start",), "fcd-export"):
        if element.tag == "timestep":
            time = element.get("time", "")
        elif element.tag in {"vehicle", "person"}:
            key = element.get("id", "")
            kinds.setdefault(key, (element.tag, element.get("type", "")))
            ids.append(key)
            values.append((time, *(element.get(name, "nan") for name in ("x", "y", "z", "angle"))))
    if not ids:
        raise EnvgenError(f"{path}: holds no vehicle and no person")
    facts, issues = _facts(kinds, known, path.name)
    rows = _numbers(values)
    rows[:, 4] = np.pi / 2 - np.radians(rows[:, 4])
    length = np.array([facts[key].size[0] if kinds[key][0] == "vehicle" else 0.0 for key in ids])
    rows[:, 1] -= offset[0] + length / 2 * np.cos(rows[:, 4])
    rows[:, 2] -= offset[1] + length / 2 * np.sin(rows[:, 4])
    return trace_of_rows(ids, rows, facts, path.name, issues)


def read_net_offset(path: Path) -> tuple[float, float]:
    """Returns what a network's coordinates have more than those of the road file, metres.

    Raises:
        EnvgenError: The file is no SUMO network.
    """
    for element in _elements(path, ("start",), "net"):
        if element.tag == "location":
            x, _, y = element.get("netOffset", "0,0").partition(",")
            try:
                return float(x), float(y)
            except ValueError as error:
                raise EnvgenError(f"{path}: netOffset '{x},{y}' is no pair of numbers") from error
    return 0.0, 0.0


def read_types(path: Path) -> dict[str, tuple[str, Size | None]]:
    """Returns the class and the size of each vehicle type of a route file or additional file.

    Raises:
        EnvgenError: The file cannot be read.
    """
    found: dict[str, tuple[str, Size | None]] = {}
    for element in _elements(path, ("start",), ""):
        if element.tag == "vType":
            name = element.get("vClass", "passenger")
            usual = CLASS_SIZES.get(name, CLASS_SIZES["passenger"])
            size = [_number(element.get(axis, "nan")) for axis in _AXES]
            filled = [b if math.isnan(a) else a for a, b in zip(size, usual, strict=True)]
            found[element.get("id", "")] = name, (filled[0], filled[1], filled[2])
    return found


def _facts(
    kinds: Mapping[str, tuple[str, str]],
    known: Mapping[str, tuple[str, Size | None]],
    source: str,
) -> tuple[dict[str, ActorFacts], list[Issue]]:
    facts: dict[str, ActorFacts] = {}
    issues: list[Issue] = []
    for key, (tag, kind) in kinds.items():
        name = kind.partition("@")[0]  # a drawn member of a distribution of types
        called = _DEFAULT_TYPES.get(name, name)
        size: Size | None = CLASS_SIZES.get(called)
        if name in known:
            called, size = known[name]
        if tag == "person" and not kind_of(called):
            called = "pedestrian"
        facts[key], guessed = facts_of(key, (called, name), size, source)
        issues += guessed
    return facts, issues


def _numbers(values: Sequence[tuple[str, ...]]) -> FloatArray:
    try:
        return np.array(values, dtype=np.float64)
    except ValueError:
        return np.array([[_number(cell) for cell in row] for row in values])


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return math.nan


def _elements(path: Path, events: Sequence[str], root: str) -> Iterator[etree._Element]:
    """Yields the elements of a file as they begin, and forgets them.

    Raises:
        EnvgenError: The file cannot be read, or has another root.
    """
    try:
        with open_content(path) as file:
            first = True
            for _, element in safe_iterparse(file, events):
                if first and root and element.tag != root:
                    raise EnvgenError(f"{path}: root element is {element.tag}, expected {root}")
                first = False
                yield element
                while element.getprevious() is not None:
                    del cast("etree._Element", element.getparent())[0]
    except (OSError, etree.XMLSyntaxError) as error:
        reason = getattr(error, "strerror", None) or one_line(error)
        raise EnvgenError(f"{path}: cannot be read: {reason}") from error
