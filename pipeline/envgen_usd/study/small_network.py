"""The default network: small enough that two cores train it in about a minute."""

from functools import cache
from itertools import pairwise

import torch
from torch import nn
from torch.nn import functional

_WIDTHS = (16, 32, 64, 96)
"""Channels at a half, a quarter, an eighth and a sixteenth of the size; more learn more, slower."""


class SmallNetwork(nn.Module):
    """A U-Net (Ronneberger et al. 2015) of four levels with batch norm; 0.34 M weights.

    A pixel's class follows from about 150 x 150 pixels around it, and from no mean of the whole
    picture, which differs between synthetic and real pictures.
    """

    def __init__(self, classes: int) -> None:
        """Args: number of classes."""
        super().__init__()
        self.stem = _convolution(3, _WIDTHS[0], 2)
        self.down = nn.ModuleList(
            nn.Sequential(nn.MaxPool2d(2), _convolution(before, after), _convolution(after, after))
            for before, after in pairwise(_WIDTHS)
        )
        self.up = nn.ModuleList(
            _convolution(coarse + fine, fine) for fine, coarse in pairwise(_WIDTHS)
        )
        self.head = nn.Conv2d(_WIDTHS[0], classes, 1)

    def features(self, pictures: torch.Tensor) -> list[torch.Tensor]:
        """Levels of the encoder, finest first; B x C x H / 2ⁿ x W / 2ⁿ, n from 1 to 4."""
        levels = [self.stem(pictures)]
        for down in self.down:
            levels.append(down(levels[-1]))
        return levels

    def forward(self, pictures: torch.Tensor) -> torch.Tensor:
        """Pictures, B x 3 x H x W, sides multiples of 16, to logits, B x classes x H x W."""
        *finer, joint = self.features(pictures)
        for up, level in zip(reversed(self.up), reversed(finer), strict=True):
            wide = functional.interpolate(joint, scale_factor=2.0)
            joint = up(torch.cat([wide, level], 1))
        return _doubled(self.head(joint))


def _doubled(values: torch.Tensor) -> torch.Tensor:
    """Bilinear interpolation to twice the size, B x C x H x W, as two products of matrices.

    ``interpolate`` gives the same and takes twice the time, back and forth on one core.
    """
    height, width = values.shape[2:]
    rows = _doubling(height, values.device, values.dtype)
    columns = _doubling(width, values.device, values.dtype)
    return rows @ (values.contiguous() @ columns.T)


@cache
def _doubling(count: int, device: torch.device, kind: torch.dtype) -> torch.Tensor:
    """Weights of the bilinear interpolation of a row of values to twice as many, 2 N x N."""
    row = torch.eye(count)[None]
    wide = functional.interpolate(row, scale_factor=2.0, mode="linear", align_corners=False)
    return wide[0].T.contiguous().to(kind).to(device)


def _convolution(before: int, after: int, stride: int = 1) -> nn.Sequential:
    return nn.Sequential(
        nn.Conv2d(before, after, 3, stride, 1, bias=False),
        nn.BatchNorm2d(after),
        nn.ReLU(inplace=True),
    )
