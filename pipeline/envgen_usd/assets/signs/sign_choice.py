"""Which face a signal shows, from the attributes that CityGML keeps of it."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from envgen_usd.assets.signs.sign_sheets import FaceRow, SignSheet, variant_name

_KMH = 3.6
"""Kilometres per hour in a metre per second."""


@dataclass(frozen=True)
class SignalFacts:
    """What a signal says: its attributes in OpenDRIVE (14.1), as text.

    Attributes:
        country: In lower case; empty without one.
        type: Code, or several that ``;`` or ``,`` separate.
        subtype: Code.
        name: Name.
        text: Text on the face.
        value: Number on the face; 0 without one.
    """

    country: str
    type: str
    subtype: str
    name: str
    text: str
    value: float

    @classmethod
    def of(cls, attributes: Mapping[str, object]) -> "SignalFacts":
        """Reads the attributes ``opendrive_*`` of a feature."""
        texts = {
            key: str(attributes.get(f"opendrive_{key}", "")).strip()
            for key in ("country", "type", "subtype", "name", "text")
        }
        value = attributes.get("opendrive_value", 0.0)
        number = float(value) if isinstance(value, int | float) else 0.0
        return cls(**{**texts, "country": texts["country"].lower()}, value=max(number, 0.0))


def sign_face(facts: SignalFacts, sheets: tuple[SignSheet, ...]) -> tuple[str, str] | None:
    """Returns the asset and the variant of the face of a signal; `None` for an unknown sign.

    1. The codes of the type, of the type with its subtype, or of the name ``de_274-50``.
    2. The name, the type and the type with its subtype, as words.
    3. Within a family, the number: the value, that of the subtype, that in the code or the name;
       or the word: the text or the name. Without it, the family's first face.
    """
    known = {country for sheet in sheets for country in sheet.countries}
    for code in _codes(facts):
        for sheet in sheets:
            # Exporters of countries without a sheet write German numbers too.
            own = facts.country in sheet.countries
            ours = own or (
                facts.country not in known and code[0].isdigit() and "" in sheet.countries
            )
            for row in sheet.face:
                if f"{facts.country}:{code}" in row.codes or (ours and code in row.codes):
                    return sheet.asset, _variant(row, sheet, facts, code)
    for word in _words(facts):
        for sheet in sorted(sheets, key=lambda sheet: facts.country not in sheet.countries):
            for row in sheet.face:
                if word in row.names:
                    return sheet.asset, _variant(row, sheet, facts, word)
    return None


def _codes(facts: SignalFacts) -> Iterator[str]:
    """Codes of a signal, the closest first: ``274-56``, ``274``, ``se:c31``."""
    named = re.fullmatch(r"([a-z]{2})_(\d.*)", facts.name.lower())
    types = re.split(r"[;,]", facts.type.lower()) if facts.type not in {"", "-1"} else []
    if not types and named:
        types = [named[2]]
    for part in types:
        code = re.sub(r"^[a-z]{2}:", "", part.strip())
        if facts.subtype not in {"", "-1"}:
            yield f"{code}-{facts.subtype.lower()}"
            yield f"{code}{facts.subtype.lower()}"
        yield from filter(None, (code, re.sub(r"\[.*", "", code), re.sub(r"-.*", "", code)))


def _words(facts: SignalFacts) -> Iterator[str]:
    for text in (facts.name, facts.type, f"{facts.type} {facts.subtype}", facts.subtype):
        letters = re.sub(r"[^a-z]", "", text.lower().removesuffix(".flt"))
        # Most objects have no text at all, and no face has an empty name.
        yield from filter(None, (letters.removeprefix("sign"), re.sub(r"^.*signs", "", letters)))


def _variant(row: FaceRow, sheet: SignSheet, facts: SignalFacts, code: str) -> str:
    if row.values:
        numbers = list(_numbers(facts, sheet, code))
        fits = [number for number in numbers if number in row.values]
        return variant_name(row, str(fits[0] if fits else row.values[0]))
    if row.words:
        asked = {text.lower() for text in (facts.text, facts.name)}
        fits_words = [word for word in row.words if word.lower() in asked]
        return variant_name(row, (fits_words or row.words)[0])
    return variant_name(row, "")


def _numbers(facts: SignalFacts, sheet: SignSheet, code: str) -> Iterator[int]:
    """Numbers that the face may show, the likeliest first; a value may be in m/s or in tens."""
    if facts.value > 0 and facts.country != "se":
        yield round(facts.value)
        yield round(facts.value * _KMH)
    yield sheet.value_of_subtype.get(facts.subtype, 0)
    if facts.country == "se":
        yield round(facts.value * 10)
    for text in (facts.text, facts.type, code, facts.name):
        numbers = re.findall(r"\d+", text)
        yield from map(int, reversed(numbers))
