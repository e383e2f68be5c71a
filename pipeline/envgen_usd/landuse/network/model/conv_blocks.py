"""Convolutions of the network: equalised, masked and modulated."""

import math

import torch
from torch import Tensor, nn
from torch.nn import functional as F  # noqa: N812 - torch's own convention

from envgen_usd.landuse.network.model.forward_draws import Draws


def activate(x: Tensor) -> Tensor:
    """Leaky ReLU that keeps the variance."""
    return F.leaky_relu(x, 0.2) * math.sqrt(2.0)


def merge(x: Tensor, y: Tensor) -> Tensor:
    """Sum of two independent features that keeps the variance, so that logits start small."""
    return (x + y) * math.sqrt(0.5)


class Linear(nn.Module):
    """Fully connected layer with an equalised learning rate (Karras et al. 2018)."""

    def __init__(self, inputs: int, outputs: int, bias: float = 0.0, rate: float = 1.0) -> None:
        """Draws weights from N(0, 1 / rate²); the gain is applied at run time."""
        super().__init__()
        self.weight = nn.Parameter(torch.randn(outputs, inputs) / rate)
        self.bias = nn.Parameter(torch.full((outputs,), bias / rate))
        self._gain, self._rate = rate / math.sqrt(inputs), rate

    def forward(self, x: Tensor) -> Tensor:
        """Maps ... x inputs to ... x outputs."""
        return F.linear(x, self.weight * self._gain, self.bias * self._rate)


class Conv(nn.Module):
    """Convolution with an equalised learning rate; zero padding keeps the grid."""

    def __init__(self, inputs: int, outputs: int, size: int = 3, stride: int = 1) -> None:
        """Draws weights from N(0, 1)."""
        super().__init__()
        self.weight = nn.Parameter(torch.randn(outputs, inputs, size, size))
        self.bias = nn.Parameter(torch.zeros(outputs))
        self.stride, self.size = stride, size
        self._gain = 1.0 / math.sqrt(inputs * size * size)

    def forward(self, x: Tensor) -> Tensor:
        """Maps B x C x H x W to B x outputs x H / stride x W / stride."""
        weight = self.weight * self._gain
        return F.conv2d(x, weight, self.bias, self.stride, self.size // 2)


class MaskedConv(nn.Module):
    """Partial convolution over known cells, which grows the known area (Liu et al. 2018).

    1. Only known inputs enter.
    2. After bias and activation, the output is scaled by kernel size / number of known inputs.
    3. The output is 0 without known inputs.
    4. An output is known if any input is known.
    """

    def __init__(self, inputs: int, outputs: int, stride: int = 1, aware: bool = True) -> None:
        """Args: channels, stride, and whether the mask is used."""
        super().__init__()
        self.conv = Conv(inputs, outputs, 3, stride)
        self._aware = aware

    def forward(self, x: Tensor, mask: Tensor) -> tuple[Tensor, Tensor]:
        """Convolves.

        Args:
            x: B x C x H x W.
            mask: B x 1 x H x W, 1 where known.

        Returns:
            Features and their mask, both on the grid of the stride.
        """
        if not self._aware:
            y = activate(self.conv(x))
            return y, torch.ones_like(y[:, :1])
        y = activate(self.conv(x * mask))  # rule 1
        ones = mask.new_ones(1, 1, 3, 3)
        count = F.conv2d(mask, ones, stride=self.conv.stride, padding=1)
        known = (count > 0.5).to(x.dtype)
        scale = known * 9.0 / (count + 1e-8)  # rules 2 and 3
        return y * scale, known  # rule 4


class ModulatedConv(nn.Module):
    """Convolution whose input channels are scaled by the style (Karras et al. 2020).

    Activations are modulated instead of weights, which is equivalent and needs no grouped
    convolution. Demodulation brings each output channel back to unit variance.
    """

    def __init__(
        self, inputs: int, outputs: int, style: int, size: int = 3, demodulate: bool = True
    ) -> None:
        """Args: channels, width of the style, kernel size, whether to demodulate."""
        super().__init__()
        self.conv = Conv(inputs, outputs, size)
        self.affine = Linear(style, inputs, bias=1.0) if style else None
        self._demodulate = demodulate

    def forward(self, x: Tensor, style: Tensor) -> Tensor:
        """Maps B x C x H x W with a B x S style to B x outputs x H x W, without activation."""
        if self.affine is None:
            return torch.as_tensor(self.conv(x))
        scale = self.affine(style)  # B x C
        weight = self.conv.weight / math.sqrt(self.conv.weight[0].numel())
        y = F.conv2d(x * scale[:, :, None, None], weight, None, 1, self.conv.size // 2)
        if self._demodulate:
            power = weight.square().sum((2, 3))  # O x C
            norm = torch.rsqrt(scale.square() @ power.T + 1e-8)  # B x O
            y = y * norm[:, :, None, None]
        return y + self.conv.bias[:, None, None]


class StyledConv(nn.Module):
    """Modulated convolution, noise and activation."""

    def __init__(self, inputs: int, outputs: int, style: int, noisy: bool) -> None:
        """Args: channels, width of the style, whether noise is added."""
        super().__init__()
        self.conv = ModulatedConv(inputs, outputs, style)
        self.strength = nn.Parameter(torch.zeros(())) if noisy else None

    def forward(self, x: Tensor, style: Tensor, draws: Draws) -> Tensor:
        """Maps B x C x H x W to B x outputs x H x W."""
        y: Tensor = self.conv(x, style)
        if self.strength is not None:
            noise = draws.normal((1, y.shape[2], y.shape[3]))
            y = y + self.strength * noise.to(y.device, y.dtype)
        return activate(y)


def upsample(x: Tensor) -> Tensor:
    """Doubles the grid bilinearly."""
    return F.interpolate(x, scale_factor=2.0, mode="bilinear", align_corners=False)
