"""Panes of cars show a dim cabin: each pane shows its cell of the texture `car_cabin`."""

from dataclasses import replace

import numpy as np

from envgen_usd.assets.polygon_mesh import Mesh, face_normals, merge, mesh_pieces, normalised
from envgen_usd.assets.textures.cabin_texture import CELLS, Cell
from envgen_usd.models.array_types import FloatArray

_SIDEWAYS = 0.7
"""Share of a pane's normal along the width from which it is a side window."""


def cabin_panes(panes: Mesh) -> Mesh:
    """The panes of a car with texture coordinates in the cells of the cabin.

    The front is +x. The picture of a side window has the front of the car at its right border, so
    that it is mirrored on the right side of the car.

    Args:
        panes: All panes, of which no two share a vertex.
    """
    pieces = mesh_pieces(panes)
    facing = np.array(
        [
            normalised(face_normals(each.points, each.face_sizes, each.face_vertices).sum(axis=0))
            for each in pieces
        ]
    )
    is_side = np.abs(facing[:, 1]) > _SIDEWAYS
    ahead = np.array([each.points[:, 0].mean() for each in pieces])
    first = ahead[is_side].max(initial=-np.inf)
    shown = []
    for piece, normal, side, x in zip(pieces, facing, is_side, ahead, strict=True):
        if side:
            cell: Cell = "front_window" if first - x < 0.1 else "rear_window"
        else:
            cell = "windscreen" if normal[0] > 0.0 else "back_window"
        shown.append(_in_cell(piece, cell, across=0 if side else 1))
    return merge(shown)


def _in_cell(pane: Mesh, cell: Cell, across: int) -> Mesh:
    """The pane with its extent along an axis and its height mapped to a cell."""
    plane: FloatArray = pane.points[:, [across, 2]]
    low, high = plane.min(axis=0), plane.max(axis=0)
    share = (plane - low) / (high - low)
    corner, size = np.array(CELLS[cell]), 0.5
    return replace(pane, uv=(corner + size * share)[pane.face_vertices], corner_uv=True)
