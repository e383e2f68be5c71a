"""Trains a network of PyTorch, on the CPU or a GPU, in mixed precision where that is faster."""

import math
import threading
from contextlib import AbstractContextManager, nullcontext
from itertools import pairwise

import numpy as np
import torch
from torch import nn
from torch.nn import functional

from envgen_usd.errors import EnvgenError
from envgen_usd.models.array_types import ByteArray
from envgen_usd.study.captured_work import CapturedWork
from envgen_usd.study.domain_norms import running_means_kept, synthetic_apart
from envgen_usd.study.known_networks import make_network
from envgen_usd.study.learners import Lesson, Predictor, Watcher
from envgen_usd.study.lesson_batches import Batches, class_weights
from envgen_usd.study.study_classes import VOID
from envgen_usd.study.training_options import TrainingOptions

WATCHES = 6
"""How often a training is watched; a larger value gives finer curves and takes longer."""
_MEAN, _DEVIATION = 0.45, 0.27
"""Common mean and deviation of the channels of driving pictures."""
_DECAY = 1e-4
_WARM_UP = 0.1
"""Share of the steps in which the learning rate rises."""
_SCORED_BATCH = 8
_SEEDING = threading.Lock()
"""First weights come from random numbers that all threads share."""


class TorchLearner:
    """A network by name, trained with AdamW and one cycle of the learning rate (Smith 2018)."""

    def __init__(self, options: TrainingOptions) -> None:
        """Args: how to train.

        Raises:
            EnvgenError: The network is unknown, its library is missing, or its weights do not fit.
        """
        make_network(options.network, options.weights)  # before any file is written
        self._options = options
        self._device = torch.device("cuda" if torch.cuda.is_available() else "cpu")
        self._half = self._device.type == "cuda" or bool(
            torch.ops.mkldnn._is_mkldnn_bf16_supported()
        )

    def learn(self, lesson: Lesson, watch: Watcher) -> Predictor:
        """Trains from the start and returns the trained network.

        Raises:
            EnvgenError: The loss is no number any more.
        """
        with self._stream():
            predict = self._learnt(lesson, watch)
            if self._device.type == "cuda":
                torch.cuda.current_stream().synchronize()
        return predict

    def _learnt(self, lesson: Lesson, watch: Watcher) -> Predictor:
        options = self._options
        network = self._first_state(lesson.seed)
        optimiser = torch.optim.AdamW(
            network.parameters(),
            options.rate,
            weight_decay=_DECAY,
            fused=self._device.type == "cuda",
        )
        cycle = torch.optim.lr_scheduler.OneCycleLR(
            optimiser, options.rate, total_steps=max(lesson.steps, 2), pct_start=_WARM_UP
        )
        losses = torch.zeros((), device=self._device)
        gradients = self._gradients(network, optimiser, lesson, losses)
        stops = [math.ceil(lesson.steps * n / WATCHES) for n in range(WATCHES + 1)]
        for before, stop in pairwise(sorted(set(stops))):
            for _ in range(before, stop):
                gradients()
                optimiser.step()
                cycle.step()
            watch(stop, _mean(losses, stop - before), self._predictor(network))
            losses.zero_()
        return self._predictor(network)

    def _stream(self) -> AbstractContextManager[object]:
        """A queue of the GPU for this training: others go on beside it."""
        if self._device.type != "cuda":
            return nullcontext()
        return torch.cuda.stream(torch.cuda.Stream())  # type: ignore[no-untyped-call]

    def _first_state(self, seed: int) -> nn.Module:
        with _SEEDING:
            torch.manual_seed(seed)
            network = make_network(self._options.network, self._options.weights)
        return network.to(self._device, memory_format=torch.channels_last)  # type: ignore[call-overload, no-any-return]

    def _gradients(
        self,
        network: nn.Module,
        optimiser: torch.optim.Optimizer,
        lesson: Lesson,
        losses: torch.Tensor,
    ) -> CapturedWork:
        """Work that finds the gradients of the next step, and adds its loss to `losses`."""
        options = self._options
        batches = Batches(lesson, options, self._device)
        weights = class_weights(options.class_weights, lesson.real, lesson.synthetic)
        weights = weights.to(self._device)
        step = torch.zeros(1, dtype=torch.int64, device=self._device)
        apart = synthetic_apart(lesson, options)

        def work() -> None:
            network.train()
            pictures, classes = batches.at(step)
            logits = self._logits_apart(network, pictures, apart)
            loss = functional.cross_entropy(logits, classes, weights, ignore_index=VOID)
            loss.backward()  # type: ignore[no-untyped-call]
            losses.add_(loss.detach())
            step.add_(1)

        return CapturedWork(work, lambda: optimiser.zero_grad(set_to_none=True), batches.draws)

    def _logits_apart(
        self, network: nn.Module, pictures: torch.Tensor, synthetic: int
    ) -> torch.Tensor:
        """Logits of a batch whose first pictures, synthetic ones, are normed apart."""
        if not synthetic:
            return self._logits(network, pictures)
        with running_means_kept(network):
            first = self._logits(network, pictures[:synthetic])
        return torch.cat([first, self._logits(network, pictures[synthetic:])])

    def _logits(self, network: nn.Module, pictures: torch.Tensor) -> torch.Tensor:
        values = normalised(pictures)
        with torch.autocast(self._device.type, torch.bfloat16, enabled=self._half):
            logits: torch.Tensor = network(values)
        return logits.float()

    def _predictor(self, network: nn.Module) -> Predictor:
        def predict(pictures: ByteArray, size: tuple[int, int]) -> ByteArray:
            network.eval()
            parts = []
            for first in range(0, len(pictures), _SCORED_BATCH):
                batch = np.moveaxis(pictures[first : first + _SCORED_BATCH], 3, 1)
                values = torch.from_numpy(np.ascontiguousarray(batch)).to(self._device)
                with torch.no_grad():
                    logits = self._logits(network, values.float() / 255.0)
                    wide = functional.interpolate(logits, size, mode="bilinear")
                parts.append(wide.argmax(1).byte().cpu().numpy())
            return np.concatenate(parts)

        return predict


def normalised(pictures: torch.Tensor) -> torch.Tensor:
    """Pictures, B x 3 x H x W, 0 to 1, as networks take them."""
    values = (pictures - _MEAN) / _DEVIATION
    return values.contiguous(memory_format=torch.channels_last)


def _mean(losses: torch.Tensor, count: int) -> float:
    mean = float(losses) / count
    if not math.isfinite(mean):
        raise EnvgenError("the loss is no number any more; give a smaller --rate")
    return mean
