"""The people of the shipped library: figures, poses, and colours of their clothes."""

from dataclasses import replace

from envgen_usd.assets.asset_design import AssetDesign, Model
from envgen_usd.assets.people import head_shapes
from envgen_usd.assets.people.body_sizes import child, man, woman
from envgen_usd.assets.people.figure_models import Figure, Outfit, figure_model, stride
from envgen_usd.assets.people.figure_pieces import FAR
from envgen_usd.assets.people.gait_angles import (
    PHASES,
    Pose,
    rolling,
    sitting,
    standing,
    waiting,
    walking,
)
from envgen_usd.assets.people.garment_shapes import Cut
from envgen_usd.assets.people.luggage_shapes import (
    backpack,
    pram,
    shoulder_bag,
    telephone,
    walking_stick,
    wheelchair,
)

_JACKET = Cut(0.505, 0.020, collar=0.866)
_JACKET_SLEEVE = Cut(1.97, 0.014, 0.046)
_COAT = Cut(0.300, 0.026, 0.030, collar=0.866)
_COAT_SLEEVE = Cut(1.98, 0.018, 0.050)
_SHIRT = Cut(0.500, 0.026)
_SHIRT_SLEEVE = Cut(0.52, 0.012, 0.066)
_PULLOVER = Cut(0.515, 0.018, collar=0.860)
_PULLOVER_SLEEVE = Cut(1.96, 0.010, 0.038)
_TROUSERS = Cut(2.06, 0.010, 0.062)
_JEANS = Cut(2.06, 0.007, 0.055)
_WIDE = Cut(2.08, 0.014, 0.074)

_SHORTS = Cut(0.92, 0.022, 0.085)
_DRESS = Cut(0.270, 0.014, 0.045)

FIGURES: dict[str, Figure] = {
    "woman_jacket": Figure(
        woman(1.66), Outfit(head_shapes.LONG, _JACKET, _JACKET_SLEEVE, _JEANS, zip_=True), telephone
    ),
    "man_jacket": Figure(
        man(1.79),
        Outfit(head_shapes.SHORT, _JACKET, _JACKET_SLEEVE, _TROUSERS, zip_=True),
        telephone,
    ),
    "woman_coat": Figure(
        woman(1.70), Outfit(head_shapes.BOB, _COAT, _COAT_SLEEVE, _JEANS, scarf=True), telephone
    ),
    "man_coat": Figure(
        man(1.83, breadth=1.04, belly=0.122),
        Outfit(head_shapes.RECEDING, _COAT, _COAT_SLEEVE, _TROUSERS, scarf=True),
        telephone,
    ),
    "woman_dress": Figure(
        woman(1.64, vigour=0.94),
        Outfit(head_shapes.TIED, _DRESS, Cut(0.38, 0.010, 0.062, 0.858), None),
        telephone,
    ),
    "man_shorts": Figure(
        man(1.76, waist=0.158, belly=0.124),
        Outfit(head_shapes.FULL, _SHIRT, _SHIRT_SLEEVE, _SHORTS),
        telephone,
    ),
    "child": Figure(
        child(1.24), Outfit(head_shapes.FULL, _JACKET, _JACKET_SLEEVE, _JEANS, zip_=True), backpack
    ),
    "old_man": Figure(
        man(1.70, stoop=15.0, vigour=0.62, belly=0.132, waist=0.160, limbs=0.94),
        Outfit(head_shapes.RECEDING, _JACKET, _JACKET_SLEEVE, _WIDE, scarf=True),
        walking_stick,
    ),
    "woman_bag": Figure(
        woman(1.61, breadth=1.10, depth=1.12, limbs=1.0, waist=0.160),
        Outfit(head_shapes.BUN, _PULLOVER, _PULLOVER_SLEEVE, _TROUSERS),
        shoulder_bag,
    ),
    "man_backpack": Figure(
        man(1.85, breadth=0.97),
        Outfit(head_shapes.BEANIE, _PULLOVER, _PULLOVER_SLEEVE, _JEANS),
        backpack,
    ),
    "woman_pram": Figure(
        woman(1.68, vigour=0.9),
        Outfit(head_shapes.TIED, _JACKET, _JACKET_SLEEVE, _JEANS, scarf=True),
        pram,
        grips=(0.75, 0.75),
    ),
    "wheelchair": Figure(
        man(1.74, belly=0.124),
        Outfit(head_shapes.SHORT, _PULLOVER, _PULLOVER_SLEEVE, _TROUSERS),
        wheelchair,
    ),
}
"""The figures by the end of the asset's name."""

Look = tuple[str, str, str, str]

CLOTHES: dict[str, Look] = {
    "navy_denim": ("cloth_navy", "cloth_denim", "cloth_pale", "leather_black"),
    "black_charcoal": ("cloth_black", "cloth_charcoal", "cloth_grey", "leather_black"),
    "grey_black": ("cloth_grey", "cloth_black", "cloth_white", "cloth_white"),
    "olive_beige": ("cloth_olive", "cloth_beige", "cloth_black", "leather_brown"),
    "red_denim": ("cloth_red", "cloth_denim", "cloth_navy", "cloth_white"),
    "beige_navy": ("cloth_beige", "cloth_navy", "cloth_brown", "leather_brown"),
    "teal_charcoal": ("cloth_teal", "cloth_charcoal", "cloth_pale", "leather_black"),
    "pale_faded": ("cloth_pale", "cloth_faded", "cloth_sky", "cloth_white"),
    "brown_black": ("cloth_brown", "cloth_black", "cloth_wine", "leather_black"),
}
"""Top, trousers, collar and shoes: mostly dark, blue and grey, some light, one red."""
_SKINS = ("light", "light", "tan", "light", "brown", "light", "tan", "light", "dark")
_HAIRS = ("brown", "black", "black", "blond", "black", "brown", "black", "grey", "black")


def poses(name: str) -> dict[str, Pose]:
    """Poses of a figure by name, the default first."""
    if name == "wheelchair":
        return {"sitting": sitting(), "rolling": rolling()}
    vigour = FIGURES[name].build.vigour
    walk = {f"walk_{k}": walking(k / PHASES, vigour) for k in range(PHASES)}
    still = {"standing": standing(), "waiting": waiting()}
    return still | walk if name == "woman_pram" else still | {"sitting": sitting()} | walk


def people_designs() -> tuple[AssetDesign, ...]:
    """An asset of the kind `pedestrian` for each figure."""
    return tuple(_design(name, figure) for name, figure in FIGURES.items())


def _design(name: str, figure: Figure) -> AssetDesign:
    models = {}
    for pose_name, pose in poses(name).items():
        model = figure_model(figure, pose)
        if pose_name.startswith("walk_"):
            model = replace(model, custom={"stride_length": round(stride(figure.build), 3)})
        models[pose_name] = model
    looks = {"clothes": worn_looks(name, figure, next(iter(models.values())))}
    return AssetDesign(
        f"pedestrian_{name}", "pedestrian", "person", models, "pose", looks, has_poses=True
    )


def worn_looks(name: str, figure: Figure, model: Model) -> dict[str, dict[str, str]]:
    """Materials by variant; skin and hair go with the clothes, another way for each figure."""
    number = sum(map(ord, name))
    names = {part.name for part in model.parts}
    found = {}
    for k, (variant, (top, legs, collar, shoes)) in enumerate(CLOTHES.items()):
        turn = (k + 2 * number) % len(_SKINS)
        skin = f"skin_{_SKINS[turn]}"
        worn = {
            "Head": skin, "Hair": _hair(name, figure, turn), "Top": top, "Sleeves": top,
            "Hands": skin, "Legs": legs, "Shins": skin, "Shoes": shoes, "Collar": collar,
        }  # fmt: skip
        near = {part: of for part, of in worn.items() if part in names}
        found[variant] = {**near, **{f"{FAR}/{part}": of for part, of in near.items()}}
    return found


def _hair(name: str, figure: Figure, turn: int) -> str:
    """Material of the hair, or of a cap: the old are grey, and children are not."""
    if figure.outfit.hair in (head_shapes.BEANIE, head_shapes.HELMET, head_shapes.FULL_FACE):
        return ("cloth_black", "cloth_grey", "cloth_wine")[turn % 3]
    colour = "grey" if name == "old_man" else _HAIRS[turn]
    return "hair_blond" if name == "child" and colour == "grey" else f"hair_{colour}"
