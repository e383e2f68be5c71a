"""Random numbers of a forward pass: a sample's numbers do not depend on its batch."""

from collections.abc import Callable, Sequence

import torch
from torch import Tensor


class Draws:
    """Draws tensors for a batch, with a stream for each sample.

    A stream is a CPU generator, so a result does not depend on the device.
    """

    def __init__(self, seeds: Sequence[int]) -> None:
        """Args: a seed for each sample of the batch."""
        self._streams = [torch.Generator().manual_seed(seed) for seed in seeds]

    def normal(self, shape: tuple[int, ...]) -> Tensor:
        """Standard normal numbers, B x shape."""
        return self._stack(torch.randn, shape)

    def uniform(self, shape: tuple[int, ...]) -> Tensor:
        """Numbers in [0, 1), B x shape."""
        return self._stack(torch.rand, shape)

    def _stack(self, draw: Callable[..., Tensor], shape: tuple[int, ...]) -> Tensor:
        return torch.stack([draw(shape, generator=stream) for stream in self._streams])
