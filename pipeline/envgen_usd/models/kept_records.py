"""Elements of a file in their original form."""

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Record:
    """An element without a specific model: speed, access, material, user data, ...

    Attributes:
        tag: Element name.
        attributes: XML attributes.
        children: Child elements.
        text: Text, stripped.
        line: Line in the file.
    """

    tag: str
    attributes: Mapping[str, str] = field(default_factory=dict)
    children: tuple["Record", ...] = ()
    text: str = ""
    line: int = 0
