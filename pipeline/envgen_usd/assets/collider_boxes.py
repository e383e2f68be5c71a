"""The box that stands for an asset in collisions."""

import numpy as np

from envgen_usd.assets.asset_design import Model
from envgen_usd.models.array_types import FloatArray

NO_COLLIDER = {
    "aerial",
    "awning",
    "bush",
    "chimney_pots",
    "cornice",
    "door",
    "downpipe",
    "gully",
    "gutter",
    "roof_window",
    "satellite_dish",
    "shop_fascia",
    "shop_sign",
    "stone_course",
    "window",
}
"""Kinds without a collider: twigs give way, and fittings belong to a wall that collides."""
_REACH = 1.5
"""Height in metres below which a post's foot counts; a larger value includes more of its arms."""
_ROOTS = 0.6
"""The same of a trunk; a larger value includes low branches."""
_SLENDER = 0.35
"""Largest width of a post as a share of its height; larger values make more assets posts."""
_TRUNK = 0.3
"""Height of a trunk's collider as a share of the tree's; larger values reach into the crown."""


def collider_box(kind: str, model: Model) -> FloatArray | None:
    """Box (2 x 3, metres) in the frame of the asset; `None` for kinds that do not collide.

    A tree collides with its trunk, a post or a crane with its foot up to its height, and any other
    asset with its bounding box. A shelter counts as full.
    """
    if kind in NO_COLLIDER:
        return None
    parts = [part for part in model.parts if not part.proxy_of]
    box = model.extent()
    height = float(box[1, 2])
    if kind == "tree":
        parts = [part for part in parts if part.material.startswith("bark")] or parts
    points = np.concatenate([part.mesh.points for part in parts])
    reach = _ROOTS if kind == "tree" else _REACH
    low = points[points[:, 2] <= min(reach, height)]
    foot = np.stack([low.min(axis=0), low.max(axis=0)]) if len(low) > 1 else box
    wide = float(np.ptp(foot[:, :2], axis=0).max())
    if kind == "tree":
        return _column(foot, _TRUNK * height)
    is_slender = wide < _SLENDER * height or kind == "crane"
    return _column(foot, height) if is_slender else box


def _column(foot: FloatArray, height: float) -> FloatArray:
    column: FloatArray = np.array([[*foot[0, :2], 0.0], [*foot[1, :2], height]])
    return column
