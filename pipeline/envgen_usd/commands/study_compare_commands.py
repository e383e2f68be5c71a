"""The commands `study realism` and `study diagnose`: real images beside synthetic ones."""

from pathlib import Path
from typing import Annotated

import typer

from envgen_usd.commands.study_options import (
    Augment,
    Classes,
    Iterations,
    Network,
    Part,
    Real,
    Resolution,
    Synthetic,
    augmentation,
    resolution,
)
from envgen_usd.commands.terminal_output import shown_progress
from envgen_usd.errors import EnvgenError

_OUT = typer.Option(help="Folder of the result.")


def realism(
    *,
    real: Real,
    synthetic: Synthetic,
    out: Annotated[Path, _OUT],
    classes: Classes = None,
    part: Part = "",
    iterations: Iterations = 300,
    image_size: Resolution = "240x176",
    real_place: Annotated[
        Path | None, typer.Option(help="Real place: OpenStreetMap, CityGML or CityJSON.")
    ] = None,
    place: Annotated[
        Path | None, typer.Option(help="Town of the frames, e.g. its city.gml; with --real-place.")
    ] = None,
) -> None:
    """Measures how far synthetic images are from real ones, beside real sequences from another.

    Class shares, places, neighbours, brightness, chroma and edges by class, and the distance in the
    features of an encoder that learns from the real images. With places also plots, buildings,
    trees and lights.
    """
    from envgen_usd.output_folder import refuse_build
    from envgen_usd.recipe.place_realism import place_distances
    from envgen_usd.recipe.real_place import read_place
    from envgen_usd.study.pages.diagnosis_report import write_realism
    from envgen_usd.study.pages.study_tables import markdown
    from envgen_usd.study.real_images import read_real_images
    from envgen_usd.study.set_realism import measure_realism
    from envgen_usd.study.synthetic_images import read_synthetic_images
    from envgen_usd.study.training_options import TrainingOptions

    refuse_build(out)
    if (real_place is None) != (place is None):
        raise EnvgenError("study realism: --real-place and --place are compared; give both")
    layers = (
        place_distances(read_place(real_place), read_place(place)) if real_place and place else ()
    )
    width, height = resolution(image_size)
    options = TrainingOptions(iterations=iterations, width=width, height=height)
    photographs = read_real_images(real, classes, part)
    frames = read_synthetic_images(synthetic, photographs.frame_table)
    found = measure_realism(photographs.images, frames, options)
    for table in write_realism(found, layers, out):
        print(markdown(table), end="\n\n")
    print(f"report: {out / 'report.html'}")


def diagnose(
    *,
    real: Real,
    synthetic: Synthetic,
    out: Annotated[Path, typer.Option(help="Folder of the result; the same command resumes.")],
    classes: Classes = None,
    part: Part = "",
    seeds: Annotated[int, typer.Option(min=1, help="Number of repetitions.")] = 1,
    network: Network = "small",
    iterations: Iterations = 600,
    image_size: Resolution = "240x176",
    augment: Augment = "flip",
) -> None:
    """Ranks what costs synthetic images most: trains on them with one fault taken out at a time.

    Changes: each class in the colours of the real one, real skies, random light, void in grey.
    """
    from envgen_usd.study.diagnosis import diagnose as run
    from envgen_usd.study.pages.diagnosis_report import write_diagnosis
    from envgen_usd.study.pages.study_tables import markdown
    from envgen_usd.study.real_images import read_real_images
    from envgen_usd.study.synthetic_images import read_synthetic_images
    from envgen_usd.study.training_exercise import learner_of
    from envgen_usd.study.training_options import TrainingOptions

    width, height = resolution(image_size)
    options = TrainingOptions(
        network=network,
        iterations=iterations,
        width=width,
        height=height,
        augmentation=augmentation(augment),
    )
    learner_of(options)
    photographs = read_real_images(real, classes, part)
    frames = read_synthetic_images(synthetic, photographs.frame_table)
    with shown_progress() as progress:
        found = run(photographs.images, frames, options, out, seeds=seeds, progress=progress)
    print(markdown(write_diagnosis(found, out)))
    print(f"report: {out / 'report.html'}")
