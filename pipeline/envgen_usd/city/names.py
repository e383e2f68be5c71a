"""Ids that are allowed in XML."""

import re

_NOT_ALLOWED = re.compile(r"[^\w.\-]")


def ncname(text: str) -> str:
    """Returns a piece of an NCName; texts that differ stay different.

    A character that is not allowed is replaced by its code point, e.g. ``a b`` by ``a_x20_b``; an
    NCName must begin with a letter, so something has to be put before it.
    """
    return _NOT_ALLOWED.sub(lambda found: f"_x{ord(found[0]):x}_", text)
