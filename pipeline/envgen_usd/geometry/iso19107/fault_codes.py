"""Codes and names of the faults of polygons and solids."""

from dataclasses import dataclass

from envgen_usd.errors import Issue, Severity

SNAP = 1e-3
"""Metres below which points of a shell coincide and its faces do not cross.

A larger value tolerates more.
"""

NAMES = {
    101: "TOO_FEW_POINTS",
    102: "CONSECUTIVE_POINTS_SAME",
    103: "RING_NOT_CLOSED",
    104: "RING_SELF_INTERSECTION",
    201: "INTERSECTION_RINGS",
    202: "DUPLICATED_RINGS",
    203: "NON_PLANAR_POLYGON_DISTANCE_PLANE",
    204: "NON_PLANAR_POLYGON_NORMALS_DEVIATION",
    205: "POLYGON_INTERIOR_DISCONNECTED",
    206: "INNER_RING_OUTSIDE",
    207: "INNER_RINGS_NESTED",
    208: "ORIENTATION_RINGS_SAME",
    301: "TOO_FEW_POLYGONS",
    302: "SHELL_NOT_CLOSED",
    303: "NON_MANIFOLD_CASE",
    305: "MULTIPLE_CONNECTED_COMPONENTS",
    306: "SHELL_SELF_INTERSECTION",
    307: "POLYGON_WRONG_ORIENTATION",
    401: "INTERSECTION_SHELLS",
    402: "DUPLICATED_SHELLS",
    403: "INNER_SHELL_OUTSIDE",
    404: "SOLID_INTERIOR_DISCONNECTED",
    405: "WRONG_ORIENTATION_SHELL",
    501: "INTERSECTION_SOLIDS",
    502: "DUPLICATED_SOLIDS",
    503: "DISCONNECTED_SOLIDS",
    601: "BUILDINGPARTS_OVERLAP",
    901: "INVALID_INPUT_FILE",
    902: "EMPTY_PRIMITIVE",
}
"""Names of the codes as in val3dity 2.5 (Ledoux, Open Geospatial Data, Software and Standards
3:1, 2018), so that reports are comparable."""

_ORDER = (*(code for code in NAMES if code < 300), 301, 303, 307, 305, 302, 306, 405)
"""Codes in the order of val3dity's checks; later codes follow in ascending order."""


@dataclass(frozen=True)
class Fault:
    """A fault of a polygon or solid.

    Attributes:
        code: A key of `NAMES`.
        polygon: Index of the polygon; -1 for a fault of a shell or a solid.
        shell: Index of the shell; -1 for a polygon without a shell.
        detail: Figures as text.
    """

    code: int
    polygon: int
    shell: int = -1
    detail: str = ""

    @property
    def name(self) -> str:
        """Returns the name of the code."""
        return NAMES[self.code]


def check_order(code: int) -> int:
    """Returns the position of a code in the order of val3dity's checks."""
    return _ORDER.index(code) if code in _ORDER else code


def fault_issue(code: int, where: str, detail: str = "", line: int = 0) -> Issue:
    """Converts a fault to an issue of the kind ``iso19107.<code>``.

    Args:
        code: A key of `NAMES`.
        where: The faulty object.
        detail: Figures as text.
        line: Line in the file; 0 without a line.
    """
    message = f"{NAMES[code]}: {detail}" if detail else NAMES[code]
    return Issue(f"iso19107.{code}", Severity.ERROR, where, message, line=line)
