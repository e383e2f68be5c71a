"""Checks on built stages that ground and road together have no hole.

Run ``python benchmarks/watertight.py FOLDER [FOLDER ...]`` with folders that ``envgen-usd build``
wrote; exit code 1 if any leaks. Only the stage is read: the faces of the ground and of the road of
all chunks, their points in the frame of the map at a millimetre. Every edge has to be shared by
exactly two faces, but for the rim of the land. Where bodies of bridges and tunnels, which are
closed on their own, stand on the rest, an edge may have four.
"""

import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
from pxr import Usd, UsdGeom

CHUNK_SIZE = 200_000
"""Millimetres."""
_BODIES = {"bridge", "tunnel"}
IntArray = npt.NDArray[np.int64]


@dataclass(frozen=True)
class Leaks:
    """What the edges of a stage say.

    Attributes:
        sides: Number of sides of faces.
        edges: Number of edges.
        open: Edges (E x 2 x 3, millimetres) inside the land with an odd number of faces.
        crowded: Edges with more than two faces where no bridge or tunnel is.
    """

    sides: int
    edges: int
    open: IntArray
    crowded: IntArray

    def __bool__(self) -> bool:
        """True if there are any."""
        return len(self.open) + len(self.crowded) > 0


def find_leaks(folder: Path) -> Leaks:
    """Looks at all edges of the ground and the road of an environment."""
    stage = Usd.Stage.Open(str(folder / "stage.usda"))
    meshes = list(_meshes(stage))
    points = np.concatenate([mesh.points for mesh in meshes])
    _, first, number = np.unique(_codes(points), return_index=True, return_inverse=True)
    keys = points[first]
    starts = np.cumsum([0, *(len(mesh.points) for mesh in meshes)])
    sides = [mesh.edges + start for mesh, start in zip(meshes, starts, strict=False)]
    edges = np.sort(number[np.concatenate(sides)], axis=1)
    codes, count = np.unique(edges[:, 0] * len(keys) + edges[:, 1], return_counts=True)
    unique = np.column_stack(np.divmod(codes, len(keys)))
    odd, crowded = keys[unique[count % 2 == 1]], keys[unique[count > 2]]
    bodies = {place for mesh in meshes if mesh.body for place in map(tuple, mesh.points[:, :2])}
    return Leaks(
        len(edges),
        len(unique),
        odd[~_on_rim(odd, {mesh.chunk for mesh in meshes})],
        crowded[~_at(bodies, crowded)],
    )


def _codes(points: IntArray) -> IntArray:
    """One number for each point (N x 3) that only equal points share."""
    apart = points - points.min(axis=0)
    size = apart.max(axis=0) + 1
    codes: IntArray = (apart[:, 0] * size[1] + apart[:, 1]) * size[2] + apart[:, 2]
    return codes


def _at(places: set[tuple[int, int]], edges: IntArray) -> npt.NDArray[np.bool_]:
    """Edges (E x 2 x 3) with both ends, seen from above, at some of the places."""
    found = [all(tuple(end[:2]) in places for end in edge) for edge in edges]
    return np.array(found, dtype=bool)


@dataclass(frozen=True)
class _Mesh:
    chunk: tuple[int, int]
    points: IntArray
    edges: IntArray
    body: bool


def _meshes(stage: Usd.Stage) -> Iterator[_Mesh]:
    cache = UsdGeom.XformCache()
    for prim in stage.Traverse():
        if prim.GetTypeName() != "Mesh":
            continue
        path = str(prim.GetPath())
        body = prim.GetParent().GetAttribute("userProperties:category").Get() in _BODIES
        if not (body or "/Terrain/" in path or "/Roads/" in path):
            continue
        mesh = UsdGeom.Mesh(prim)
        place = np.array(cache.GetLocalToWorldTransform(prim))
        local = np.array(mesh.GetPointsAttr().Get(), dtype=np.float64)
        points = np.round((local @ place[:3, :3] + place[3, :3]) * 1000).astype(np.int64)
        sizes = np.array(mesh.GetFaceVertexCountsAttr().Get())
        corners = np.array(mesh.GetFaceVertexIndicesAttr().Get(), dtype=np.int64)
        following = np.roll(corners, -1)
        ends = np.cumsum(sizes)
        following[ends - 1] = corners[ends - sizes]
        column, row = np.round(place[3, :2] / 200).astype(int).tolist()
        yield _Mesh((column, row), points, np.column_stack([corners, following]), body)


def _on_rim(edges: IntArray, chunks: set[tuple[int, int]]) -> npt.NDArray[np.bool_]:
    """Edges on a border of a chunk beyond which there is none."""
    rim = np.zeros(len(edges), dtype=bool)
    for axis in (0, 1):
        flat = (edges[:, 0, axis] == edges[:, 1, axis]) & (edges[:, 0, axis] % CHUNK_SIZE == 0)
        for index in np.flatnonzero(flat):
            middle = edges[index, :, :2].sum(axis=0)
            column, row = middle // (2 * CHUNK_SIZE)
            beside = (column - (axis == 0), row - (axis == 1))
            rim[index] |= not {(int(column), int(row)), tuple(map(int, beside))} <= chunks
    return rim


def main(folders: list[Path]) -> int:
    """Prints what was found of each folder."""
    worst = 0
    for folder in folders:
        leaks = find_leaks(folder)
        worst |= bool(leaks)
        print(
            f"{folder.name}: {leaks.edges} edges, {len(leaks.open)} open, "
            f"{len(leaks.crowded)} with more than two faces"
        )
        for edge in np.concatenate([leaks.open, leaks.crowded])[:10]:
            print("   ", " - ".join(str(tuple((end / 1000).tolist())) for end in edge))
    return worst


if __name__ == "__main__":
    sys.exit(main([Path(name) for name in sys.argv[1:]]))
