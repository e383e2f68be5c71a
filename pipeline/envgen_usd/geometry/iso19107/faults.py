"""Codes and names of what can be wrong with a polygon or a solid."""

from dataclasses import dataclass

SNAP = 1e-3
"""Points nearer than this (metres) are one point, and an overlap smaller than this is none."""

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
    601: "BUILDINGPARTS_OVERLAP",
    901: "INVALID_INPUT_FILE",
    902: "EMPTY_PRIMITIVE",
}
"""Names of the codes as in val3dity 2.5 (Ledoux, Open Geospatial Data, Software and Standards
3:1, 2018), so that reports can be compared."""


@dataclass(frozen=True)
class Fault:
    """Something wrong.

    Attributes:
        code: A key of `NAMES`.
        polygon: Index of the polygon, or -1 where a shell or a solid as a whole is meant.
        shell: Index of the shell, or -1 where the polygon need not belong to one.
        detail: Figures, in words.
    """

    code: int
    polygon: int
    shell: int = -1
    detail: str = ""

    @property
    def name(self) -> str:
        """Name of the code."""
        return NAMES[self.code]
