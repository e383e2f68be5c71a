"""Ids that are valid in XML, and references to them."""

import re

from envgen_usd.chunks import CITY_FILE

_NOT_ALLOWED = re.compile(r"[^\w.\-]")


def ncname(text: str) -> str:
    """Returns a piece of an NCName; different texts stay different.

    The code point replaces an invalid character, e.g. ``a_x20_b`` for ``a b``. An NCName must begin
    with a letter, so callers add a prefix.
    """
    return _NOT_ALLOWED.sub(lambda match: f"_x{ord(match[0]):x}_", text)


def reference(name: str, folder: str = "") -> str:
    """Returns the reference to a feature, as in `CityObject.relations`.

    Args:
        name: Id of the feature.
        folder: Folder of its file, if it lies in the file of another chunk.
    """
    return f"../{folder}/{CITY_FILE}#{name}" if folder else name
