"""A dressed person in a pose as a model of the library."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from envgen_usd.assets.asset_design import Model
from envgen_usd.assets.people import garment_shapes
from envgen_usd.assets.people.body_sizes import Build
from envgen_usd.assets.people.figure_pieces import Piece, composed, grounded
from envgen_usd.assets.people.gait_angles import Pose, walking
from envgen_usd.assets.people.garment_shapes import Cut
from envgen_usd.assets.people.head_shapes import (
    Hair,
    eye_meshes,
    hair_meshes,
    head_meshes,
    visor_mesh,
)
from envgen_usd.assets.people.lofted_forms import Loft
from envgen_usd.assets.people.pose_skeleton import LEFT, RIGHT, Skeleton, posed
from envgen_usd.assets.polygon_mesh import Mesh

SIDES = (LEFT, RIGHT)
MATERIALS = {
    "Head": "skin_light",
    "Hair": "hair_brown",
    "Eyes": "hair_black",
    "Top": "cloth_navy",
    "Sleeves": "cloth_navy",
    "Hands": "skin_light",
    "Legs": "cloth_denim",
    "Shoes": "leather_black",
    "Shins": "skin_light",
    "Collar": "cloth_white",
}
"""Material of each piece without a look."""


@dataclass(frozen=True)
class Outfit:
    """Clothes of a figure.

    Attributes:
        hair: Hair or cap.
        top: Shirt, jacket, coat or dress.
        sleeve: Its sleeves.
        legs: Trousers or shorts; `None` below a dress.
        scarf: True for a collar or scarf of a second colour.
        zip_: True for a line down the front in that colour.
    """

    hair: Hair
    top: Cut
    sleeve: Cut
    legs: Cut | None
    scarf: bool = False
    zip_: bool = False


@dataclass(frozen=True)
class Figure:
    """A person of the library.

    Attributes:
        build: The body.
        outfit: The clothes.
        equipped: What the person carries in a pose, and the skeleton with the arms that hold it.
        grips: Bend of the fingers of the left and the right hand, 0 to 1.
    """

    build: Build
    outfit: Outfit
    equipped: Callable[[Skeleton, Pose], tuple[Skeleton, Sequence[Piece]]] | None = None
    grips: tuple[float, float] = (0.35, 0.35)


Pair = tuple[list[Mesh], list[Mesh]]
"""Near and far meshes."""


def stride(build: Build) -> float:
    """Distance in metres that a cycle of the walk covers while no foot slides.

    A foot on the ground moves backwards under the hips with the speed of the walk: the straight
    line through its ankle from a tenth to four tenths of the cycle, when the sole lies flat.
    """
    share = np.linspace(0.10, 0.40, 7)
    ankles = [posed(build, walking(at, build.vigour)).legs[RIGHT].points[2, 0] for at in share]
    return -float(np.polyfit(share, ankles, 1)[0])


def figure_model(figure: Figure, pose: Pose) -> Model:
    """The geometry of a person in a pose, with the lowest point on the ground."""
    skeleton = posed(figure.build, pose)
    carried: Sequence[Piece] = ()
    if figure.equipped:
        skeleton, carried = figure.equipped(skeleton, pose)
    return grounded(composed((*body_pieces(figure, skeleton), *carried)))


def body_pieces(figure: Figure, skeleton: Skeleton, of_class: str = "") -> tuple[Piece, ...]:
    """Body and clothes."""
    outfit = figure.outfit
    head, hair = head_meshes(skeleton), hair_meshes(skeleton, outfit.hair)
    made: dict[str, tuple[Pair, str]] = {
        "Head": (([head[0]], [head[1]]), "head"),
        "Hair": (([hair[0]], [hair[1]]), "head"),
        "Eyes": ((_eyes(outfit, skeleton), []), "head"),
        "Top": (_top(figure, skeleton), "torso"),
        "Sleeves": (_sleeves(figure, skeleton), "arm"),
        "Hands": (_hands(figure, skeleton), "arm"),
        "Legs": (_legs(figure, skeleton), "leg"),
        "Shoes": (_shoes(skeleton), "leg"),
    }
    if outfit.legs is None or outfit.legs.hem < 1.5:
        made["Shins"] = _shins(figure, skeleton), "leg"
    if outfit.scarf or outfit.zip_:
        made["Collar"] = _trim(figure, skeleton), "torso"
    return tuple(
        Piece(name, near, far, MATERIALS[name], label, of_class)
        for name, ((near, far), label) in made.items()
        if near
    )


def _eyes(outfit: Outfit, skeleton: Skeleton) -> list[Mesh]:
    if outfit.hair.visor:
        return [visor_mesh(skeleton, outfit.hair)]
    return eye_meshes(skeleton)


def _top(figure: Figure, skeleton: Skeleton) -> Pair:
    loft = garment_shapes.top(skeleton, figure.outfit.top)
    count = len(loft.centres)
    rows = (0, count // 3, 2 * count // 3, count - 4, count - 2)
    return [loft.mesh(12)], [loft.coarse(5, rows)]


def _sleeves(figure: Figure, skeleton: Skeleton) -> Pair:
    lofts = [garment_shapes.sleeve(skeleton, side, figure.outfit.sleeve) for side in SIDES]
    return _both(lofts, 8, 3)


def _hands(figure: Figure, skeleton: Skeleton) -> Pair:
    near, far = [], []
    for side in SIDES:
        fingers, thumb = garment_shapes.hand(skeleton, side, figure.grips[side])
        near += [fingers.mesh(6), thumb.mesh(4)]
        far.append(fingers.coarse(3, (1, 4)))
    cuff = figure.outfit.sleeve.hem
    if cuff < 1.8:
        arms = [garment_shapes.bare_arm(skeleton, side, cuff - 0.15) for side in SIDES]
        bare = _both(arms, 8, 3)
        near, far = near + bare[0], far + bare[1]
    return near, far


def _legs(figure: Figure, skeleton: Skeleton) -> Pair:
    cut = figure.outfit.legs
    if cut is None:
        return [], []
    hips = garment_shapes.seat(skeleton, cut)
    near, far = _both([garment_shapes.leg(skeleton, side, cut) for side in SIDES], 9, 4)
    if figure.outfit.top.hem < 0.45:
        return near, far
    return [hips.mesh(10), *near], [*far]


def _shins(figure: Figure, skeleton: Skeleton) -> Pair:
    cut = figure.outfit.legs
    start = cut.hem - 0.12 if cut else (0.485 - figure.outfit.top.hem) / 0.245 - 0.2
    return _both([garment_shapes.bare_leg(skeleton, side, start) for side in SIDES], 8, 3)


def _shoes(skeleton: Skeleton) -> Pair:
    lofts = [garment_shapes.shoe(skeleton, side) for side in SIDES]
    return [loft.mesh(7) for loft in lofts], [loft.coarse(3, (1, 7)) for loft in lofts]


def _trim(figure: Figure, skeleton: Skeleton) -> Pair:
    """Scarf and zip."""
    near, far = _collar(skeleton) if figure.outfit.scarf else ([], [])
    if figure.outfit.zip_:
        near.append(_zip(figure, skeleton))
    return near, far


def _zip(figure: Figure, skeleton: Skeleton) -> Mesh:
    """A narrow band down the front of the top."""
    loft = garment_shapes.top(skeleton, figure.outfit.top)
    rows = slice(1, len(loft.centres) - 1)
    front = loft.centres[rows] + loft.front[rows] * (loft.sections[rows, 1:2] - 0.001)
    count = len(front)
    size = np.array([0.008, 0.004, 0.004, 3.0])
    return Loft(front, loft.left[rows], loft.front[rows], np.tile(size, (count, 1))).mesh(4)


def _collar(skeleton: Skeleton) -> Pair:
    """A collar or scarf around the root of the neck."""
    heights = np.array([0.844, 0.850, 0.862, 0.880, 0.886])
    centres, frames = garment_shapes.trunk_path(skeleton, heights)
    sections = np.array(
        [[0.070, 0.060, 0.072, 2.0], [0.088, 0.074, 0.088, 2.0], [0.085, 0.074, 0.086, 2.0],
         [0.073, 0.072, 0.076, 2.0], [0.060, 0.058, 0.064, 2.0]]
    )  # fmt: skip
    sections[:, :3] *= skeleton.build.scale
    loft = Loft(centres, frames[..., 1], frames[..., 0], sections)
    return [loft.mesh(10)], [loft.coarse(4, (1, 3))]


def _both(lofts: Sequence[Loft], sides: int, few: int) -> Pair:
    """Meshes of a pair of limbs."""
    rows = [(1, len(loft.centres) // 2, len(loft.centres) - 2) for loft in lofts]
    far = [loft.coarse(few, chosen) for loft, chosen in zip(lofts, rows, strict=True)]
    return [loft.mesh(sides) for loft in lofts], far
