"""A training run: samples in, weights, curves and sample sheets out."""

import csv
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import torch
from numpy.typing import NDArray

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
        folder: Folder of ``state.pt``, ``weights.safetensors``, ``curves.csv`` and the images.
        keep_every: Steps between two saved states.
    """

    folder: Path
    keep_every: int = 100


def train(
    run: Run,
    samples: Sequence[Sample],
    network: NetworkConfig,
    config: TrainConfig,
    progress: Progress = lambda *_: None,
) -> Path:
    """Trains a network; resumes an interrupted run in the same folder.

    Args:
        run: Output files.
        samples: Samples to crop windows from.
        network: Layer sizes.
        config: Hyperparameters of the training.
        progress: Called with the progress of each step.

    Returns:
        The weights: moving averages, ready for sampling.
    """
    folder = run.folder
    make_folder(folder)
    trainer = Trainer(network, config, torch.device("cuda" if torch.cuda.is_available() else "cpu"))
    state, curves = folder / "state.pt", _Curves(folder)
    if state.exists():
        trainer.load(read_state(state))
        curves.cut(trainer.step)
    while trainer.step < trainer.steps:
        losses = trainer.advance(samples)
        curves.add(trainer.step, losses)
        progress("training", trainer.step, trainer.steps)
        if trainer.step % run.keep_every == 0 or trainer.step == trainer.steps:
            write_state(trainer.state(), state)
            write_weights(trainer.average, folder / "weights.safetensors")
            curves.write()
            _write_samples(trainer, samples, folder / "samples.png")
    return folder / "weights.safetensors"


class _Curves:
    """Losses of every step."""

    def __init__(self, folder: Path) -> None:
        self._path = folder / "curves.csv"
        self._rows: list[tuple[int, str, float]] = []
        if self._path.exists():
            with self._path.open(newline="", encoding="utf-8") as file:
                self._rows = [(int(a), b, float(c)) for a, b, c in csv.reader(file)]

    def cut(self, step: int) -> None:
        """Removes all values after a step."""
        self._rows = [row for row in self._rows if row[0] <= step]

    def add(self, step: int, losses: Losses) -> None:
        self._rows += [(step, name, value) for name, value in losses.items()]

    def write(self) -> None:
        with (
            whole_file(self._path) as part,
            part.open("w", newline="", encoding="utf-8") as file,
        ):
            csv.writer(file).writerows(self._rows)
        names = dict.fromkeys(name for _, name, _ in self._rows)
        curves = {name: [v for _, other, v in self._rows if other == name] for name in names}
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
