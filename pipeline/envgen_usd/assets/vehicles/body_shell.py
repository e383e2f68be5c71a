"""Half a body's skin as triangles with parameters, cut along outlines in those parameters.

A body is drawn for y >= 0 and mirrored. Its skin is a grid of quads; each corner knows two
parameters in metres, e.g. the way along the body and the height. Windows, doors and lamps are
polygons of the parameters: cutting gives exact outlines on curved skin, whatever the grid.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
import shapely
from scipy.spatial import cKDTree

from envgen_usd.assets.polygon_mesh import Mesh, face_normals, normalised, weld
from envgen_usd.models.array_types import BoolArray, FloatArray, IntArray

_GRID = 1e-5
"""Distance of points that are one point, metres; a larger value closes wider cracks."""
_FLAT = 1e-14
"""Area in square metres of triangles that are left out; a larger value drops more slivers."""
_POLYGON, _POLYGONS = 3, 6
"""Type ids of areas in shapely."""
_PASSES = 12
"""Rounds in which triangles are divided at corners on their edges."""
_SAME, _NEAR = 1e-7, 1e-6
"""Distances of corners that are one, and of a corner from the edge on which it lies, metres."""
_SEAM = 1e-7
"""Distance from the plane of symmetry of points that lie in it, metres."""


@dataclass(frozen=True)
class Skin:
    """Triangles of half a body.

    Attributes:
        places: T x 3 x 3, corners in metres, counter-clockwise seen from outside.
        normals: T x 3 x 3, unit vectors.
        params: T x 3 x 2, parameters of the corners.
        cells: T, the same number for both triangles of a quad that is cut as a whole.
    """

    places: FloatArray
    normals: FloatArray
    params: FloatArray
    cells: IntArray

    def __len__(self) -> int:
        """Number of triangles."""
        return len(self.places)

    def chosen(self, rows: BoolArray | IntArray) -> "Skin":
        """Some of the triangles."""
        return Skin(self.places[rows], self.normals[rows], self.params[rows], self.cells[rows])


def grid_skin(places: FloatArray, params: FloatArray) -> Skin:
    """The skin of a grid of quads.

    Args:
        places: R x C x 3, metres; columns run counter-clockwise seen from above, rows upwards.
        params: R x C x 2.
    """
    rows, columns = places.shape[:2]
    row, column = np.meshgrid(np.arange(rows - 1), np.arange(columns - 1), indexing="ij")
    here = (row * columns + column).reshape(-1)
    quads = np.stack([here, here + 1, here + columns + 1, here + columns], axis=1)
    points = places.reshape(-1, 3)
    # The shorter diagonal bends less out of a curved quad.
    first = np.linalg.norm(points[quads[:, 0]] - points[quads[:, 2]], axis=1)
    second = np.linalg.norm(points[quads[:, 1]] - points[quads[:, 3]], axis=1)
    shift = np.where(first <= second, 0, 1)[:, None]
    turned = np.take_along_axis(quads, (np.arange(4)[None] + shift) % 4, axis=1)
    corners = np.concatenate([turned[:, [0, 1, 2]], turned[:, [0, 2, 3]]])
    cells = np.tile(np.arange(len(quads)), 2)
    return skin_of(points[corners], params.reshape(-1, 2)[corners], cells)


def skin_of(places: FloatArray, params: FloatArray, cells: IntArray | None = None) -> Skin:
    """Triangles with flat normals; those without area are left out."""
    cells = np.arange(len(places)) if cells is None else cells
    across = np.cross(places[:, 1] - places[:, 0], places[:, 2] - places[:, 0])
    kept = np.linalg.norm(across, axis=1) > 2 * _FLAT
    normals = np.repeat(normalised(across[kept])[:, None], 3, axis=1)
    return Skin(places[kept], normals, params[kept], cells[kept])


def joined(skins: Sequence[Skin]) -> Skin:
    """Several skins as one."""
    starts = np.cumsum([0, *(int(skin.cells.max(initial=-1)) + 1 for skin in skins)])
    return Skin(
        np.concatenate([skin.places for skin in skins]),
        np.concatenate([skin.normals for skin in skins]),
        np.concatenate([skin.params for skin in skins]),
        np.concatenate([skin.cells + at for skin, at in zip(skins, starts, strict=False)]),
    )


def smoothed(skins: Sequence[Skin], sharp: float = 60.0, *, half: bool = True) -> list[Skin]:
    """The skins with normals that are the mean of the faces around each point.

    Args:
        skins: Skins that meet; their normals agree along common points.
        sharp: Angle in degrees above which a face keeps out of a corner's mean.
        half: True if the skin goes on mirrored at y = 0.
    """
    whole = joined(skins)
    count = len(whole)
    points, corners = weld(whole.places.reshape(-1, 3), np.arange(count * 3), _GRID)
    faces = face_normals(points, np.full(count, 3), corners)
    unit = np.repeat(normalised(faces), 3, axis=0)
    order = np.argsort(corners, kind="stable")
    starts = np.searchsorted(corners[order], np.arange(len(points) + 1))
    sums = np.zeros((count * 3, 3))
    most = int(np.diff(starts).max())
    for step in range(most):
        # Each corner looks at the step-th corner around its point.
        there = starts[corners] + step
        valid = there < starts[corners + 1]
        other = order[np.minimum(there, len(order) - 1)]
        near = (unit[other] * unit).sum(axis=1) > np.cos(np.radians(sharp))
        sums += np.where((valid & near)[:, None], faces[other // 3], 0.0)
    # What the mirrored half adds at the seam cancels its sideways share.
    level = np.abs(points[corners][:, 1]) < _SEAM
    sideways = np.abs(unit[:, 1]) > np.cos(np.radians(sharp / 2))
    if half:
        sums[level & ~sideways, 1] = 0.0
    normals = normalised(sums).reshape(-1, 3, 3)
    whole = replace(whole, normals=normals)
    ends = np.cumsum([0, *map(len, skins)])
    return [whole.chosen(np.arange(a, b)) for a, b in pairwise(ends)]


def cut_skin(skin: Skin, regions: Mapping[str, shapely.Geometry]) -> dict[str, Skin]:
    """Divides a skin along the outlines of regions of its parameters.

    Args:
        skin: The skin.
        regions: Areas by name; where they overlap, the first one counts.

    Returns:
        The skin of each region, and the rest under an empty name.
    """
    order = np.argsort(skin.cells, kind="stable")
    _, first, count = np.unique(skin.cells[order], return_index=True, return_counts=True)
    one, two = order[first], order[first + count - 1]
    rings = shapely.polygons(np.concatenate([skin.params, skin.params[:, :1]], axis=1))
    rest = np.where(one == two, rings[one], shapely.union(rings[one], rings[two]))
    outlines = shapely.union_all([region.boundary for region in regions.values()])
    crossed = shapely.intersects(rest, outlines)
    whole = shapely.point_on_surface(rest)
    found = {}
    taken = crossed.copy()
    for name, region in regions.items():
        inside = ~taken & shapely.contains_xy(region, *shapely.get_coordinates(whole).T)
        taken |= inside
        kept = skin.chosen(np.isin(skin.cells, skin.cells[one[inside]]))
        areas = _areas(shapely.intersection(rest[crossed], region))
        rest[crossed] = _areas(shapely.difference(rest[crossed], region))
        found[name] = joined([kept, _pieces(skin, areas, one[crossed], two[crossed])])
    kept = skin.chosen(np.isin(skin.cells, skin.cells[one[~taken]]))
    found[""] = joined([kept, _pieces(skin, rest[crossed], one[crossed], two[crossed])])
    return stitched(found, by_params=True)


def _areas(shapes: Any) -> Any:  # noqa: ANN401 - arrays of shapely are not typed
    """The areas of shapes without the lines and points at which areas touch."""
    mixed = np.flatnonzero(~np.isin(shapely.get_type_id(shapes), [_POLYGON, _POLYGONS]))
    for row in mixed:
        parts = shapely.get_parts(shapes[row])
        shapes[row] = shapely.multipolygons(parts[shapely.get_type_id(parts) == _POLYGON])
    return shapes


def stitched(pieces: Mapping[str, Skin], *, by_params: bool = False) -> dict[str, Skin]:
    """The pieces with a corner wherever another piece has one on an edge, so that no gap opens.

    Args:
        pieces: Skins by name.
        by_params: Compare parameters instead of places: pieces of one curved skin.
    """
    counts = [len(piece) for piece in pieces.values()]
    whole = joined(list(pieces.values()))
    owner = np.repeat(np.arange(len(counts)), counts)
    for _ in range(_PASSES):
        flat = np.pad(whole.params, ((0, 0), (0, 0), (0, 1)))
        triangle, edge, corner, share = _corners_on_edges(flat if by_params else whole.places)
        if not len(triangle):
            break
        # One edge of a triangle at a time.
        edges = np.full(len(whole), 3)
        np.minimum.at(edges, triangle, edge)
        used = edge == edges[triangle]
        whole, owner = _divided(whole, owner, triangle[used], edge[used], corner[used], share[used])
    if by_params:
        whole = _agreeing(whole)
    return {name: whole.chosen(owner == number) for number, name in enumerate(pieces)}


def _agreeing(skin: Skin) -> Skin:
    """The skin with one place for each pair of parameters, whose cells round differently."""
    flat = np.pad(skin.params, ((0, 0), (0, 0), (0, 1))).reshape(-1, 3)
    _, corners = weld(flat, np.arange(len(flat)), _SAME)
    first = np.full(int(corners.max(initial=-1)) + 1, len(flat))
    np.minimum.at(first, corners, np.arange(len(flat)))
    return replace(skin, places=skin.places.reshape(-1, 3)[first[corners]].reshape(-1, 3, 3))


def _corners_on_edges(
    places: FloatArray,
) -> tuple[IntArray, IntArray, IntArray, FloatArray]:
    """Triangle and edge, corner of another triangle on it, and its share of the way.

    Args:
        places: T x 3 x 3, corners of triangles.
    """
    points, corners = weld(places.reshape(-1, 3), np.arange(3 * len(places)), _SAME)
    triangles = corners.reshape(-1, 3)
    starts, ends = triangles.reshape(-1), np.roll(triangles, -1, axis=1).reshape(-1)
    keys, back = starts * len(points) + ends, ends * len(points) + starts
    alone = np.flatnonzero(~np.isin(keys, back))
    loose = np.unique(np.concatenate([starts[alone], ends[alone]]))
    a, b, p = points[starts[alone]], points[ends[alone]], points[loose]
    way, there = b - a, p[None] - a[:, None]
    length = np.maximum(np.linalg.norm(way, axis=1), 1e-12)[:, None]
    share = (there * way[:, None]).sum(axis=2) / length**2
    off = np.linalg.norm(there - share[..., None] * way[:, None], axis=2)
    on = (off < _NEAR) & (share * length > _NEAR) & ((1 - share) * length > _NEAR)
    row, column = np.nonzero(on)
    corner = np.argsort(corners, kind="stable")[np.searchsorted(np.sort(corners), loose[column])]
    edges = alone[row]
    return edges // 3, edges % 3, corner, share[row, column]


def _divided(  # noqa: PLR0913, PLR0917 - columns of a table
    skin: Skin, owner: IntArray, triangle: IntArray, edge: IntArray, corner: IntArray,
    share: FloatArray,
) -> tuple[Skin, IntArray]:  # fmt: skip
    """Triangles divided at corners on one of their edges, and the owner of each triangle."""
    order = np.lexsort((share, triangle))
    triangle, edge, corner, share = triangle[order], edge[order], corner[order], share[order]
    first, second, third = (skin_corners(skin, triangle, (edge + k) % 3) for k in range(3))
    weight = share[:, None]
    normals = normalised(first[1] * (1 - weight) + second[1] * weight)
    there = (
        skin.places.reshape(-1, 3)[corner],
        normals,
        skin.params.reshape(-1, 2)[corner],
    )
    starts = np.concatenate([[True], triangle[1:] != triangle[:-1]])
    last = np.concatenate([triangle[1:] != triangle[:-1], [True]])
    pieces = []
    for values, a, b, c in zip(there, first, second, third, strict=True):
        before = np.where(starts[:, None], a, np.roll(values, 1, axis=0))
        fan = np.stack([before, values, c], axis=1)
        pieces.append(np.concatenate([fan, np.stack([values, b, c], axis=1)[last]]))
    kept = np.ones(len(skin), bool)
    kept[triangle] = False
    new = Skin(pieces[0], pieces[1], pieces[2], np.arange(len(pieces[0])))
    owners = np.concatenate([owner[kept], owner[triangle], owner[triangle[last]]])
    return joined([skin.chosen(kept), new]), owners


def skin_corners(
    skin: Skin, triangle: IntArray, number: IntArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Place, normal and parameters of a corner of each triangle."""
    return (
        skin.places[triangle, number],
        skin.normals[triangle, number],
        skin.params[triangle, number],
    )


def _pieces(skin: Skin, areas: FloatArray, one: IntArray, two: IntArray) -> Skin:
    """Areas of cells as triangles; `one` and `two` are the triangles of each cell."""
    parts, owner = shapely.get_parts(
        shapely.constrained_delaunay_triangles(areas), return_index=True
    )
    if not len(parts):
        return skin.chosen(np.zeros(len(skin), bool))
    rings = shapely.get_coordinates(shapely.orient_polygons(parts)).reshape(-1, 4, 2)[:, :3]
    sides = [_weights(skin.params[which[owner]], rings) for which in (one, two)]
    # A corner lies in that triangle of its cell of which it is farther inside.
    second = sides[1].min(axis=-1) > sides[0].min(axis=-1)
    weights = np.where(second[..., None], sides[1], sides[0])
    triangle = np.where(second, two[owner][:, None], one[owner][:, None])
    places = np.einsum("tkw,tkwd->tkd", weights, skin.places[triangle])
    normals = normalised(np.einsum("tkw,tkwd->tkd", weights, skin.normals[triangle]))
    mirrored_params = _cross(*_sides(skin.params[one[owner]])) < 0.0
    places[mirrored_params] = places[mirrored_params, ::-1]
    normals[mirrored_params] = normals[mirrored_params, ::-1]
    rings[mirrored_params] = rings[mirrored_params, ::-1]
    across = np.cross(places[:, 1] - places[:, 0], places[:, 2] - places[:, 0])
    kept = np.linalg.norm(across, axis=1) > 2 * _FLAT
    return Skin(places, normals, rings, np.arange(len(places))).chosen(kept)


def _sides(params: FloatArray) -> tuple[FloatArray, FloatArray]:
    return params[:, 1] - params[:, 0], params[:, 2] - params[:, 0]


def _weights(params: FloatArray, rings: FloatArray) -> FloatArray:
    """Barycentric coordinates T x 3 x 3 of corners (T x 3 x 2) in triangles (T x 3 x 2)."""
    a, b, c = (params[:, k][:, None] for k in range(3))
    area = _cross(b - a, c - a)
    parts = [
        _cross(b - rings, c - rings),
        _cross(c - rings, a - rings),
        _cross(a - rings, b - rings),
    ]
    return np.stack(parts, axis=-1) / area[..., None]


def _cross(first: FloatArray, second: FloatArray) -> FloatArray:
    crossed: FloatArray = first[..., 0] * second[..., 1] - first[..., 1] * second[..., 0]
    return crossed


def open_edges(skin: Skin) -> tuple[FloatArray, FloatArray]:
    """Edges with one triangle, in its direction: starts and ends (E x 3 each)."""
    points, triangles = _welded(skin)
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    edges = edges[edges[:, 0] != edges[:, 1]]
    keys, back = edges @ [len(points), 1], edges @ [1, len(points)]
    alone = edges[~np.isin(keys, back)]
    return points[alone[:, 0]], points[alone[:, 1]]


def _welded(skin: Skin) -> tuple[FloatArray, IntArray]:
    """Points of a skin, and its triangles as their numbers: T x 3."""
    points, corners = weld(skin.places.reshape(-1, 3), np.arange(len(skin) * 3), _GRID)
    # A border between cells may lie between two points of the same place.
    pairs = cKDTree(points).query_pairs(_GRID / 2, output_type="ndarray")  # the lower one first
    first = np.arange(len(points))
    np.minimum.at(first, pairs[:, 1], pairs[:, 0])
    return points, first[corners].reshape(-1, 3)


def mirrored(skin: Skin, size: float = 1.0) -> Mesh:
    """Both halves of a body as a mesh; its texture coordinates are the parameters / size."""
    other = Skin(
        skin.places[:, ::-1] * [1.0, -1.0, 1.0],
        skin.normals[:, ::-1] * [1.0, -1.0, 1.0],
        skin.params[:, ::-1] * [-1.0, 1.0],
        skin.cells,
    )
    return skin_mesh(joined([skin, other]), size)


def skin_mesh(skin: Skin, size: float = 1.0) -> Mesh:
    """A skin as a mesh with welded points."""
    points, triangles = _welded(skin)
    following = np.roll(triangles, -1, axis=1)
    kept = (triangles != following).all(axis=1)
    used, index = np.unique(triangles[kept], return_inverse=True)
    return Mesh(
        points[used],
        np.full(int(kept.sum()), 3),
        index.reshape(-1),
        skin.normals[kept].reshape(-1, 3),
        skin.params[kept].reshape(-1, 2) / size,
    )
