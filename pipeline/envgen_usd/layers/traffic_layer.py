"""Writes the layer of moving actors: ``/World/Traffic``, with time samples."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from pxr import Gf, Sdf, Vt

from envgen_usd.assets.polygon_mesh import Mesh, flat_normals
from envgen_usd.assets.prim_authoring import (
    add_mesh,
    add_prim,
    apply_schemas,
    prim_names,
    set_attribute,
    set_class,
    set_custom,
    set_display_colour,
)
from envgen_usd.assets.stage_schemas import ACTOR
from envgen_usd.assets.usd_files import new_layer, write_layer
from envgen_usd.layers.actor_choice import POSE
from envgen_usd.layers.low_beams import add_low_beam
from envgen_usd.layers.time_samples import (
    EXACT_PLACE,
    EXACT_TURN,
    add_samples,
    frame_codes,
    needed_rows,
    set_times,
)
from envgen_usd.layers.wheel_motion import move_wheels
from envgen_usd.models.actor_looks import MovingLook
from envgen_usd.models.actors import Motion
from envgen_usd.models.array_types import BoolArray, FloatArray, IntArray

NAME = "traffic"
FILE = f"{NAME}.usdc"
"""Name of the layer's file in the folder ``layers``."""
_WALKING = 0.25
"""Speed from which a person walks, m/s; slower ones stand."""
_TYPES = Sdf.ValueTypeNames


def write_traffic(  # noqa: PLR0913, PLR0917 - what a layer follows from
    motions: Sequence[Motion],
    looks: Sequence[MovingLook],
    rate: float,
    source: str,
    library: str,
    path: Path,
    facts: Mapping[str, str],
) -> tuple[int, int]:
    """Writes the layer.

    Args:
        motions: Actors on the surface.
        looks: Their assets.
        rate: Frames a second.
        source: Name of the trace.
        library: Path of the asset library, as the layer refers to it.
        path: .usdc or .usda file, written atomically.
        facts: What the layer was made for, kept in its custom data.

    Returns:
        First and last frame.

    Raises:
        EnvgenError: The file cannot be written.
    """
    layer = new_layer("World")
    first = min(motion.stays[0][0] for motion in motions)
    last = max(motion.stays[-1][1] for motion in motions)
    set_times(layer, rate, first, last)
    layer.customLayerData = dict(facts)
    world = add_prim(layer, "World", specifier=Sdf.SpecifierOver)
    root = add_prim(world, "Traffic", "Xform", kind="group")
    names = prim_names(motion.actor.id for motion in motions)
    with Sdf.ChangeBlock():
        for motion, look in zip(motions, looks, strict=True):
            prim = add_prim(root, names[motion.actor.id], "Xform", kind="component")
            _describe(prim, motion, look, source)
            _animate(prim, motion, look)
            _show(prim, motion.stays, first, last)
            if not look.asset:
                _add_box(prim, look)
            elif look.cycle:
                _add_cycle(prim, motion, look, library, rate)
            else:
                _refer(prim, look, look.selections, library)
                add_low_beam(prim, look)
                move_wheels(prim, motion, look)
    write_layer(layer, path)
    return first, last


def _describe(prim: Sdf.PrimSpec, motion: Motion, look: MovingLook, source: str) -> None:
    apply_schemas(prim, ACTOR)
    size = dict(zip(("length", "width", "height"), look.size.tolist(), strict=True))
    for name, value in size.items():
        set_attribute(prim, f"userProperties:{name}", _TYPES.Float, value, custom=True)
    facts = {
        "asset": look.asset,
        "category": look.kind,
        "gml_id": motion.actor.id,
        "segmentation_class": look.label,
        "source": source,
    }
    set_custom(prim, facts)


def _animate(prim: Sdf.PrimSpec, motion: Motion, look: MovingLook) -> None:
    """Authors translate and rotateXYZ of each frame, and the scale."""
    degrees = np.degrees(motion.turns)
    places = motion.places - np.einsum("nij,j->ni", rotations(motion.turns), look.middle)
    order = ["xformOp:translate", "xformOp:rotateXYZ"]
    kept = needed_rows(places, motion.frames, EXACT_PLACE)
    moves = [Gf.Vec3d(*row) for row in places[kept].tolist()]
    add_samples(prim, order[0], _TYPES.Double3, frame_codes(motion.frames[kept]), moves)
    kept = needed_rows(degrees, motion.frames, EXACT_TURN)
    turns = [Gf.Vec3f(*row) for row in degrees[kept].tolist()]
    add_samples(prim, order[1], _TYPES.Float3, frame_codes(motion.frames[kept]), turns)
    if look.asset and look.scale != 1.0:
        set_attribute(prim, "xformOp:scale", _TYPES.Float3, Gf.Vec3f(look.scale))
        order.append("xformOp:scale")
    set_attribute(prim, "xformOpOrder", _TYPES.TokenArray, Vt.TokenArray(order), uniform=True)


def rotations(turns: FloatArray) -> FloatArray:
    """Returns matrices (N x 3 x 3, for column vectors) of rolls, pitches and headings, N x 3."""
    (cx, cy, cz), (sx, sy, sz) = np.cos(turns).T, np.sin(turns).T
    rows = [
        [cz * cy, cz * sy * sx - sz * cx, cz * sy * cx + sz * sx],
        [sz * cy, sz * sy * sx + cz * cx, sz * sy * cx - cz * sx],
        [-sy, cy * sx, cy * cx],
    ]
    return np.moveaxis(np.array(rows), -1, 0)


def _show(prim: Sdf.PrimSpec, stays: Sequence[tuple[int, int]], first: int, last: int) -> None:
    """Authors visibility where the actor appears later, is gone for a while, or leaves."""
    samples: dict[float, str] = {}
    if stays[0][0] > first:
        samples[float(first)] = "invisible"
    for begin, end in stays:
        samples[float(begin)] = "inherited"
        if end < last:
            samples[float(end + 1)] = "invisible"
    if len(samples) > 1:
        frames = sorted(samples)
        add_samples(prim, "visibility", _TYPES.Token, frames, [samples[frame] for frame in frames])


def _refer(
    prim: Sdf.PrimSpec, look: MovingLook, selections: Mapping[str, str], library: str
) -> None:
    for name, variant in sorted(selections.items()):
        prim.variantSelections[name] = variant
    prim.referenceList.prependedItems = [Sdf.Reference(f"{library}/{look.path}")]


def cycle_phases(motion: Motion, look: MovingLook, rate: float) -> IntArray:
    """Returns the pose in each frame, N: its index in the cycle, or -1 for standing.

    Args:
        motion: Actor on the surface.
        look: Its asset, with a cycle.
        rate: Frames a second.
    """
    count = len(look.cycle)
    share = motion.travelled / (look.cycle_length * look.scale)
    phase = np.floor(share * count + 1e-6).astype(np.int64) % count
    if not look.standing:
        return phase
    step = np.diff(motion.travelled) / np.diff(motion.frames)
    speed = np.abs(step) * rate if len(step) else np.zeros(1)
    padded = np.concatenate([speed[:1], speed, speed[-1:]])
    moving = np.maximum(padded[1:], padded[:-1])[: len(phase)] > _WALKING
    return np.where(moving, phase, -1)


def _add_cycle(
    prim: Sdf.PrimSpec, motion: Motion, look: MovingLook, library: str, rate: float
) -> None:
    """Adds an instance for each pose, of which one is visible at a time."""
    phases = cycle_phases(motion, look, rate)
    poses = [*enumerate(look.cycle), *([(-1, look.standing)] if look.standing else [])]
    for index, pose in poses:
        visible = phases == index
        if not visible.any():
            continue
        child = add_prim(prim, prim_names([pose])[pose], "Xform")
        _refer(child, look, {**look.selections, POSE: pose}, library)
        if look.spinning:
            move_wheels(child, shown_part(motion, visible), look)
        else:
            child.instanceable = True
        turns = np.concatenate([[True], visible[1:] != visible[:-1]])
        tokens = np.where(visible[turns], "inherited", "invisible").tolist()
        if len(tokens) > 1:
            add_samples(
                child, "visibility", _TYPES.Token, frame_codes(motion.frames[turns]), tokens
            )


def shown_part(motion: Motion, visible: BoolArray) -> Motion:
    """The motion in the frames in which a pose is visible, and in those at which they end."""
    rows = visible.copy()
    rows[1:] |= visible[:-1]
    return replace(
        motion,
        frames=motion.frames[rows],
        places=motion.places[rows],
        turns=motion.turns[rows],
        travelled=motion.travelled[rows],
        lifts=motion.lifts[rows],
    )


def _add_box(prim: Sdf.PrimSpec, look: MovingLook) -> None:
    """A box with the actor's size and label."""
    set_class(prim, look.label)
    low, high = look.box
    points = np.stack(np.meshgrid(*np.stack([low, high]).T, indexing="ij"), -1).reshape(-1, 3)
    corners = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4],
                        [1, 5, 7, 3]]).reshape(-1)  # fmt: skip
    sizes = np.full(6, 4)
    normals = flat_normals(points, sizes, corners)
    mesh = Mesh(points, sizes, corners, normals, np.zeros((24, 2)))
    set_display_colour(add_mesh(prim, "Box", mesh), Gf.Vec3f(0.35, 0.36, 0.38))
