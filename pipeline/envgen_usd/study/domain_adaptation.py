"""Adapts synthetic pictures to unlabelled real ones."""

from dataclasses import dataclass

import torch

_LOW_BAND = 0.02
"""Half width of the exchanged frequencies, as a share of the sides; a larger value takes more of
the real picture's layout over (Yang and Soatto 2020 use 0.01 to 0.09)."""
_AT_ONCE = 32
"""Pictures whose colours are found at once; a larger value takes more memory."""


@dataclass(frozen=True, eq=False)
class Colours:
    """Mean and covariance of the colours of pictures.

    Attributes:
        mean: N x 3 x 1, from 0 to 1.
        root: N x 3 x 3, root of the covariance.
        inverse: N x 3 x 3, inverse of the root.
    """

    mean: torch.Tensor
    root: torch.Tensor
    inverse: torch.Tensor

    def chosen(self, indices: torch.Tensor) -> "Colours":
        """Those of some pictures."""
        parts = (part.index_select(0, indices) for part in (self.mean, self.root, self.inverse))
        return Colours(*parts)


def colours_of(pictures: torch.Tensor) -> Colours:
    """The colours of each picture, N x 3 x H x W, 0 to 255."""
    parts = [_mean_and_covariance(part) for part in torch.split(pictures, _AT_ONCE)]
    mean, covariance = (torch.cat(each) for each in zip(*parts, strict=True))
    # Of 3 x 3 values, which a GPU takes longer for, and not without being waited for.
    sizes, axes = torch.linalg.eigh(covariance.cpu())
    roots = [
        axes @ torch.diag_embed(sizes.clamp_min(1e-6) ** power) @ axes.transpose(1, 2)
        for power in (0.5, -0.5)
    ]
    return Colours(mean, *(root.to(pictures.device) for root in roots))


def with_colours(pictures: torch.Tensor, own: Colours, other: Colours) -> torch.Tensor:
    """Gives each picture the mean and the covariance of other colours.

    After Reinhard et al. 2001, here with the covariance.

    Args:
        pictures: B x 3 x H x W, 0 to 1.
        own: Their colours.
        other: The colours that each gets.
    """
    moved = (other.root @ own.inverse) @ (pictures.flatten(2) - own.mean) + other.mean
    shown: torch.Tensor = moved.reshape(pictures.shape).clamp(0.0, 1.0)
    return shown


def _mean_and_covariance(pictures: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
    values = pictures.flatten(2).float() / 255.0  # N x 3 x HW
    mean = values.mean(2, keepdim=True)
    centred = values - mean
    covariance = centred @ centred.transpose(1, 2) / values.shape[2]
    return mean, covariance + 1e-5 * torch.eye(3, device=values.device)


def with_amplitudes(pictures: torch.Tensor, real: torch.Tensor) -> torch.Tensor:
    """Gives low frequencies the amplitude of a real picture: FDA of Yang and Soatto 2020.

    Args:
        pictures: B x 3 x H x W, 0 to 1.
        real: The same of the real picture of each.
    """
    ours = torch.fft.fftshift(torch.fft.fft2(pictures), dim=(2, 3))
    theirs = torch.fft.fftshift(torch.fft.fft2(real), dim=(2, 3))
    height, width = pictures.shape[2:]
    half = max(int(min(height, width) * _LOW_BAND), 1)
    rows = slice(height // 2 - half, height // 2 + half + 1)
    columns = slice(width // 2 - half, width // 2 + half + 1)
    amplitude = ours.abs()
    amplitude[:, :, rows, columns] = theirs.abs()[:, :, rows, columns]
    mixed = torch.polar(amplitude, ours.angle())
    turned = torch.fft.ifft2(torch.fft.ifftshift(mixed, dim=(2, 3)))
    shown: torch.Tensor = turned.real.clamp(0.0, 1.0)
    return shown
