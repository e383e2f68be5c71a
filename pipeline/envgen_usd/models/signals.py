"""Signals (ASAM OpenDRIVE, chapter 14)."""

from dataclasses import dataclass

from envgen_usd.models.kept_records import Record


@dataclass(frozen=True)
class Signal:
    """A sign, light or marking that regulates traffic (chapter 14).

    Attributes:
        id: Id in the file.
        name: As in the file.
        type: Country-specific code.
        subtype: Country-specific code.
        country: ISO 3166, as in the file.
        s: Metres along the reference line.
        t: Metres to the left of the reference line.
        z_offset: Metres from the road to the signal's lower edge.
        heading: `hOffset` in radians relative to the road; absolute with `position`.
        pitch: Radians, relative to the road; absolute with `position`.
        roll: Radians, relative to the road; absolute with `position`.
        orientation: Direction of travel that the signal regulates: ``+``, ``-`` or ``none``.
        dynamic: True for a light or a variable message sign.
        width: Metres; 0 where the file gives no width.
        height: Metres; 0 where the file gives no height.
        value: Value on the face; NaN without a value.
        unit: Unit of the value.
        text: Text on the face.
        position: 3, metres, physical position by positionInertial; `None` without that element.
        reference: For a signalReference, the id of the repeated signal; otherwise empty.
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
