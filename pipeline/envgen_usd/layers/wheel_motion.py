"""Wheels of moving actors: they turn about their axles, steer, and follow the surface."""

import numpy as np
from pxr import Gf, Sdf, Vt

from envgen_usd.assets.prim_authoring import add_prim, set_attribute
from envgen_usd.layers.time_samples import EXACT_PLACE, add_samples, frame_codes, needed_rows
from envgen_usd.models.actor_looks import MovingLook
from envgen_usd.models.actors import Motion
from envgen_usd.models.array_types import BoolArray, FloatArray

_LEAST_LIFT = 0.002
"""Metres by which a wheel has to leave its place for samples of its height."""
_LEAST_STEERING = 0.5
"""Degrees that a wheel has to be turned at least once for samples of its steering."""
_MOST_STEERING = 35.0
"""Largest steering angle, degrees; in narrower bends the wheels slip."""
_BEND = 1.5
"""Metres before and after a place along which its bend is measured; more is smoother and later."""
_EXACT_WHEEL = 0.01
"""Degrees that a wheel may miss between its samples; 0.06 mm at its rim."""
_STRAIGHT = ("train", "bicycle", "motorcycle")
"""Kinds whose wheels stay in line: bogies hide those of trams, and forks are part of the frame."""
_TYPES = Sdf.ValueTypeNames


def move_wheels(prim: Sdf.PrimSpec, motion: Motion, look: MovingLook) -> None:
    """Authors the motion of the wheels below an actor; without wheels nothing.

    Args:
        prim: The actor.
        motion: Where it is.
        look: Its asset.
    """
    if not look.spinning or not look.radius:
        return
    turns = np.degrees(motion.travelled / (look.radius * look.scale))
    angles, steered = steering(motion, look)
    overs: dict[str, Sdf.PrimSpec] = {}
    for path, wheel in sorted(look.spinning.items()):
        over = prim
        for name in path.split("/"):
            key = f"{over.path}/{name}"
            if key not in overs:
                overs[key] = add_prim(over, name, specifier=Sdf.SpecifierOver)
            over = overs[key]
        order = ["xformOp:translate:axle", "xformOp:rotateY", "!invert!xformOp:translate:axle"]
        if steered[wheel] and np.abs(angles).max() > _LEAST_STEERING:
            _sample(over, motion, "xformOp:rotateZ", angles)
            order.insert(1, "xformOp:rotateZ")
        lifts = motion.lifts[:, wheel] / look.scale
        if np.abs(lifts).max() > _LEAST_LIFT:
            _sample(over, motion, "xformOp:translate", lifts)
            order.insert(0, "xformOp:translate")
        centre = Gf.Vec3d(*look.wheels[wheel].tolist())
        set_attribute(over, "xformOp:translate:axle", _TYPES.Double3, centre)
        _sample(over, motion, "xformOp:rotateY", turns)
        set_attribute(over, "xformOpOrder", _TYPES.TokenArray, Vt.TokenArray(order), uniform=True)


def steering(motion: Motion, look: MovingLook) -> tuple[FloatArray, BoolArray]:
    """Steering of the wheels of the foremost axle.

    The bicycle model: the middle of the other axles follows its path along the heading, so the
    tangent of the angle is the distance of the axles times the curvature of that path (Rajamani,
    Vehicle Dynamics and Control, 2.2).

    Args:
        motion: Where the actor is.
        look: Its asset.

    Returns:
        Angles to the left, N, degrees; and which wheels have them, W.
    """
    places = look.wheels[:, 0] * look.scale
    steered: BoolArray = places > places.max() - look.radius * look.scale
    if steered.all() or look.kind in _STRAIGHT:
        return np.zeros(len(motion.frames)), np.zeros(len(places), dtype=bool)
    base = places[steered].mean() - places[~steered].mean()
    headings = motion.turns[:, 2]
    ahead = np.stack([np.cos(headings), np.sin(headings)], axis=1)
    axle = motion.places[:, :2] + ahead * (places[~steered].mean() - look.middle[0])
    breaks = np.flatnonzero(np.diff(motion.frames) > 1) + 1
    bends = [
        _curvature(*each)
        for each in zip(
            np.split(axle, breaks), np.split(ahead, breaks), np.split(headings, breaks), strict=True
        )
    ]
    angles = np.degrees(np.arctan(base * np.concatenate(bends)))
    return np.clip(angles, -_MOST_STEERING, _MOST_STEERING), steered


def _curvature(points: FloatArray, ahead: FloatArray, headings: FloatArray) -> FloatArray:
    """Change of heading by metre, N; positive to the left, also on the way back."""
    middle = (ahead[1:] + ahead[:-1]) / 2
    steps = (np.diff(points, axis=0) * middle).sum(axis=1)
    driven = np.concatenate([[0.0], np.cumsum(steps)])
    passed = np.concatenate([[0.0], np.cumsum(np.abs(steps))])

    def change(values: FloatArray) -> FloatArray:
        before, after = (np.interp(passed + by, passed, values) for by in (-_BEND, _BEND))
        return after - before

    way = change(driven)
    turned: FloatArray = np.where(np.abs(way) > _BEND / 10, change(headings), 0.0)
    return turned / np.where(turned == 0.0, 1.0, way)


def _sample(prim: Sdf.PrimSpec, motion: Motion, name: str, values: FloatArray) -> None:
    """Adds samples (N) of a rotation, or of a translation upwards."""
    turns = name.startswith("xformOp:rotate")
    rows = needed_rows(values[:, None], motion.frames, _EXACT_WHEEL if turns else EXACT_PLACE)
    frames, kept = frame_codes(motion.frames[rows]), values[rows].tolist()
    if turns:
        add_samples(prim, name, _TYPES.Float, frames, kept)
    else:
        lifted = [Gf.Vec3d(0.0, 0.0, value) for value in kept]
        add_samples(prim, name, _TYPES.Double3, frames, lifted)
