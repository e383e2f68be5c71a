"""Reports the areas between lanes that the program paves beyond the file."""

from collections.abc import Iterable, Iterator

import numpy as np

from envgen_usd.errors import Issue, Severity
from envgen_usd.models.road_surface import Patch
from envgen_usd.opendrive.mesh.lift import Mesh

_SMALLEST = 0.1
"""Area in square metres below which a filled slit is not reported."""


def filled_areas(meshes: Iterable[Mesh]) -> Iterator[Issue]:
    """Yields an issue for each junction, and each road outside junctions, with filled holes."""
    areas: dict[str, float] = {}
    for mesh in meshes:
        corners = mesh.vertices[mesh.triangles][..., :2]
        (ux, uy), (vx, vy) = (corners[:, 1] - corners[:, 0]).T, (corners[:, 2] - corners[:, 0]).T
        size = np.bincount(mesh.triangle_patch, ux * vy - uy * vx, minlength=len(mesh.patches)) / 2
        for patch, area in zip(mesh.patches, size.tolist(), strict=True):
            if patch.kind == "filler":
                areas[_place(patch)] = areas.get(_place(patch), 0.0) + area
    for where, area in sorted(areas.items()):
        if area >= _SMALLEST:
            text = f"{area:.1f} m² between lanes belong to no lane"
            kind = "junction.filled" if where.startswith("junction") else "road.filled"
            yield Issue(kind, Severity.INFO, where, text, "paved")


def _place(patch: Patch) -> str:
    return f"junction[id={patch.junction}]" if patch.junction else f"road[id={patch.road}]"
