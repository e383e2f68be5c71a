"""Thermal emissivity of substances, by words in the names of materials.

Figures at about 300 K from the tables of OMEGA Engineering (non-metals, metals) and, for stone, of
FLIR Systems (rough granite).
"""

from typing import NamedTuple


class Substance(NamedTuple):
    """A substance.

    Attributes:
        words: Words of a material's name, any of which stands for it.
        emissivity: Share of a black body's thermal radiation.
    """

    words: tuple[str, ...]
    emissivity: float


SOURCE = "tables of emissivity of OMEGA Engineering and FLIR Systems"
_SUBSTANCES = (
    Substance(("asphalt", "bitumen"), 0.93),
    Substance(("marking", "paint", "sign"), 0.94),
    Substance(("brick",), 0.93),
    Substance(("tiles",), 0.91),
    Substance(("stone", "flagstone", "setts", "gravel"), 0.88),
    Substance(("curb", "concrete", "paving"), 0.94),
    Substance(("plaster", "render"), 0.91),
    Substance(("glass",), 0.94),
    Substance(("galvanised",), 0.28),
    Substance(("wood", "timber", "bark", "twigs"), 0.9),
)


def substance_of(name: str) -> Substance | None:
    """The substance that a material's name says; `None` for plants, lamps and other names."""
    words = set(name.split("_"))
    return next((each for each in _SUBSTANCES if words & set(each.words)), None)
