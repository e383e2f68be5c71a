"""Trains a network of PyTorch, on the CPU or a GPU, in mixed precision where that is faster."""

import math

import numpy as np
import torch
from torch import nn
from torch.nn import functional

from envgen_usd.errors import EnvgenError
from envgen_usd.models.array_types import ByteArray
from envgen_usd.study.known_networks import make_network
from envgen_usd.study.learners import Lesson, Predictor, Watcher
from envgen_usd.study.study_classes import VOID
from envgen_usd.study.training_options import TrainingOptions
from envgen_usd.study.training_pools import Batches, class_weights

WATCHES = 6
"""How often a training is watched; a larger value gives finer curves and takes longer."""
_MEAN, _DEVIATION = 0.45, 0.27
"""Common mean and deviation of the channels of driving pictures."""
_DECAY = 1e-4
_WARM_UP = 0.1
"""Share of the steps in which the learning rate rises."""
_SCORED_BATCH = 8


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
        torch.manual_seed(lesson.seed)
        options = self._options
        network = make_network(options.network, options.weights)
        network = network.to(self._device, memory_format=torch.channels_last)  # type: ignore[call-overload]
        optimiser = torch.optim.AdamW(network.parameters(), options.rate, weight_decay=_DECAY)
        cycle = torch.optim.lr_scheduler.OneCycleLR(
            optimiser, options.rate, total_steps=max(lesson.steps, 2), pct_start=_WARM_UP
        )
        weights = class_weights(options.class_weights, lesson.real, lesson.synthetic)
        weights = weights.to(self._device)
        batches, losses = Batches(lesson, options, self._device), []
        stops = {math.ceil(lesson.steps * (n + 1) / WATCHES) for n in range(WATCHES)}
        for step in range(lesson.steps):
            network.train()
            pictures, classes = batches.at(step)
            loss = functional.cross_entropy(
                self._logits(network, pictures), classes, weights, ignore_index=VOID
            )
            optimiser.zero_grad(set_to_none=True)
            loss.backward()  # type: ignore[no-untyped-call]
            optimiser.step()
            cycle.step()
            losses.append(loss.detach())
            if step + 1 in stops:
                watch(step + 1, _mean(losses), self._predictor(network))
                losses.clear()
        return self._predictor(network)

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


def _mean(losses: list[torch.Tensor]) -> float:
    mean = float(torch.stack(losses).mean())
    if not math.isfinite(mean):
        raise EnvgenError("the loss is no number any more; give a smaller --rate")
    return mean
