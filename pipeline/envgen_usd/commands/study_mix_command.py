"""The command `study mix`."""

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
    is_random,
    ratios,
    resolution,
    sizes,
)
from envgen_usd.commands.terminal_output import shown_progress


def mix(
    *,
    real: Real,
    synthetic: Synthetic,
    out: Annotated[Path, typer.Option(help="Folder of the study; the same command resumes.")],
    preset: Annotated[
        str,
        typer.Option(
            help="article: sizes 100, 500, 2000, 300 epochs, yolov8n, random split, mixes only."
        ),
    ] = "",
    size: Annotated[
        str | None, typer.Option("--sizes", help="Numbers of images N; default: 50,100,all.")
    ] = None,
    ratio: Annotated[
        str | None,
        typer.Option("--ratios", help="Shares of real images; default: 1,0.5,0.25,0.1,0.05,0."),
    ] = None,
    seeds: Annotated[int, typer.Option(min=1, help="Number of repetitions.")] = 5,
    arms: Annotated[
        str | None,
        typer.Option(help="Arms: mix, real_only, oversampled, flat, plain, added; default: all."),
    ] = None,
    folds: Annotated[
        int, typer.Option(min=2, help="Largest number of folds; sequences are joined to that many.")
    ] = 5,
    split: Annotated[
        str | None, typer.Option(help="sequence (default) or random, which flatters real images.")
    ] = None,
    classes: Classes = None,
    part: Part = "",
    network: Network | None = None,
    weights: Annotated[str, typer.Option(help="File of first weights; default: random.")] = "",
    iterations: Iterations = 600,
    epochs: Annotated[
        int | None, typer.Option(min=0, help="Passes over N images instead of --iterations.")
    ] = None,
    batch: Annotated[int, typer.Option(min=2, help="Images of a step.")] = 8,
    image_size: Resolution = "240x176",
    rate: Annotated[float, typer.Option(min=1e-6, help="Largest learning rate.")] = 3e-3,
    augment: Augment = "flip,light",
    class_weights: Annotated[
        str, typer.Option(help="Weights of classes in the loss: none, root, inverse.")
    ] = "none",
    balanced: Annotated[
        bool, typer.Option(help="Draw images with rare classes more often.")
    ] = False,
    batches: Annotated[
        str | None,
        typer.Option(help="even (default): half of a batch is synthetic; or proportional."),
    ] = None,
    batch_norm: Annotated[
        str,
        typer.Option(
            help="domain: of the synthetic and the real half of a batch apart; joint: together."
        ),
    ] = "domain",
    adapt: Annotated[
        str, typer.Option(help="Synthetic pictures take over from real ones: colour, fourier.")
    ] = "none",
    unlabelled: Annotated[
        int, typer.Option(min=0, help="Real pictures that --adapt sees, of training sequences.")
    ] = 0,
    schedule: Annotated[
        str, typer.Option(help="joint, or finetune: first synthetic, then real images.")
    ] = "joint",
    jobs: Annotated[
        int, typer.Option(min=1, help="Trainings side by side: processes, or threads on a GPU.")
    ] = 1,
    shard: Annotated[
        str, typer.Option(metavar="I/N", help="Only part I of N parts of the runs.")
    ] = "",
) -> None:
    """Trains on mixes of real and synthetic images, and scores on other real sequences.

    The same command resumes after an interruption. Shards share the folder, or are copied into it.
    """
    from envgen_usd.idle_options import refuse_idle
    from envgen_usd.recipe.dataset_plan import parse_shard
    from envgen_usd.study.pages.study_report import write_study_report
    from envgen_usd.study.real_images import read_real_images
    from envgen_usd.study.study_presets import preset as preset_of
    from envgen_usd.study.study_protocol import Protocol, make_plan
    from envgen_usd.study.study_runs import run_study
    from envgen_usd.study.study_summary import summarise
    from envgen_usd.study.synthetic_images import read_synthetic_images
    from envgen_usd.study.training_exercise import learner_of
    from envgen_usd.study.training_options import TrainingOptions

    given = preset_of(preset)
    width, height = resolution(image_size)
    protocol = Protocol(
        sizes(size) if size else given.protocol.sizes,
        ratios(ratio) if ratio else given.protocol.ratios,
        tuple(arms.split(",")) if arms else given.protocol.arms,
        seeds,
        folds,
        is_random(split) if split else given.protocol.random_split,
    )
    if protocol.random_split:
        refuse_idle({"--folds": folds != Protocol.folds}, "with a random split")
    options = TrainingOptions(
        network=network or given.network,
        weights=weights,
        iterations=iterations,
        epochs=given.epochs if epochs is None else epochs,
        batch=batch,
        width=width,
        height=height,
        rate=rate,
        augmentation=augmentation(augment),
        class_weights=class_weights,
        balanced=balanced,
        batches=batches or given.batches,
        batch_norm=batch_norm,
        adaptation=adapt,
        unlabelled=unlabelled,
        schedule=schedule,
    )
    part_of = parse_shard(shard)
    learner_of(options)
    photographs = read_real_images(real, classes, part)
    frames = read_synthetic_images(synthetic, photographs.frame_table)
    plan = make_plan(protocol, options, photographs.images, frames)
    with shown_progress() as progress:
        work = run_study(plan, out, jobs=jobs, shard=part_of, progress=progress)
    print(f"runs:   {work.trained} trained, {work.kept} kept")
    if work.missing:
        print(f"next:   the other shards; {work.missing} runs are missing")
        return
    write_study_report(plan, summarise(plan, out), out)
    print(f"table:  {out / 'table.md'}")
    print(f"report: {out / 'report.html'}")
