"""The two stages of the mask-aware transformer."""

from collections.abc import Sequence

import torch
from torch import Tensor, nn
from torch.nn import functional as F  # noqa: N812 - torch's own convention

from envgen_usd.landuse.network.model.attention import Group
from envgen_usd.landuse.network.model.conv_blocks import (
    Conv,
    Linear,
    MaskedConv,
    ModulatedConv,
    StyledConv,
    activate,
    merge,
    upsample,
)
from envgen_usd.landuse.network.model.forward_draws import Draws
from envgen_usd.landuse.network.model.network_config import NetworkConfig
from envgen_usd.landuse.network.model.style_mapping import StyleMix
from envgen_usd.landuse.network.tasks.known_tasks import task_of


class Pyramid(nn.Module):
    """Features of the fields on every grid of the network, independent of the mask."""

    def __init__(self, fields: int, condition: int, widths: Sequence[int]) -> None:
        """Args: channels of the fields, of the condition, and of each grid, finest first."""
        super().__init__()
        self.condition = Linear(condition, widths[0])
        inputs = (fields, *widths[:-1])
        self.convs = nn.ModuleList(
            Conv(a, b, 3, 1 if level == 0 else 2)
            for level, (a, b) in enumerate(zip(inputs, widths, strict=True))
        )

    def forward(self, fields: Tensor, condition: Tensor) -> list[Tensor]:
        """Maps B x E x H x W and B x C to a tensor per grid, each half as fine as before."""
        levels, x = [], fields
        given = self.condition(condition)[:, :, None, None]
        for level, conv in enumerate(self.convs):
            x = activate(conv(x) if level else merge(conv(x), given))
            levels.append(x)
        return levels


class Decoder(nn.Module):
    """Doubles the grid step by step; outputs (logits or greys) of all grids are summed."""

    def __init__(self, inputs: int, config: NetworkConfig, widths: Sequence[int]) -> None:
        """Args: input channels, sizes, channels of each finer grid, coarsest first."""
        super().__init__()
        style = 2 * config.style if config.styled else 0
        outputs = task_of(config.target).outputs * config.unshuffle**2
        before = (inputs, *widths[:-1])
        pairs = list(zip(before, widths, strict=True))
        self.lift = nn.ModuleList(StyledConv(a, b, style, config.styled) for a, b in pairs)
        self.join = nn.ModuleList(StyledConv(b, b, style, config.styled) for b in widths)
        self.out = nn.ModuleList(
            ModulatedConv(width, outputs, style, 1, demodulate=False) for width in (inputs, *widths)
        )
        self._gain, self._unshuffle = config.output_gain, config.unshuffle

    def forward(self, x: Tensor, skips: Sequence[Tensor], style: Tensor, draws: Draws) -> Tensor:
        """Decodes.

        Args:
            x: B x C x H x W.
            skips: Features to add on each finer grid, coarsest first.
            style: B x 2 style.
            draws: Random numbers of the noise.

        Returns:
            Logits, B x outputs x H' x W', on the grid of cells.
        """
        logits = self.out[0](x, style)
        steps = zip(self.lift, self.join, self.out[1:], skips, strict=True)
        for lift, join, out, skip in steps:
            x = merge(lift(upsample(x), style, draws), skip)
            x = join(x, style, draws)
            logits = upsample(logits) + out(x, style)
        return F.pixel_shuffle(logits * self._gain, self._unshuffle)


class FirstStage(nn.Module):
    """Masked convolutional head, five groups of transformer blocks, styled decoder."""

    def __init__(self, config: NetworkConfig) -> None:
        """Args: sizes."""
        super().__init__()
        widths = (*config.head, config.dim, config.dim)
        inputs = (1 + task_of(config.target).inputs) * config.unshuffle**2
        before = (inputs, *widths[:-1])
        self.head = nn.ModuleList(
            MaskedConv(a, b, 1 if level == 0 else 2, config.mask_aware)
            for level, (a, b) in enumerate(zip(before, widths, strict=True))
        )
        self.fields = Pyramid(config.fields, config.condition, widths)
        self.enter = Conv(config.head[-1], config.dim, 1)
        self.groups = nn.ModuleList(
            Group(config.dim, config.heads, depth, config.window, config.mask_aware)
            for depth in config.depths
        )
        self.rise = nn.ModuleList(Conv(config.dim, config.dim) for _ in range(2))
        self.mix = StyleMix(config.dim, config.style) if config.styled else None
        self.decoder = Decoder(config.dim, config, config.head[-2::-1])
        self._levels = len(config.head)

    def forward(
        self, x: Tensor, mask: Tensor, given: tuple[Tensor, Tensor], w: Tensor, draws: Draws
    ) -> Tensor:
        """Generates.

        Args:
            x: B x C x H x W, unshuffled.
            mask: B x 1 x H x W.
            given: Fields, B x E x H x W, and condition.
            w: B x style.
            draws: Random numbers.

        Returns:
            Logits of the cells.
        """
        pyramid = self.fields(*given)
        skips: list[Tensor] = []
        for level in range(self._levels):
            x, mask = self.head[level](x, mask)
            x = merge(x, pyramid[level])
            skips.append(x)
        x = self.enter(x)
        kept = []
        for number in range(3):
            if number:
                x, mask = self.head[self._levels + number - 1](x, mask)
                x = merge(x, pyramid[self._levels + number - 1])
            x, after = self.groups[number](x, mask if number < 2 else None)
            mask = mask if after is None else after
            kept.append(x)
        style = x.new_zeros(len(x), 0)
        if self.mix is not None:
            x, style = self.mix(x, w, draws)
        for number, skip in zip((3, 4), kept[1::-1], strict=True):
            x = merge(activate(self.rise[number - 3](upsample(x))), skip)
            x, _ = self.groups[number](x, None)
        return torch.as_tensor(self.decoder(x, skips[-2::-1], style, draws))


class SecondStage(nn.Module):
    """Convolutional U-Net that refines the composite of the first stage."""

    def __init__(self, config: NetworkConfig, plain: bool = False) -> None:
        """Args: sizes, and whether it is a baseline without a first stage."""
        super().__init__()
        maps = 1 if plain else 2
        cells = (1 + maps * task_of(config.target).inputs) * config.unshuffle**2
        before = (cells + config.fields, *config.refine[:-1])
        self.encoder = nn.ModuleList(
            Conv(a, b, 3, 1 if level == 0 else 2)
            for level, (a, b) in enumerate(zip(before, config.refine, strict=True))
        )
        self.deep = Conv(config.refine[-1], config.refine[-1])
        self.condition = Linear(config.condition, config.refine[0])
        self.mix = StyleMix(config.refine[-1], config.style) if config.styled else None
        self.decoder = Decoder(config.refine[-1], config, config.refine[-2::-1])

    def forward(self, x: Tensor, w: Tensor, condition: Tensor, draws: Draws) -> Tensor:
        """Maps unshuffled inputs beside fields, B x C x H x W, to logits of the cells."""
        skips: list[Tensor] = []
        given = self.condition(condition)[:, :, None, None]
        for level, conv in enumerate(self.encoder):
            x = activate(conv(x) if level else merge(conv(x), given))
            skips.append(x)
        x = activate(self.deep(x))
        style = x.new_zeros(len(x), 0)
        if self.mix is not None:
            x, style = self.mix(x, w, draws)
        return torch.as_tensor(self.decoder(x, skips[-2::-1], style, draws))
