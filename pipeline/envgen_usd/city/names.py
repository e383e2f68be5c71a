"""Ids that are allowed in XML, and references to them."""

import re

from envgen_usd.chunks import CITY_FILE

_NOT_ALLOWED = re.compile(r"[^\w.\-]")


def ncname(text: str) -> str:
    """Returns a piece of an NCName; texts that differ stay different.

    A character that is not allowed is replaced by its code point, e.g. ``a b`` by ``a_x20_b``; an
    NCName must begin with a letter, so something has to be put before it.
    """
    return _NOT_ALLOWED.sub(lambda found: f"_x{ord(found[0]):x}_", text)


def reference(name: str, folder: str = "") -> str:
    """Returns what a feature is referred to by, as `CityObject.relations` has it.

    Args:
        name: Its id.
        folder: Folder of its file, where it lies in the file of another chunk.
    """
    return f"../{folder}/{CITY_FILE}#{name}" if folder else name
