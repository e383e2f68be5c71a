"""Where the moving bodies of a stage are at a time, asked of OpenUSD and put together at once."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from pxr import Usd, UsdGeom, Vt

from envgen_usd.models.array_types import BoolArray, FloatArray, IntArray
from envgen_usd.render.render_scene import Moment
from envgen_usd.render.stage.moving_content import MovingBody
from envgen_usd.render.stage.stage_traversal import world_matrix

_FLAT = 1e-15
"""Least volume of a body's axes; a body of less is hidden."""


class BodyWays:
    """Ways of bodies. What has no time samples is asked once."""

    def __init__(self, stage: Usd.Stage, bodies: Sequence[MovingBody], start: Usd.TimeCode) -> None:
        """Prepares to ask the stage for places.

        Args:
            stage: The stage, with the payloads of the bodies.
            bodies: What moves; those that carry others come first.
            start: A time of the stage.
        """
        self._xforms = UsdGeom.XformCache(start)
        prims = [stage.GetPrimAtPath(body.path) for body in bodies]
        found = [self._xforms.GetLocalTransformation(prim) for prim in prims]
        self._locals = _columns([local for local, _ in found])
        self._resets = np.array([resets for _, resets in found], bool)
        self._places = np.array([body.place for body in bodies]).reshape(-1, 4, 4)
        self._places[self._resets] = world_matrix(stage)
        self._carriers = np.array([body.above for body in bodies], np.int64)
        self._generations = [*_generations(self._carriers)]
        varying = [UsdGeom.Xformable(prim).TransformMightBeTimeVarying() for prim in prims]
        self._varying = np.flatnonzero(varying)
        self._moved = [prims[number] for number in self._varying.tolist()]
        self._timed = np.flatnonzero([body.is_timed for body in bodies])
        self._visibilities = [
            Usd.AttributeQuery(UsdGeom.Imageable(prims[number]).GetVisibilityAttr())
            for number in self._timed.tolist()
        ]

    def at(self, seconds: float, code: Usd.TimeCode) -> Moment:
        """Where the bodies are.

        Args:
            seconds: The time, as the moment records it.
            code: The same time of the stage.
        """
        self._xforms.SetTime(code)
        local = self._locals.copy()
        if self._moved:
            local[self._varying] = _columns(
                [self._xforms.GetLocalTransformation(prim)[0] for prim in self._moved]
            )
        matrices: FloatArray = self._places @ local
        shown = np.ones(len(matrices), bool)
        invisible = UsdGeom.Tokens.invisible
        shown[self._timed] = [each.Get(code) != invisible for each in self._visibilities]
        _hide_endless(matrices, shown)
        for bodies in self._generations:
            carriers = self._carriers[bodies]
            carried, by = bodies[~self._resets[bodies]], carriers[~self._resets[bodies]]
            matrices[carried] = matrices[by] @ matrices[carried]
            shown[bodies] &= shown[carriers]
        _hide_endless(matrices, shown)
        solid = np.abs(np.linalg.det(matrices[:, :3, :3])) > _FLAT
        return Moment(seconds, matrices, shown & solid)


def _generations(carriers: IntArray) -> Iterator[IntArray]:
    """Numbers of the bodies that others carry: first those whose carriers nothing carries."""
    depths = np.zeros(len(carriers), np.int64)
    for number, carrier in enumerate(carriers.tolist()):
        if carrier >= 0:
            depths[number] = depths[carrier] + 1
    for depth in range(1, int(depths.max(initial=0)) + 1):
        yield np.flatnonzero(depths == depth)


def _hide_endless(matrices: FloatArray, shown: BoolArray) -> None:
    """Hides bodies without a finite place."""
    endless = ~np.isfinite(matrices).all(axis=(1, 2))
    matrices[endless], shown[endless] = np.eye(4), False


def _columns(matrices: Sequence[Any]) -> FloatArray:
    """Gf.Matrix4d, which are for row vectors, as N x 4 x 4 for column vectors."""
    rows = np.array(Vt.Matrix4dArray(matrices), np.float64).reshape(-1, 4, 4)
    return np.ascontiguousarray(rows.swapaxes(1, 2))
