"""Scans as LAS 1.4 (ASPRS LAS Specification 1.4 R15), point format 6 with extra bytes."""

import struct
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from envgen_usd.label_taxonomy import labels
from envgen_usd.models.array_types import FloatArray, IntArray

_HEADER = struct.Struct("<4sHHI2H8sBB32s32sHHHIIBHI5I12dQQIQ15Q")
_RECORD = struct.Struct("<H16sHH32s")
_EXTRA = struct.Struct("<2sBB32s4s24s24s24s24s24s32s")
_POINT = np.dtype(
    [
        ("place", "<i4", 3),
        ("intensity", "<u2"),
        ("returns", "u1"),
        ("flags", "u1"),
        ("classification", "u1"),
        ("user_data", "u1"),
        ("scan_angle", "<i2"),
        ("point_source", "<u2"),
        ("gps_time", "<f8"),
    ]
)
"""Point data record format 6, 30 bytes."""
_EXTRAS: Mapping[str, tuple[int, str, str]] = {
    "semantic": (1, "u1", "class id, see labels.json"),
    "part": (1, "u1", "part id, see labels.json"),
    "instance": (5, "<u4", "value as in instance images"),
    "ring": (3, "<u2", "laser, 0 is the uppermost"),
}
"""Data type of the specification, NumPy's type, and description of each extra dimension."""
_SCALE = 0.001
"""Step of coordinates, metres; a larger value rounds more."""
_FORMAT = 6
_WKT = 16
"""Bit of the global encoding that formats from 6 on must have."""
_SINGLE = 1 | 1 << 4
"""The first of one return."""
_UNCLASSIFIED = 1
_CLASSES = {
    "road": 11,
    "parking": 11,
    "sidewalk": 2,
    "terrain": 2,
    "vegetation": 5,
    "building": 6,
    "guard_rail": 19,
    "bridge": 17,
}
"""Standard classes: 2 ground, 5 high vegetation, 6 building, 11 road surface, 17 bridge deck, 19
overhead structure."""


def las_bytes(points: FloatArray, rows: NDArray[np.void]) -> bytes:
    """A LAS file of a scan.

    Intensities are 0 to 65535. The time of a point is its second in the turn. The file names no
    coordinate system and no date, so that the same scan has the same bytes.

    Args:
        points: N x 3, metres, world.
        rows: N rows with ``intensity``, ``time`` and the extra dimensions.
    """
    kinds = [(name, kind) for name, (_, kind, _) in _EXTRAS.items()]
    records = np.zeros(len(points), np.dtype([*_POINT.descr, *kinds]))
    low = np.floor(points.min(axis=0)) if len(points) else np.zeros(3)
    records["place"] = np.round((points - low) / _SCALE)
    records["intensity"] = np.round(rows["intensity"] * np.float32(65535.0))
    records["returns"] = _SINGLE
    classes = np.full(256, _UNCLASSIFIED, np.uint8)
    for entry in labels():
        classes[entry.id] = _CLASSES.get(entry.name, _UNCLASSIFIED)
    semantic: IntArray = rows["semantic"]
    records["classification"] = classes[semantic]
    records["gps_time"] = rows["time"]
    for name in _EXTRAS:
        records[name] = rows[name]
    described = b"".join(_described(name) for name in _EXTRAS)
    extra = _RECORD.pack(0, b"LASF_Spec", 4, len(described), b"extra dimensions") + described
    return _header(records, low, len(extra)) + extra + records.tobytes()


def _described(name: str) -> bytes:
    """Entry of a dimension in the record of extra bytes (192 bytes)."""
    kind, _, text = _EXTRAS[name]
    nothing = b"", b"", b"", b"", b""
    return _EXTRA.pack(b"", kind, 0, name.encode(), b"", *nothing, text.encode())


def _header(records: NDArray[np.void], low: FloatArray, extra: int) -> bytes:
    """Public header block, 375 bytes."""
    count = len(records)
    places = records["place"] * _SCALE + low
    bounds = [value for axis in range(3) for value in _limits(places[:, axis])]
    return _HEADER.pack(
        b"LASF",
        0,
        _WKT,
        *(0, 0, 0, b""),  # no project
        *(1, 4),
        b"EXTRACTION",
        b"envgen-usd",
        *(0, 0),  # no date
        _HEADER.size,
        _HEADER.size + extra,
        1,  # variable length record
        _FORMAT,
        records.dtype.itemsize,
        *(0, 0, 0, 0, 0, 0),  # numbers of older formats
        *(_SCALE, _SCALE, _SCALE),
        *low,
        *bounds,
        *(0, 0, 0),  # no waveforms, no extended records
        count,
        *(count, *[0] * 14),  # all are first returns
    )


def _limits(values: FloatArray) -> tuple[float, float]:
    """Largest and least value; 0 without values."""
    return (float(values.max()), float(values.min())) if len(values) else (0.0, 0.0)
