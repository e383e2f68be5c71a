"""Style: from noise and condition to the modulation of the decoders."""

from itertools import pairwise

import torch
from torch import Tensor, nn
from torch.nn import functional as F  # noqa: N812 - torch's own convention

from envgen_usd.landuse.network.model.conv_blocks import Conv, Linear, activate
from envgen_usd.landuse.network.model.forward_draws import Draws

MAP_SIDE = 8
"""Side of the token map that holds the style."""
KEPT = 0.5
"""Probability that a feature element is kept instead of replaced by the style's.

A larger value weakens the style.
"""


class Mapping(nn.Module):
    """Maps noise and condition to a style w (Karras et al. 2019)."""

    def __init__(self, condition: int, style: int, layers: int) -> None:
        """Args: length of the condition, width of the style, number of layers."""
        super().__init__()
        self.style = style
        self.embed = Linear(condition, style)
        widths = [2 * style] + [style] * layers
        self.layers = nn.ModuleList(Linear(a, b, rate=0.01) for a, b in pairwise(widths))

    def forward(self, noise: Tensor, condition: Tensor) -> Tensor:
        """Maps B x style noise and a B x condition to B x style."""
        x = torch.cat([_unit(noise), _unit(self.embed(condition))], dim=1)
        for layer in self.layers:
            x = activate(layer(x))
        return x


class StyleMix(nn.Module):
    """Replaces half of the coarsest features by the style, and pools the style of the image.

    The output concatenates the image's style and the mapping network's, so that both matter.
    """

    def __init__(self, dim: int, style: int) -> None:
        """Args: channels of the features, width of each style."""
        super().__init__()
        self.spread = Linear(style, MAP_SIDE * MAP_SIDE)
        self.down = nn.ModuleList([Conv(dim, dim, stride=2), Conv(dim, dim, stride=2)])
        self.image = Linear(dim, style)
        self.given = Linear(style, style)

    def forward(self, x: Tensor, w: Tensor, draws: Draws) -> tuple[Tensor, Tensor]:
        """Mixes.

        Args:
            x: B x C x H x W.
            w: B x style.
            draws: Random numbers that choose the replaced elements.

        Returns:
            Mixed features, B x C x H x W; style, B x 2 style.
        """
        laid = activate(self.spread(w)).view(-1, 1, MAP_SIDE, MAP_SIDE)
        laid = F.interpolate(laid, x.shape[2:], mode="bilinear", align_corners=False)
        keep = draws.uniform(tuple(x.shape[1:])).to(x.device) < KEPT
        x = torch.where(keep, x, laid.expand_as(x))
        # Single precision: oneDNN's bfloat16 gradients of convolutions to a few cells are wrong
        # (torch 2.13: they read uninitialised memory).
        with torch.autocast(x.device.type, enabled=False):
            y = x.float()
            for conv in self.down:
                y = activate(conv(y))
        image = activate(self.image(y.mean((2, 3))))
        return x, torch.cat([image, activate(self.given(w))], dim=1)


def _unit(x: Tensor) -> Tensor:
    """Scales each row to unit mean square."""
    return x * torch.rsqrt(x.square().mean(1, keepdim=True) + 1e-8)
