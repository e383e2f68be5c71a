"""Objects beside and on a road (ASAM OpenDRIVE, chapter 13)."""

from dataclasses import dataclass

from envgen_usd.models.arrays import FloatArray
from envgen_usd.models.records import Record


@dataclass(frozen=True)
class Outline:
    """Outline of an object (13.3).

    Attributes:
        points: N x 3, (s, t, dz) if `in_road` else (u, v, z).
        heights: N, height of the object at each corner.
        ids: N, corner ids, empty strings where there are none.
        in_road: True for cornerRoad, False for cornerLocal.
        closed: False for a line.
        outer: False for an inner ring.
        fill: Fill type, as in the file.
        lane_type: Lane type that the outline stands for, as in the file.
    """

    points: FloatArray
    heights: FloatArray
    ids: tuple[str, ...]
    in_road: bool
    closed: bool = True
    outer: bool = True
    fill: str = ""
    lane_type: str = ""


@dataclass(frozen=True)
class Repeat:
    """Repetition of an object (13.2); distance 0 extrudes it continuously.

    Each pair is the value at the start and at the end; NaN where the file gives none and the
    object's own value holds.
    """

    s: float
    length: float
    distance: float
    t: tuple[float, float]
    z_offset: tuple[float, float]
    width: tuple[float, float]
    height: tuple[float, float]
    extent: tuple[float, float]
    radius: tuple[float, float]
    detach_from_reference_line: bool = False


@dataclass(frozen=True)
class RoadObject:
    """An object beside or on a road (chapter 13), or a tunnel or bridge over a stretch of it.

    Attributes:
        id: Id in the file.
        type: Object type (``tree``, ``pole``, ``crosswalk``, ``tunnel``, ``bridge``, ...).
        subtype: As in the file.
        name: As in the file.
        s: On the road.
        t: On the road.
        z_offset: Above the road.
        heading: Relative to the road.
        pitch: Relative to the road.
        roll: Relative to the road.
        orientation: ``+``, ``-`` or ``none``.
        length: Along its own x; 0 where the file gives none.
        width: Along its own y.
        height: Along its own z.
        radius: Of a round object; 0 where the file gives none.
        outlines: Outer and inner rings.
        repeats: Repetitions.
        extra: markings, borders, parkingSpace, skeleton, material, validity, surface, ...
        line: Line in the file.
        reference: Id of the object that an objectReference repeats for this road; else empty.
    """

    id: str
    type: str
    subtype: str
    name: str
    s: float
    t: float
    z_offset: float
    heading: float
    pitch: float
    roll: float
    orientation: str
    length: float
    width: float
    height: float
    radius: float
    outlines: tuple[Outline, ...] = ()
    repeats: tuple[Repeat, ...] = ()
    extra: tuple[Record, ...] = ()
    line: int = 0
    reference: str = ""
