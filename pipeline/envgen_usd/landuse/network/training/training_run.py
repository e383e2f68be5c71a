"""A training run: samples in, weights, curves and sample sheets out."""

import csv
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import torch
from numpy.typing import NDArray

from envgen_usd.errors import EnvgenError, Issue, Severity
from envgen_usd.landuse.network.data.training_sample import Sample
from envgen_usd.landuse.network.model.forward_draws import Draws
from envgen_usd.landuse.network.model.network_config import NetworkConfig, TrainConfig
from envgen_usd.landuse.network.training.trainer import Losses, Trainer
from envgen_usd.landuse.network.training.training_batches import Batch, training_batch
from envgen_usd.landuse.network.training.training_sheets import write_curves, write_sheet
from envgen_usd.landuse.network.training.weights_file import read_state, write_state, write_weights
from envgen_usd.whole_files import make_folder, whole_file

Progress = Callable[[str, int, int], None]
"""Called with the step's name, the parts done and the total."""


@dataclass(frozen=True)
class Run:
    """Output files of a training run.

    Attributes:
        folder: Folder of ``state.pt``, ``weights.safetensors``, ``curves.csv`` and the images. The
            other files follow from the state.
        keep_every: Steps between two saved states.
    """

    folder: Path
    keep_every: int = 100


def train(  # noqa: PLR0913, PLR0917 - what a run follows from
    run: Run,
    samples: Sequence[Sample],
    network: NetworkConfig,
    config: TrainConfig,
    progress: Progress = lambda *_: None,
    warn: Callable[[Issue], None] = lambda _: None,
) -> Path:
    """Trains a network; resumes an interrupted run in the same folder.

    A run that had ended writes its weights, curves and images again, so lost ones come back. A
    damaged state begins anew.

    Args:
        run: Output files.
        samples: Samples to crop windows from.
        network: Layer sizes.
        config: Hyperparameters of the training.
        progress: Called with the progress of each step.
        warn: Called with an issue for a damaged state.

    Returns:
        The weights: moving averages, ready for sampling.

    Raises:
        EnvgenError: The folder holds a run of another network, or a file cannot be written.
    """
    folder = run.folder
    make_folder(folder)
    trainer = Trainer(network, config, torch.device("cuda" if torch.cuda.is_available() else "cpu"))
    state = folder / "state.pt"
    curves = _Curves(folder, _resume(trainer, state, warn))
    if trainer.step >= trainer.steps:
        _write_products(trainer, samples, curves, folder)
    while trainer.step < trainer.steps:
        losses = trainer.advance(samples)
        curves.add(trainer.step, losses)
        progress("training", trainer.step, trainer.steps)
        if trainer.step % run.keep_every == 0 or trainer.step == trainer.steps:
            _write_products(trainer, samples, curves, folder)
            # Last: a run that is killed before it computes these steps and files again.
            write_state(replace(trainer.state(), losses=curves.rows), state)
    return folder / "weights.safetensors"


def _resume(
    trainer: Trainer, path: Path, warn: Callable[[Issue], None]
) -> list[tuple[int, str, float]]:
    """Restores a saved state, if there is a whole one; returns the losses so far."""
    if not path.exists():
        return []
    try:
        state = read_state(path)
    except EnvgenError as error:
        text = str(error).partition(": ")[2]
        warn(Issue("training.damaged", Severity.WARNING, str(path), text, "training begins anew"))
        return []
    try:
        trainer.load(state)
    except (RuntimeError, ValueError) as error:
        raise EnvgenError(
            f"{path}: belongs to a training of another network; choose another --out"
        ) from error
    return state.losses


def _write_products(
    trainer: Trainer, samples: Sequence[Sample], curves: "_Curves", folder: Path
) -> None:
    write_weights(trainer.average, folder / "weights.safetensors")
    curves.write()
    _write_samples(trainer, samples, folder / "samples.png")


class _Curves:
    """Losses of every step."""

    def __init__(self, folder: Path, rows: list[tuple[int, str, float]]) -> None:
        self._path = folder / "curves.csv"
        self.rows = rows

    def add(self, step: int, losses: Losses) -> None:
        self.rows += [(step, name, value) for name, value in losses.items()]

    def write(self) -> None:
        with (
            whole_file(self._path) as part,
            part.open("w", newline="", encoding="utf-8") as file,
        ):
            csv.writer(file).writerows(self.rows)
        names = dict.fromkeys(name for _, name, _ in self.rows)
        curves = {name: [v for _, other, v in self.rows if other == name] for name in names}
        write_curves(curves, self._path.with_suffix(".png"))


def _write_samples(trainer: Trainer, samples: Sequence[Sample], path: Path) -> None:
    """Writes some windows with their known cells, the result of a single pass, and the truth."""
    config, task = trainer.config, trainer.task
    other = replace(config, seed=config.seed + 1)
    batch = training_batch(task, samples, 0, (config.size, 6), other)
    generated = most_likely_values(trainer, batch.to(trainer.device))
    truth, known = batch.truth.numpy(), batch.mask[:, 0].numpy() > 0
    rows = [
        (task.picture(true, given), task.picture(one), task.picture(true))
        for true, given, one in zip(truth, known, generated, strict=True)
    ]
    write_sheet(rows, path)


@torch.no_grad()
def most_likely_values(trainer: Trainer, batch: Batch) -> NDArray[Any]:
    """Most likely values of a batch by the averaged weights; known cells are unchanged."""
    seeds = range(len(batch.truth))
    output, _ = trainer.average(
        batch.known, batch.mask, batch.fields, batch.condition, Draws(seeds)
    )
    generated = torch.where(batch.mask[:, 0] > 0, batch.truth, trainer.task.decode(output))
    values: NDArray[Any] = generated.cpu().numpy()
    return values
