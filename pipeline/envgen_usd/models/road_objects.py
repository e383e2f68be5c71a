"""Objects beside and on a road (ASAM OpenDRIVE, chapter 13)."""

from dataclasses import dataclass

from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.frozen_model import Model
from envgen_usd.models.kept_records import Record


@dataclass(frozen=True)
class Origin:
    """The object or signal of the file that a patch or a feature shows.

    Attributes:
        road: OpenDRIVE id of its road.
        tag: ``object`` or ``signal``.
        number: Index among the objects or the signals of its road.
        id: Id in the file, which need not be unique.
    """

    road: str
    tag: str
    number: int
    id: str

    @property
    def path(self) -> str:
        """Path of the element in the file, as in issues."""
        return f"road[id={self.road}]/{self.tag}s/{self.tag}[id={self.id}]"


@dataclass(frozen=True, repr=False, eq=False)
class Outline(Model):
    """Outline of an object (13.3).

    Attributes:
        points: N x 3, (s, t, dz) if `in_road` else (u, v, z).
        heights: N, metres, height of the object at each corner.
        ids: N, corner ids; an empty string for a corner without an id.
        in_road: True for cornerRoad, False for cornerLocal.
        closed: False for an open polyline.
        outer: False for an inner ring.
        fill: Fill type, as in the file.
        lane_type: Lane type that the outline represents, as in the file.
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
    """Repetition of an object (13.2); distance 0 extrudes the object continuously.

    Each pair holds the values at the start and at the end. NaN means that the object's value
    applies.
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


@dataclass(frozen=True, repr=False, eq=False)
class RoadObject(Model):
    """An object beside or on a road (chapter 13), or a tunnel or bridge along the road.

    Attributes:
        id: Id in the file.
        type: Object type (``tree``, ``pole``, ``crosswalk``, ``tunnel``, ``bridge``, ...).
        subtype: As in the file.
        name: As in the file.
        s: Metres along the reference line.
        t: Metres to the left of the reference line.
        z_offset: Metres above the road.
        heading: Radians relative to the road.
        pitch: Radians relative to the road.
        roll: Radians relative to the road.
        orientation: ``+``, ``-`` or ``none``.
        length: Metres along the object's x; 0 where the file gives no length.
        width: Metres along the object's y; 0 where the file gives no width.
        height: Metres along the object's z; 0 where the file gives no height.
        radius: Metres, of a round object; 0 where the file gives no radius.
        outlines: Outer and inner rings.
        repeats: Repetitions.
        extra: markings, borders, parkingSpace, skeleton, material, validity, surface, ...
        line: Line in the file.
        reference: For an objectReference, the id of the repeated object; otherwise empty.
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
