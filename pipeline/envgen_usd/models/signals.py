"""Signals (ASAM OpenDRIVE, chapter 14)."""

from dataclasses import dataclass

from envgen_usd.models.records import Record


@dataclass(frozen=True)
class Signal:
    """A sign, light or marking that regulates traffic (chapter 14).

    Attributes:
        id: Id in the file.
        name: As in the file.
        type: Country-specific code.
        subtype: Country-specific code.
        country: ISO 3166, as in the file.
        s: On the road.
        t: On the road.
        z_offset: Of its lower edge, above the road.
        heading: `hOffset`, relative to the road, or absolute with `position`.
        pitch: Relative.
        roll: Relative.
        orientation: ``+``, ``-`` or ``none``: for which direction of travel it holds.
        dynamic: True for a light or a board that changes.
        width: Metres, 0 where the file gives none.
        height: Metres, 0 where the file gives none.
        value: Value on the face, NaN where there is none.
        unit: Unit of the value.
        text: Text on the face.
        position: 3, where a positionInertial places it physically; else none.
        reference: Id of the signal that a signalReference repeats; else empty.
        extra: validity, dependency, reference, board, user data, ...
        line: Line in the file.
    """

    id: str
    name: str
    type: str
    subtype: str
    country: str
    s: float
    t: float
    z_offset: float
    heading: float
    pitch: float
    roll: float
    orientation: str
    dynamic: bool
    width: float
    height: float
    value: float
    unit: str
    text: str
    position: tuple[float, float, float] | None = None
    reference: str = ""
    extra: tuple[Record, ...] = ()
    line: int = 0
