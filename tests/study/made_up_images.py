"""Tiny real and synthetic images, made up: bands of colour with their labels."""

from pathlib import Path

import numpy as np
from PIL import Image

COLOURS = np.array(
    [[90, 90, 95], [150, 120, 130], [120, 80, 60], [40, 40, 40], [50, 110, 40], [110, 150, 70],
     [150, 180, 230]], np.uint8,
)  # fmt: skip
HEIGHT, WIDTH = 48, 64


def scene(chance: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Sky above buildings above a road, with a pole: picture and classes 0 to 6."""
    classes = np.full((HEIGHT, WIDTH), 6, np.uint8)
    top, road = chance.integers(8, 20), chance.integers(26, 38)
    classes[top:] = 2
    classes[top:, : chance.integers(5, 20)] = 4
    classes[road:] = 0
    classes[road : road + 3] = 1
    pole = chance.integers(5, WIDTH - 8)
    classes[top:road, pole : pole + 3] = 3
    noise = chance.normal(0, 8, (HEIGHT, WIDTH, 3))
    return np.clip(COLOURS[classes] + noise, 0, 255).astype(np.uint8), classes


def write_real(folder: Path, sequences: dict[str, int], seed: int = 0) -> Path:
    """A data set with images/train and labels/train."""
    chance = np.random.default_rng(seed)
    for kind in ("images", "labels"):
        (folder / kind / "train").mkdir(parents=True)
    for name, count in sequences.items():
        for number in range(count):
            picture, classes = scene(chance)
            file = f"{name}_{number:05d}.png"
            Image.fromarray(picture).save(folder / "images" / "train" / file)
            Image.fromarray(classes).save(folder / "labels" / "train" / file)
    return folder


def write_frames(folder: Path, count: int, seed: int = 1) -> Path:
    """A folder of rendered frames with rgb and semantic (class ids of the taxonomy)."""
    ids = np.array([7, 8, 11, 17, 21, 22, 23], np.uint8)
    chance = np.random.default_rng(seed)
    for kind in ("rgb", "semantic"):
        (folder / kind).mkdir(parents=True)
    for number in range(count):
        picture, classes = scene(chance)
        Image.fromarray(255 - picture // 2).save(folder / "rgb" / f"{number:06d}.png")
        Image.fromarray(ids[classes]).save(folder / "semantic" / f"{number:06d}.png")
    return folder
