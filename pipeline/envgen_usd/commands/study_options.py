"""Options that the commands of studies share."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from envgen_usd.errors import EnvgenError

if TYPE_CHECKING:
    from envgen_usd.study.picture_augmentation import Augmentation

Real = Annotated[
    Path,
    typer.Option(help="Real data set: Cityscapes, KITTI-360, CamVid, or images/ and labels/."),
]
Synthetic = Annotated[
    list[Path],
    typer.Option(help="Folder of rendered frames (rgb, semantic) or a data set; repeatable."),
]
Classes = Annotated[
    Path | None,
    typer.Option(help="Class map of the real labels (TOML); default: by layout, or 0 to 6."),
]
Part = Annotated[
    str, typer.Option(help="Part of the real data set; default: train where there is one.")
]
Network = Annotated[str, typer.Option(help="small, yolov8n, torchvision:NAME or smp:NAME:ENCODER.")]
Resolution = Annotated[
    str,
    typer.Option(
        "--resolution", metavar="WxH", help="Size of training pictures; sides multiples of 16."
    ),
]
Iterations = Annotated[
    int, typer.Option(min=1, help="Steps of the optimiser, the same in every arm.")
]
Augment = Annotated[
    str,
    typer.Option(help="What is changed in training pictures: flip, light, framing, or none."),
]


def resolution(text: str) -> tuple[int, int]:
    """Reads ``240x176``.

    Raises:
        EnvgenError: The text is not two whole numbers.
    """
    width, _, height = text.partition("x")
    if not (width.isdecimal() and height.isdecimal()):
        raise EnvgenError(f"--resolution {text}: expected WIDTHxHEIGHT, e.g. 240x176")
    return int(width), int(height)


def augmentation(text: str) -> "Augmentation":
    """Reads names, e.g. ``flip,light``.

    Raises:
        EnvgenError: A name is unknown.
    """
    from envgen_usd.study.picture_augmentation import Augmentation

    names = {name.strip() for name in text.split(",")} - {"", "none"}
    unknown = names - {"flip", "light", "framing"}
    if unknown:
        raise EnvgenError(f"--augment {min(unknown)}: unknown; choose flip, light, framing or none")
    return Augmentation("flip" in names, "light" in names, "framing" in names)


def sizes(text: str) -> tuple[int, ...]:
    """Reads ``50,100,all``.

    Raises:
        EnvgenError: An item is neither a number from 1 nor ``all``.
    """
    from envgen_usd.study.study_protocol import ALL

    parts = [part.strip() for part in text.split(",")]
    bad = [part for part in parts if part != "all" and not (part.isdecimal() and int(part))]
    if bad:
        raise EnvgenError(f"--sizes {text}: '{bad[0]}' is no number from 1 and not 'all'")
    return tuple(ALL if part == "all" else int(part) for part in parts)


def is_random(text: str) -> bool:
    """Reads ``sequence`` or ``random``.

    Raises:
        EnvgenError: The text is neither.
    """
    if text not in {"sequence", "random"}:
        raise EnvgenError(f"--split {text}: unknown; choose sequence or random")
    return text == "random"


def ratios(text: str) -> tuple[float, ...]:
    """Reads ``1,0.5,0``.

    Raises:
        EnvgenError: An item is no number from 0 to 1.
    """
    try:
        values = tuple(float(part) for part in text.split(","))
    except ValueError as error:
        raise EnvgenError(f"--ratios {text}: expected numbers from 0 to 1") from error
    if not all(0.0 <= value <= 1.0 for value in values):
        raise EnvgenError(f"--ratios {text}: shares of real images are from 0 to 1")
    return values
