"""The critic: discriminates composites from real maps, given road, hole and environment."""

import math
from itertools import pairwise

import torch
from torch import Tensor, nn
from torch.nn import functional as F  # noqa: N812 - torch's own convention

from envgen_usd.landuse.network.model.conv_blocks import Conv, Linear, activate
from envgen_usd.landuse.network.model.network_config import NetworkConfig
from envgen_usd.landuse.network.tasks.known_tasks import task_of

GROUP = 4
"""Number of samples per group of the minibatch deviation."""


class Critic(nn.Module):
    """Residual critic with minibatch deviation and a projected condition."""

    def __init__(self, config: NetworkConfig) -> None:
        """Args: sizes; `critic` counts, about half of the generator's weights."""
        super().__init__()
        widths = config.critic
        pairs = list(pairwise(widths))
        self.enter = Conv((1 + task_of(config.target).inputs) * config.unshuffle**2, widths[0], 1)
        self.keep = nn.ModuleList(Conv(a, a) for a, _ in pairs)
        self.down = nn.ModuleList(Conv(a, b, stride=2) for a, b in pairs)
        self.skip = nn.ModuleList(Conv(a, b, 1) for a, b in pairs)
        self.last = Conv(widths[-1] + 1, widths[-1])
        self.embed = Linear(config.condition, widths[-1])
        self.feature = Linear(widths[-1], widths[-1])
        self._unshuffle = config.unshuffle

    def forward(self, image: Tensor, mask: Tensor, condition: Tensor) -> Tensor:
        """Scores.

        Args:
            image: B x inputs x H x W, see `Task.real`.
            mask: B x 1 x H x W, 1 where known.
            condition: B x condition.

        Returns:
            B scores, high for real.
        """
        x = torch.cat([image, mask - 0.5], dim=1)
        x = activate(self.enter(F.pixel_unshuffle(x, self._unshuffle)))
        for keep, down, skip in zip(self.keep, self.down, self.skip, strict=True):
            y = activate(down(activate(keep(x))))
            x = (skip(F.avg_pool2d(x, 2)) + y) / math.sqrt(2.0)
        x = activate(self.last(torch.cat([x, deviation(x)], dim=1)))
        feature = self.feature(x.mean((2, 3)))
        scores: Tensor = (feature * self.embed(condition)).sum(1)
        return scores / math.sqrt(feature.shape[1])


def deviation(x: Tensor) -> Tensor:
    """Mean deviation between the samples of a group as a feature map, B x 1 x H x W."""
    size = math.gcd(len(x), GROUP)
    groups = x.view(size, -1, *x.shape[1:])
    spread = (groups.var(0, unbiased=False) + 1e-8).sqrt().mean((1, 2, 3))
    return spread.repeat(size)[:, None, None, None].expand(-1, 1, *x.shape[2:])
