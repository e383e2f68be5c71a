"""Far meshes of shipped assets, piece by piece: turned bodies keep their outline with few sides.

`far_mesh` merges the vertices of cells and serves any mesh. What is turned on a lathe or put
together from boxes looks better if each piece becomes a simpler piece of its kind.
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import ConvexHull

from envgen_usd.assets.asset_design import AssetDesign, Model
from envgen_usd.assets.far_mesh import FAR_TRIANGLES, HANGING, far_meshes
from envgen_usd.assets.polygon_mesh import Mesh, merge, mesh_pieces, set_apart
from envgen_usd.assets.shapes.simple_solids import box, flat, lathe, moved
from envgen_usd.models.array_types import FloatArray, IntArray

_SIDES = 6
"""Corners of the cross-section of turned bodies; more show them rounder and draw slower."""
_WIDER = 1.0472
"""Widening that gives a hexagon the mean outline of its circle (pi / 3)."""
_ROUND = 2e-3
"""Largest difference of radii at a height of a turned body, metres."""
_PROFILE = 10
"""Most points of the outline of a turned body; more follow it closer and draw slower."""
_COARSE = 0.04
"""Largest distance from the outline of a turned body, as a share of its radius."""
_SMALL = 0.05
"""Size of a piece, as a share of the asset's, below which the distance does not show it."""
_THIN = 0.085
"""Thickness of a board, metres, up to which its far mesh is a sheet."""
_BENT = 64
"""Triangles up to which a coarse piece that meets itself is divided, e.g. of a bent bar."""
_INSIDE = 0.02
"""Share of the way to the middle of its triangles that a divided vertex moves."""
_PLAIN = 12
"""Triangles of a box: pieces with no more are kept, as boxes with flat sides."""


def with_far_pieces(design: AssetDesign) -> AssetDesign:
    """The asset with a far mesh for each part of its large models that have none.

    Materials of variants cover the far meshes, too.
    """
    models = {name: _far(design.kind, model) for name, model in design.models.items()}
    added = {
        part.proxy_of: part.name
        for name, model in models.items()
        for part in model.parts
        if part.proxy_of and part not in design.models[name].parts
    }
    if not added:
        return design
    looks = {
        of: {variant: _covering(look, added) for variant, look in variants.items()}
        for of, variants in design.looks.items()
    }
    return replace(design, models=models, looks=looks)


def _covering(look: Mapping[str, str], added: Mapping[str, str]) -> dict[str, str]:
    far = {added[part]: material for part, material in look.items() if part in added}
    return {**look, **far}


def _far(kind: str, model: Model) -> Model:
    """The model with far parts for what has none, if that has many triangles."""
    served = {
        name
        for part in model.parts
        for name in (part.proxy_of, part.proxy_of and part.name, *part.stands_for)
    }
    alone = [part for part in model.parts if part.name not in served]
    if sum(int((part.mesh.face_sizes - 2).sum()) for part in alone) <= 2 * FAR_TRIANGLES:
        return model
    low, high = model.extent()
    least = 0.0 if kind in HANGING else _SMALL * float(np.linalg.norm(high - low))
    far = []
    for part in alone:
        pieces = list(_simpler(part.mesh, kind, least))
        if pieces:
            name = f"{part.name}Proxy"
            mesh = set_apart(merge(pieces))
            far.append(replace(part, name=name, mesh=mesh, double_sided=True, proxy_of=part.name))
    return replace(model, parts=(*model.parts, *far))


def _simpler(mesh: Mesh, kind: str, least: float) -> Iterator[Mesh]:
    """Simpler pieces of a mesh without those whose size is below the least, metres."""
    for piece in mesh_pieces(mesh):
        if kind in HANGING:
            yield _front(piece)
            continue
        count = int((piece.face_sizes - 2).sum())
        if float(np.linalg.norm(np.ptp(piece.extent(), axis=0))) < least:
            continue
        profile = _profile(piece.points)
        if profile is not None:
            middle = piece.extent().mean(axis=0)
            yield moved(lathe(profile, _SIDES), (float(middle[0]), float(middle[1]), 0.0))
        elif count <= _PLAIN:
            yield _sheets(piece.extent()) if _is_box(piece) else piece
        else:
            coarse = far_meshes([piece], max(count // 4, 8))[0]
            coarse = coarse and _unfolded(coarse)
            if coarse is not None and (fans := _fans(coarse)).max() > 0:
                coarse = _hull(coarse) if count > _BENT else _divided(coarse, fans)
            yield piece if coarse is None else coarse


def _fans(piece: Mesh) -> IntArray:
    """Number of the fan of each corner among those of its vertex; 0 for the first.

    A fan is a run of triangles around a vertex, each joined to the next by an edge. A vertex of
    several is not manifold. Each edge has two triangles at most.
    """
    corners = piece.face_vertices.reshape(-1, 3)
    edges = np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]])
    # Half-edge k of a triangle leaves its corner k; beside it runs the half-edge of a neighbour.
    row = np.arange(corners.size).reshape(-1, 3)
    starts, ends = row.T.reshape(-1), np.roll(row, -1, axis=1).T.reshape(-1)
    count = int(corners.max()) + 1
    keys, back = edges @ [count, 1], edges @ [1, count]
    order = np.argsort(keys)
    beside = order[np.minimum(np.searchsorted(keys[order], back), len(keys) - 1)]
    met = keys[beside] == back
    pairs = starts[met], ends[beside[met]]
    graph = coo_array((np.ones(int(met.sum())), pairs), shape=(corners.size,) * 2)
    _, fan = connected_components(graph, directed=False)
    found = np.unique(np.column_stack([piece.face_vertices, fan]), axis=0)
    first = np.searchsorted(found[:, 0], found[:, 0])
    number = np.empty(int(fan.max()) + 1, np.int64)
    number[found[:, 1]] = np.arange(len(found)) - first
    return number[fan]


def _divided(piece: Mesh, fans: IntArray) -> Mesh:
    """The piece with a vertex for each fan; further ones lie a little inside of their fan."""
    vertices = piece.face_vertices.copy()
    points = [piece.points]
    for vertex, fan in np.unique(np.column_stack([vertices, fans])[fans > 0], axis=0).tolist():
        corners = np.flatnonzero((piece.face_vertices == vertex) & (fans == fan))
        around = piece.points[piece.face_vertices.reshape(-1, 3)[corners // 3]].mean(axis=(0, 1))
        vertices[corners] = sum(map(len, points))
        points.append(piece.points[[vertex]] + _INSIDE * (around - piece.points[[vertex]]))
    return replace(piece, points=np.concatenate(points), face_vertices=vertices)


def _unfolded(piece: Mesh) -> Mesh:
    """The triangles of a piece without those that meet an edge which others have used up."""
    used: set[tuple[int, int]] = set()
    kept = []
    for row, (a, b, c) in enumerate(piece.face_vertices.reshape(-1, 3).tolist()):
        edges = {(a, b), (b, c), (c, a)}
        if not used & edges:
            used |= edges
            kept.append(row)
    rows = (np.array(kept)[:, None] * 3 + np.arange(3)).reshape(-1)
    points, index = np.unique(piece.face_vertices[rows], return_inverse=True)
    return Mesh(
        piece.points[points],
        np.full(len(kept), 3),
        index.reshape(-1),
        piece.normals[rows],
        piece.uv[rows],
    )


def _hull(piece: Mesh) -> Mesh:
    """The convex hull of a piece; a flat piece stays."""
    if np.ptp(piece.points, axis=0).min() < 1e-4:
        return piece
    hull = ConvexHull(piece.points)
    corners = hull.simplices.astype(np.int64)
    first, second, third = (piece.points[corners[:, k]] for k in range(3))
    inwards = (np.cross(second - first, third - first) * hull.equations[:, :3]).sum(axis=1) < 0.0
    corners[inwards] = corners[inwards, ::-1]
    used, index = np.unique(corners.reshape(-1), return_inverse=True)
    return flat(piece.points[used], np.full(len(corners), 3), index.reshape(-1))


def _front(piece: Mesh) -> Mesh:
    """The faces of an opening's piece that look out of the wall, along y; slopes are left out."""
    starts = np.concatenate([[0], np.cumsum(piece.face_sizes)[:-1]])
    chosen = piece.normals[starts, 1] > 0.9
    corners = np.repeat(chosen, piece.face_sizes)
    used, index = np.unique(piece.face_vertices[corners], return_inverse=True)
    return Mesh(
        piece.points[used],
        piece.face_sizes[chosen],
        index.reshape(-1),
        piece.normals[corners],
        piece.uv[corners],
    )


def _sheets(extent: FloatArray) -> Mesh:
    """A thin box (2 x 3) as a sheet across each thin side, and any other box as it is."""
    size, middle = extent[1] - extent[0], extent.mean(axis=0)
    sheets = []
    for thin in np.flatnonzero(size < _THIN).tolist()[:2]:
        first, second = (axis for axis in range(3) if axis != thin)
        ring = np.tile(middle, (4, 1))
        ring[:, first] = extent[[0, 1, 1, 0], first]
        ring[:, second] = extent[[0, 0, 1, 1], second]
        sheets.append(flat(ring, np.array([4]), np.arange(4)))
    return merge(sheets) if sheets else box(*extent)


def _is_box(piece: Mesh) -> bool:
    """True if all corners are corners of the bounding box."""
    box_ = piece.extent()
    return bool(np.isclose(piece.points[:, None], box_[None], atol=1e-6).any(axis=1).all())


def _profile(points: FloatArray) -> FloatArray | None:
    """Outline (radius, z) of a body turned about an upright axis; `None` for other bodies."""
    middle = (points.min(axis=0) + points.max(axis=0))[:2] / 2
    radius = np.hypot(*(points[:, :2] - middle).T)
    levels, level = np.unique(np.round(points[:, 2], 3), return_inverse=True)
    level = level.reshape(-1)
    widest = np.full(len(levels), -np.inf)
    np.maximum.at(widest, level, radius)
    narrowest = np.full(len(levels), np.inf)
    np.minimum.at(narrowest, level, radius)
    counts = np.bincount(level)
    ring = (widest - narrowest < _ROUND) & ((counts >= 7) | (widest < _ROUND))
    if len(levels) < 2 or not (ring | (counts >= 14)).all():
        return None
    # A step has two rings at a height; the outer one is the outline.
    profile = np.column_stack([_WIDER * widest, levels])
    kept = _chosen(profile)
    return profile[kept]


def _chosen(profile: FloatArray) -> list[int]:
    """Rows of the outline that describe it best: each next one lies farthest from the chords."""
    rows = [0, len(profile) - 1]
    while len(rows) < min(_PROFILE, len(profile)):
        rows.sort()
        radius = np.interp(profile[:, 1], profile[rows, 1], profile[rows, 0])
        away = np.abs(profile[:, 0] - radius)
        away[rows] = -1.0
        if away.max() < _ROUND + _COARSE * profile[:, 0].max():
            break
        rows.append(int(away.argmax()))
    return sorted(rows)
