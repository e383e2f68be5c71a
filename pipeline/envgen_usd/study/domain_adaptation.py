"""Adapts synthetic pictures to unlabelled real ones."""

import torch

from envgen_usd.study.training_options import ADAPTATIONS

_LOW_BAND = 0.02
"""Half width of the exchanged frequencies, as a share of the sides; a larger value takes more of
the real picture's layout over (Yang and Soatto 2020 use 0.01 to 0.09)."""


def adapted(way: str, pictures: torch.Tensor, real: torch.Tensor) -> torch.Tensor:
    """Gives each picture the colours or the low frequencies of a real one.

    Args:
        way: One of `training_options.ADAPTATIONS`.
        pictures: B x 3 x H x W, 0 to 1.
        real: B x 3 x H x W, 0 to 1, the real picture of each.
    """
    if way == ADAPTATIONS[1]:
        return _colours_moved(pictures, real)
    if way == ADAPTATIONS[2]:
        return _amplitudes_exchanged(pictures, real)
    return pictures


def _colours_moved(pictures: torch.Tensor, real: torch.Tensor) -> torch.Tensor:
    """Mean and covariance of the colours (Reinhard et al. 2001, here with the covariance)."""
    ours, theirs = pictures.flatten(2), real.flatten(2)  # B x 3 x HW
    from_mean, to_mean = ours.mean(2, keepdim=True), theirs.mean(2, keepdim=True)
    whitened = _root(ours - from_mean, -0.5) @ (ours - from_mean)
    moved = _root(theirs - to_mean, 0.5) @ whitened + to_mean
    shown: torch.Tensor = moved.reshape(pictures.shape).clamp(0.0, 1.0)
    return shown


def _root(values: torch.Tensor, power: float) -> torch.Tensor:
    """A power of the covariance of centred colours, B x 3 x N; B x 3 x 3."""
    covariance = values @ values.transpose(1, 2) / values.shape[2]
    covariance = covariance + 1e-5 * torch.eye(3, device=values.device)
    sizes, axes = torch.linalg.eigh(covariance)
    root: torch.Tensor = (
        axes @ torch.diag_embed(sizes.clamp_min(1e-6) ** power) @ axes.transpose(1, 2)
    )
    return root


def _amplitudes_exchanged(pictures: torch.Tensor, real: torch.Tensor) -> torch.Tensor:
    """Low frequencies with the amplitude of the real picture, as FDA (Yang and Soatto 2020)."""
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
