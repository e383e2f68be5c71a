"""Appearance of signals by country and type (chapter 14).

The type numbers are those of the German StVO (annexes 1 to 4), the Swedish Vägmärkesförordning,
and the US MUTCD. Exporters write the country ``OpenDRIVE`` for German numbers too. Signs of other
states of the Vienna Convention on Road Signs and Signals (1968) have its shapes, by name.
"""

import re
from dataclasses import dataclass

from envgen_usd.models.signals import Signal
from envgen_usd.opendrive.features.name_words import Vocabulary

LIGHT, SIGN, FLAT = "traffic_light", "traffic_sign", "flat"


@dataclass(frozen=True)
class Look:
    """Appearance of a signal.

    Attributes:
        template: ``traffic_sign``, ``traffic_light`` or ``flat`` for road marks.
        shape: ``round``, ``triangle``, ``inverted_triangle``, ``octagon``, ``diamond``,
            ``square``, ``rectangle`` or ``cross``.
        size: Width and height of the face in metres, for signals without a size.
    """

    template: str
    shape: str = ""
    size: tuple[float, float] = (0.6, 0.6)


_LIGHT = Look(LIGHT, "", (0.35, 1.0))
_PEDESTRIAN_LIGHT = Look(LIGHT, "", (0.3, 0.7))
_FLAT = Look(FLAT)
_ROUND = Look(SIGN, "round")
_TRIANGLE = Look(SIGN, "triangle", (0.9, 0.79))
_YIELD = Look(SIGN, "inverted_triangle", (0.9, 0.79))
_STOP = Look(SIGN, "octagon", (0.9, 0.9))
_DIAMOND = Look(SIGN, "diamond", (0.84, 0.84))
_SQUARE = Look(SIGN, "square", (0.6, 0.6))
_PLATE = Look(SIGN, "rectangle", (0.6, 0.33))
_PANEL = Look(SIGN, "rectangle", (0.6, 0.9))
_BOARD = Look(SIGN, "rectangle", (2.5, 1.5))
_BEACON = Look(SIGN, "rectangle", (0.25, 1.0))
_CROSS = Look(SIGN, "cross", (0.9, 0.9))

_OPENDRIVE_LIGHTS = {
    "1000001": _LIGHT,
    "1000002": _PEDESTRIAN_LIGHT,
    "1000007": _PEDESTRIAN_LIGHT,
    "1000008": _LIGHT,
    "1000009": _LIGHT,
    "1000010": _LIGHT,
    "1000011": _LIGHT,
    "1000012": _LIGHT,
    "1000013": _PEDESTRIAN_LIGHT,
    "1000014": _LIGHT,
    "1000015": _LIGHT,
    "1000016": _LIGHT,
    "1000003": _FLAT,
    "1000004": _FLAT,
}
"""Lights and road marks with type numbers of the standard (14.1 of 1.4, annex)."""
_GERMAN = (
    (101, 199, _TRIANGLE),
    (201, 201, _CROSS),
    (205, 205, _YIELD),
    (206, 206, _STOP),
    (208, 208, _ROUND),
    (220, 220, _PLATE),
    (224, 224, _ROUND),
    (229, 229, _PANEL),
    (242, 243, _SQUARE),
    (244, 244, _PANEL),
    (270, 270, _PANEL),
    (290, 292, _PANEL),
    (293, 299, _FLAT),
    (340, 342, _FLAT),
    (301, 301, _TRIANGLE),
    (306, 307, _DIAMOND),
    (308, 308, _SQUARE),
    (310, 311, _BOARD),
    (314, 314, _SQUARE),
    (325, 326, Look(SIGN, "rectangle", (1.0, 0.65))),
    (330, 331, _SQUARE),
    (332, 333, _BOARD),
    (334, 336, _SQUARE),
    (350, 399, _SQUARE),
    (400, 419, _PLATE),
    (420, 437, Look(SIGN, "rectangle", (1.25, 0.35))),
    (438, 459, _BOARD),
    (460, 499, _PANEL),
    (500, 599, _BOARD),
    (600, 699, _BEACON),
    (1000, 1999, _PLATE),
    (202, 299, _ROUND),
    (300, 399, _SQUARE),
)
"""First and last number, and appearance; the first matching row applies."""
_CODE = r"(?![^\W\d])"
"""End of the letters of a code; words continue with letters."""
_SWEDISH = (
    (r"b1\b", _YIELD),
    (r"b2\b", _STOP),
    (r"b[45]\b", _DIAMOND),
    (rf"a{_CODE}", _TRIANGLE),
    (rf"[cd]{_CODE}", _ROUND),
    (rf"[eh]{_CODE}", _SQUARE),
    (rf"f{_CODE}", _BOARD),
)
_US = (
    (r"r1-1\b", _STOP),
    (r"r1-2\b", Look(SIGN, "inverted_triangle", (0.9, 0.9))),
    (rf"w{_CODE}", Look(SIGN, "diamond", (0.75, 0.75))),
    (r"r15-1(?!\d)", _CROSS),
    (rf"[rm]{_CODE}", Look(SIGN, "rectangle", (0.6, 0.75))),
    (rf"[dei]{_CODE}", _BOARD),
    (r"s1(?!\d)", Look(SIGN, "square", (0.75, 0.75))),
)
_NAMES = Vocabulary(
    (
        (_FLAT, ("sg rm", "stencil", "stop line", "holding line", "crosswalk", "zebra")),
        (_LIGHT, ("traffic light", "traffic signal", "signal # light", "light", "light post")),
        (_YIELD, ("give way", "yield")),
        (_SQUARE, ("bus stop", "tram stop")),
        (_STOP, ("stop", "stop sign")),
        (_ROUND, ("speed", "speed limit", "max speed", "no entry", "no parking", "no stopping")),
        (_DIAMOND, ("warning", "ahead", "merge", "curve")),
        (_BOARD, ("city limit", "information", "direction")),
    )
)
_LIES = 0.1
"""Height in metres below which a signal at ground level is a road mark."""


def look_of(signal: Signal) -> Look:
    """Returns the appearance of a signal."""
    type_ = signal.type.strip().lower()
    if type_ in _OPENDRIVE_LIGHTS:
        return _OPENDRIVE_LIGHTS[type_]
    if 0 < signal.height < _LIES and abs(signal.z_offset) < _LIES:
        return _FLAT
    look = _by_country(signal, type_)
    for text in (signal.name, signal.type, signal.subtype):
        if look is None:
            look = _NAMES.meaning(text)
    return look or (_LIGHT if signal.dynamic else _SQUARE)


def _by_country(signal: Signal, type_: str) -> Look | None:
    country = signal.country.strip().lower()
    prefixed = re.fullmatch(r"([a-z]{2}):(.+)", type_)
    if prefixed:
        country, type_ = prefixed[1], prefixed[2]
    if country in {"se", "swe"}:
        return next((look for pattern, look in _SWEDISH if re.match(pattern, type_)), None)
    if country in {"us", "usa"}:
        return next((look for pattern, look in _US if re.match(pattern, type_)), None)
    digits = re.match(r"(\d{3,4})(?!\d)", type_)
    if digits is None:
        return None
    number = int(digits[1])
    return next((look for low, high, look in _GERMAN if low <= number <= high), None)
