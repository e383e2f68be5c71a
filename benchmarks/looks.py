"""Compares brightness, chroma and gradient of each class with labelled photographs.

    python benchmarks/looks.py before=FRAMES now=FRAMES CamVid=camvid7:train KITTI=kitti5:train

Each column is `NAME=FOLDER`: a folder of frames of a run, or `FOLDER:PART` with photographs in
`images/PART` and labels of the same names in `labels/PART`, 8 bits: 0 road, 1 sidewalk, 2 building,
3 pole, 4 vegetation, 5 terrain, 6 sky, others are ignored. Prints a table in Markdown.

Figures are of each image, over the classes with at least `LEAST` pixels; a cell is their mean, with
the 10th and the 90th percentile over the images. Brightness is luma (Rec. 601), 0 to 255. Chroma is
that of CIELAB (D65). Gradient is the mean difference of luma between neighbours of one class, in
rows and in columns, in levels a pixel; it depends on the size of the images.
"""

import argparse
import sys
from collections import defaultdict
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np
from PIL import Image

from envgen_usd import read_frames
from envgen_usd.label_taxonomy import labels

CLASSES = ("road", "sidewalk", "building", "pole", "vegetation", "terrain", "sky")
"""By their number in the labels, which is the article's train id."""
MEASURES = ("brightness", "chroma", "gradient")
LEAST = 300
"""Pixels of a class below which an image says nothing of it; a larger value leaves out more."""
_TO_XYZ = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
_WHITE = np.array([0.9505, 1.0, 1.0890])


def frames(folder: Path) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Images of a run with the article's train ids."""
    number = np.full(256, 255, np.uint8)
    for label in labels():
        number[label.id] = label.article_train_id
    for frame in read_frames(folder):
        yield frame.rgb, number[frame.semantic]


def photographs(folder: Path, part: str) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Labelled photographs."""
    for path in sorted((folder / "images" / part).iterdir()):
        label = folder / "labels" / part / f"{path.stem}.png"
        image, classes = Image.open(path).convert("RGB"), Image.open(label)
        if abs(np.log(image.width * classes.height / image.height / classes.width)) > 0.01:
            print(f"{path.name}: left out, its labels have another shape", file=sys.stderr)
        else:
            # KITTI's photographs are there in 0.986 of the size of their labels.
            fitting = classes.resize(image.size, Image.Resampling.NEAREST)
            yield np.asarray(image), np.asarray(fitting)


def chroma(image: np.ndarray) -> np.ndarray:
    """H x W, CIELAB's chroma of sRGB levels, H x W x 3."""
    value = image / 255.0
    linear = np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)
    share = linear @ _TO_XYZ.T / _WHITE
    curve = np.where(share > (6 / 29) ** 3, np.cbrt(share), share * (29 / 6) ** 2 / 3 + 4 / 29)
    x, y, z = np.moveaxis(curve, -1, 0)
    return np.hypot(500 * (x - y), 200 * (y - z))


def measures(image: np.ndarray, classes: np.ndarray) -> Iterator[tuple[str, str, float]]:
    """Class, measure and value of each class that an image shows."""
    luma, colour = image @ [0.299, 0.587, 0.114], chroma(image)
    for number, name in enumerate(CLASSES):
        own = classes == number
        if own.sum() < LEAST:
            continue
        yield name, "brightness", float(luma[own].mean())
        yield name, "chroma", float(colour[own].mean())
        across, down = own[:, 1:] & own[:, :-1], own[1:] & own[:-1]
        steps = np.abs(np.diff(luma, axis=1))[across], np.abs(np.diff(luma, axis=0))[down]
        yield name, "gradient", float(np.concatenate(steps).mean())


def column(images: Iterable[tuple[np.ndarray, np.ndarray]]) -> dict[tuple[str, str], np.ndarray]:
    """Values of all images by class and measure."""
    found = defaultdict(list)
    for image, classes in images:
        for name, measure, value in measures(image, classes):
            found[name, measure].append(value)
    return {key: np.array(values) for key, values in found.items()}


def cell(values: np.ndarray | None) -> str:
    """Mean, and the 10th and 90th percentile."""
    if values is None:
        return ""
    low, high = np.percentile(values, [10, 90])
    digits = 0 if values.mean() >= 20 else 1
    return f"{values.mean():.{digits}f} ({low:.{digits}f}–{high:.{digits}f})"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("columns", nargs="+", metavar="NAME=FOLDER[:PART]")
    columns = {}
    for text in parser.parse_args().columns:
        name, _, place = text.partition("=")
        folder, _, part = place.partition(":")
        images = photographs(Path(folder), part) if part else frames(Path(folder))
        columns[name] = column(images)
    print(f"| | {' | '.join(columns)} |\n|---|{'---|' * len(columns)}")
    for measure in MEASURES:
        for name in CLASSES:
            cells = [cell(each.get((name, measure))) for each in columns.values()]
            print(f"| {measure}, {name} | {' | '.join(cells)} |")


if __name__ == "__main__":
    main()
