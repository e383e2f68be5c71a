"""The generator: fills the hole of a class map from what is known around it and everywhere."""

from dataclasses import replace

import torch
from torch import Tensor, nn
from torch.nn import functional as F  # noqa: N812 - torch's own convention

from envgen_usd.landuse.network.classes import INPUTS
from envgen_usd.landuse.network.config import NetworkConfig
from envgen_usd.landuse.network.draws import Draws
from envgen_usd.landuse.network.stages import FirstStage, SecondStage
from envgen_usd.landuse.network.style import Mapping


def one_hot(channels: Tensor) -> Tensor:
    """B x H x W channel numbers to B x `INPUTS` x H x W."""
    return F.one_hot(channels.long(), INPUTS).permute(0, 3, 1, 2).float()


def composite(logits: Tensor, known: Tensor, mask: Tensor) -> Tensor:
    """Probabilities of every class: given where known, generated in the hole, road never.

    Args:
        logits: B x `OUTPUTS` x H x W.
        known: B x `INPUTS` x H x W one-hot.
        mask: B x 1 x H x W, 1 where known.
    """
    generated = F.pad(logits.float().softmax(1), (0, 0, 0, 0, 1, 0))  # no road
    return known * mask + generated * (1 - mask)


class Generator(nn.Module):
    """Mask-aware transformer for class maps, in two stages (Li et al. 2022, adapted)."""

    def __init__(self, config: NetworkConfig) -> None:
        """Args: sizes."""
        super().__init__()
        self.config = config
        self.mapping = Mapping(config.condition, config.style, config.mapping)
        self.first = FirstStage(config)
        self.second = SecondStage(config)

    def forward(
        self, known: Tensor, mask: Tensor, fields: Tensor, condition: Tensor, draws: Draws
    ) -> tuple[Tensor, Tensor]:
        """Generates.

        Args:
            known: B x `INPUTS` x H x W one-hot; ignored where the mask is 0.
            mask: B x 1 x H x W, 1 where known.
            fields: B x E x H / 2 x W / 2, what is known everywhere.
            condition: B x condition.
            draws: Random numbers, one stream a sample.

        Returns:
            Logits of the second and of the first stage, B x `OUTPUTS` x H x W.
        """
        unshuffle = self.config.unshuffle
        w = self.mapping(draws.normal((self.config.style,)).to(fields), condition)
        given = torch.cat([mask - 0.5, known * mask], dim=1)
        cells = to_places(given, unshuffle)
        fields = to_grid(fields, cells)
        coarse = self.first(cells, F.max_pool2d(mask, unshuffle), (fields, condition), w, draws)
        guess = to_places(composite(coarse, known, mask).to(cells.dtype), unshuffle)
        refined = self.second(torch.cat([cells, guess, fields], dim=1), w, condition, draws)
        return refined + coarse, coarse


class PlainUNet(nn.Module):
    """Baseline: a U-Net with cross-entropy; no stages, no mask update, no style, no draws."""

    def __init__(self, config: NetworkConfig) -> None:
        """Args: sizes; those of the second stage count."""
        super().__init__()
        self.config = config
        self.net = SecondStage(replace(config, styled=False), plain=True)

    def forward(
        self, known: Tensor, mask: Tensor, fields: Tensor, condition: Tensor, draws: Draws
    ) -> tuple[Tensor, Tensor]:
        """Same arguments and results as `Generator.forward`; both logits are the same."""
        given = torch.cat([mask - 0.5, known * mask], dim=1)
        cells = to_places(given, self.config.unshuffle)
        x = torch.cat([cells, to_grid(fields, cells)], dim=1)
        logits = self.net(x, condition.new_zeros(len(x), 0), condition, draws)
        return logits, logits


def make_generator(config: NetworkConfig) -> Generator | PlainUNet:
    """Builds the network that a configuration describes."""
    return Generator(config) if config.kind == "mat" else PlainUNet(config)


def to_grid(fields: Tensor, like: Tensor) -> Tensor:
    """Brings the fields to the grid of another tensor."""
    if fields.shape[2:] != like.shape[2:]:
        fields = F.interpolate(fields, like.shape[2:], mode="bilinear", align_corners=False)
    return fields.contiguous(memory_format=torch.channels_last)


def to_places(cells: Tensor, unshuffle: int) -> Tensor:
    """Brings maps of cells to the network's grid, with channels last, which is faster."""
    places = F.pixel_unshuffle(cells, unshuffle)
    return places.contiguous(memory_format=torch.channels_last)
