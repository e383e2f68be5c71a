"""The generator: fills the hole of a map from its surroundings and from the fields."""

from dataclasses import replace

import torch
from torch import Tensor, nn
from torch.nn import functional as F  # noqa: N812 - torch's own convention

from envgen_usd.landuse.network.model.forward_draws import Draws
from envgen_usd.landuse.network.model.known_pyramid import spread
from envgen_usd.landuse.network.model.network_config import NetworkConfig
from envgen_usd.landuse.network.model.style_mapping import Mapping
from envgen_usd.landuse.network.model.transformer_stages import FirstStage, SecondStage
from envgen_usd.landuse.network.tasks.known_tasks import task_of

_FARTHEST = 4.0
"""Level of `spread` at which a known cell counts as far, half-way in the input."""


class Generator(nn.Module):
    """Mask-aware transformer in two stages (Li et al. 2022, adapted)."""

    def __init__(self, config: NetworkConfig) -> None:
        """Args: sizes."""
        super().__init__()
        self.config, self.task = config, task_of(config.target)
        self.mapping = Mapping(config.condition, config.style, config.mapping)
        self.first = FirstStage(config)
        self.second = SecondStage(config)

    def forward(
        self, known: Tensor, mask: Tensor, fields: Tensor, condition: Tensor, draws: Draws
    ) -> tuple[Tensor, Tensor]:
        """Generates.

        Args:
            known: B x inputs x H x W, see `Task`; ignored where the mask is 0.
            mask: B x 1 x H x W, 1 where known.
            fields: B x E x H / 2 x W / 2, known everywhere.
            condition: B x condition.
            draws: Random numbers, a stream per sample.

        Returns:
            Outputs of the second and the first stage, B x outputs x H x W: logits of classes, or
            greys.
        """
        unshuffle = self.config.unshuffle
        w = self.mapping(draws.normal((self.config.style,)).to(fields), condition)
        given = torch.cat([mask - 0.5, known * mask], dim=1)
        cells = to_places(given, unshuffle)
        fields = to_grid(fields, cells)
        coarse = self.first(cells, F.max_pool2d(mask, unshuffle), (fields, condition), w, draws)
        guess = to_places(self.task.composite(coarse, known, mask).to(cells.dtype), unshuffle)
        refined = self.second(torch.cat([cells, guess, fields], dim=1), w, condition, draws)
        return refined + coarse, coarse


class PlainUNet(nn.Module):
    """A U-Net; no stages, no mask update, no style, no draws.

    Known cells are spread over the hole first, so that the scattered ones of masked diffusion reach
    all others; what is given, like the road, is not spread.
    """

    def __init__(self, config: NetworkConfig) -> None:
        """Args: sizes; those of the second stage count."""
        super().__init__()
        self.config, self.task = config, task_of(config.target)
        self.net = SecondStage(replace(config, styled=False), plain=True)

    def forward(
        self, known: Tensor, mask: Tensor, fields: Tensor, condition: Tensor, draws: Draws
    ) -> tuple[Tensor, Tensor]:
        """Same arguments and results as `Generator.forward`; both outputs are the same."""
        given = known[:, : self.task.given] * mask
        chosen = mask * (1 - given.sum(1, keepdim=True))
        filled, level = spread(known[:, self.task.given :], chosen)
        inputs = torch.cat([1 - level / _FARTHEST, given, filled], dim=1)
        cells = to_places(inputs, self.config.unshuffle)
        x = torch.cat([cells, to_grid(fields, cells)], dim=1)
        logits = self.net(x, condition.new_zeros(len(x), 0), condition, draws)
        return logits, logits


def make_generator(config: NetworkConfig) -> Generator | PlainUNet:
    """Builds the network that a configuration describes."""
    return Generator(config) if config.kind == "mat" else PlainUNet(config)


def to_grid(fields: Tensor, like: Tensor) -> Tensor:
    """Resamples the fields to the grid of another tensor."""
    if fields.shape[2:] != like.shape[2:]:
        fields = F.interpolate(fields, like.shape[2:], mode="bilinear", align_corners=False)
    return fields.contiguous(memory_format=torch.channels_last)


def to_places(cells: Tensor, unshuffle: int) -> Tensor:
    """Converts cell maps to the network's grid, with channels last for speed."""
    places = F.pixel_unshuffle(cells, unshuffle)
    return places.contiguous(memory_format=torch.channels_last)
