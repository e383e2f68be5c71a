"""Elements of a file that are kept as they are."""

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Record:
    """An element kept by its attributes: speed, access, material, user data, ...

    Attributes:
        tag: Element name.
        attributes: XML attributes.
        children: Elements below.
        text: Text, stripped.
        line: Line in the file.
    """

    tag: str
    attributes: Mapping[str, str] = field(default_factory=dict)
    children: tuple["Record", ...] = ()
    text: str = ""
    line: int = 0
