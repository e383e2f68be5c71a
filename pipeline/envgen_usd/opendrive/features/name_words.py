"""Meanings of whole words in the names that exporters give to models.

A name is split into words at underscores, hyphens and blanks, between letters and digits, and where
the case changes: ``CoulPine_Lg01`` has the words ``coul``, ``pine``, ``lg`` and ``01``.
"""

import re
from collections.abc import Iterable, Sequence
from typing import Generic, TypeVar

Meaning = TypeVar("Meaning")

_UPPER, _LOWER = "A-ZÀ-ÖØ-Þ", "a-zß-öø-ÿ"
_JOINTS = re.compile(
    r"[\W_]+|(?<=\d)(?=[^\W\d_])|(?<=[^\W\d_])(?=\d)"
    rf"|(?<=[{_LOWER}])(?=[{_UPPER}])|(?<=[{_UPPER}])(?=[{_UPPER}][{_LOWER}])"
)
_TOKENS = {"#": r"\d+", "^": "^"}


def words_of(name: str) -> tuple[str, ...]:
    """Returns the words of a name, in lower case."""
    return tuple(word.lower() for word in _JOINTS.split(name) if word)


class Vocabulary(Generic[Meaning]):
    """Meanings by phrases of whole words.

    The words of a phrase may be joined in a name, and the last may stand in the plural: ``street
    lamp`` is in ``StreetLamp_3``, ``old street-lamps`` and ``streetlamp``, not in ``StreetClamp``.
    """

    def __init__(self, rows: Iterable[tuple[Meaning, Sequence[str]]]) -> None:
        """Prepares the phrases.

        Args:
            rows: Meanings with their phrases; the first row with a phrase in a name counts. ``#``
                stands for a number, ``*`` for any words or none, ``^`` for the begin of the name.
        """
        self._rows = tuple((_pattern(phrases), meaning) for meaning, phrases in rows)

    def meaning(self, name: str) -> Meaning | None:
        """Meaning of the first row that has a phrase in a name, `None` where no row has."""
        text = " ".join(words_of(name))
        return next((meaning for pattern, meaning in self._rows if pattern.search(text)), None)


def _pattern(phrases: Sequence[str]) -> re.Pattern[str]:
    choices = "|".join(map(_phrase, phrases))
    return re.compile(rf"(?<![^ ])(?:{choices})(?:e?s)?(?![^ ])")


def _phrase(phrase: str) -> str:
    gap = " (?:[^ ]+ )*?"
    return gap.join(
        " ?".join(_TOKENS.get(w, w) for w in part.split()) for part in phrase.split("*")
    )
