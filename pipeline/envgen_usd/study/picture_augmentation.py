"""Other light, sky and framing for training pictures; the same for real and synthetic ones."""

from collections.abc import Callable
from dataclasses import dataclass

import torch
from torch.nn import functional

from envgen_usd.study.study_classes import CLASSES, VOID

_SKY = CLASSES.index("sky")
_SKY_SHARE = 0.7
"""Share of the pictures that get another sky."""
_BLUR_SHARE = 0.3
"""Share of the pictures that are blurred."""


@dataclass(frozen=True)
class Augmentation:
    """What is changed in each training picture.

    Attributes:
        flip: Mirror half of the pictures.
        light: Another sky, exposure, white balance, saturation, tone curve, haze, noise and blur.
        framing: Another scale (0.7 to 1.6) and cut-out.
    """

    flip: bool = True
    light: bool = False
    framing: bool = False


def augmented(
    pictures: torch.Tensor, classes: torch.Tensor, choice: Augmentation, draws: torch.Generator
) -> tuple[torch.Tensor, torch.Tensor]:
    """Changes a batch.

    Args:
        pictures: B x 3 x H x W, sRGB, 0 to 1.
        classes: B x H x W.
        choice: What is changed.
        draws: Random numbers of the pictures' device.
    """
    if choice.light:
        pictures = _relit(pictures, classes, draws)
    if choice.framing:
        pictures, classes = _reframed(pictures, classes, draws)
    if choice.flip:
        turned = _random((len(pictures),), draws) < 0.5
        pictures = _changed_where(turned, pictures, lambda values: values.flip(3))
        classes = _changed_where(turned, classes, lambda values: values.flip(2))
    return pictures, classes


def linear_light(values: torch.Tensor) -> torch.Tensor:
    """Encoded sRGB (IEC 61966-2-1) to linear light, both 0 to 1."""
    high = _power((values + 0.055) / 1.055, 2.4)
    return torch.where(values <= 0.04045, values / 12.92, high)


def encoded_light(values: torch.Tensor) -> torch.Tensor:
    """Linear light, cut to 0 to 1, to encoded sRGB."""
    values = values.clamp(0.0, 1.0)
    high = 1.055 * _power(values.clamp_min(1e-6), 1.0 / 2.4) - 0.055
    return torch.where(values <= 0.0031308, values * 12.92, high)


def _power(values: torch.Tensor, power: float | torch.Tensor) -> torch.Tensor:
    """A power of positive values; a third of the time of ``pow`` on the CPU."""
    return torch.exp(torch.log(values) * power)


def _random(shape: tuple[int, ...], draws: torch.Generator) -> torch.Tensor:
    return torch.rand(shape, generator=draws, device=draws.device)


def _normal(shape: tuple[int, ...], draws: torch.Generator) -> torch.Tensor:
    return torch.randn(shape, generator=draws, device=draws.device)


def _changed_where(
    chosen: torch.Tensor, values: torch.Tensor, change: Callable[[torch.Tensor], torch.Tensor]
) -> torch.Tensor:
    """Changes those of B values that are chosen.

    The CPU saves the others; a GPU changes all, as asking it which are chosen would stop it.
    """
    if values.device.type == "cpu":
        indices = chosen.nonzero()[:, 0]
        return values.index_copy(0, indices, change(values[indices]))
    wide = chosen.reshape(-1, *[1] * (values.dim() - 1))
    return torch.where(wide, change(values), values)


def _relit(pictures: torch.Tensor, classes: torch.Tensor, draws: torch.Generator) -> torch.Tensor:
    count = len(pictures)

    def uniform(low: float, high: float) -> torch.Tensor:
        return _random((count, 1, 1, 1), draws) * (high - low) + low

    def normal(deviation: float, width: int = 1) -> torch.Tensor:
        return _normal((count, width, 1, 1), draws) * deviation

    light = linear_light(pictures)
    swapped = (classes == _SKY)[:, None] & (uniform(0.0, 1.0) < _SKY_SHARE)
    light = torch.where(swapped, _skies(pictures.shape, draws), light)
    light = light * torch.exp(normal(0.55) - 0.5) * (1.0 + normal(0.07, 3)) + uniform(0.0, 0.03)
    grey = light.mean(1, keepdim=True)
    light = grey + (light - grey) * uniform(0.2, 1.2)
    values = _power(encoded_light(light).clamp_min(1e-4), torch.exp(normal(0.15)))
    values = _changed_where(_random((count,), draws) < _BLUR_SHARE, values, _blurred)
    noise = _normal(tuple(pictures.shape), draws)
    return (values + noise * uniform(0.0, 0.03)).clamp(0.0, 1.0)


def _blurred(values: torch.Tensor) -> torch.Tensor:
    """Means of 3 x 3 pixels; ``avg_pool2d`` takes three times as long on the CPU."""
    wide = functional.pad(values, (1, 1, 1, 1), "replicate")
    rows = wide[..., :-2] + wide[..., 1:-1] + wide[..., 2:]
    return (rows[..., :-2, :] + rows[..., 1:-1, :] + rows[..., 2:, :]) / 9.0


def _skies(shape: torch.Size, draws: torch.Generator) -> torch.Tensor:
    """Skies in linear light, B x 3 x H x W: a gradient, a tint, and clouds of three scales."""
    count, _, height, width = shape
    ends = _random((count, 2, 1, 1), draws) * 2.5 + 0.15
    down = torch.linspace(0.0, 1.0, height, device=draws.device)[None, None, :, None]
    glow = ends[:, :1] * (1.0 - down) + ends[:, 1:] * down
    tint = 1.0 + _normal((count, 3, 1, 1), draws) * 0.07
    clouds = torch.zeros((count, 1, height, width), device=draws.device)
    for cells in (3, 7, 15):
        noise = _normal((count, 1, cells, cells), draws)
        wide = functional.interpolate(noise, (height, width), mode="bilinear", align_corners=True)
        clouds += wide * 3.0 / cells
    depth = _random((count, 1, 1, 1), draws) * 0.4
    return (glow * tint * (1.0 + depth * clouds)).clamp_min(0.0)


def _reframed(
    pictures: torch.Tensor, classes: torch.Tensor, draws: torch.Generator
) -> tuple[torch.Tensor, torch.Tensor]:
    """Another scale and place of the cut-out; what lies outside the picture is void."""
    count = len(pictures)
    zoom = torch.exp(_random((count,), draws) * 0.83 - 0.36)
    room = (1.0 - 1.0 / zoom).abs()[:, None]
    shift = (_random((count, 2), draws) * 2.0 - 1.0) * room
    steps = torch.zeros((count, 2, 3), device=draws.device)
    steps[:, 0, 0] = steps[:, 1, 1] = 1.0 / zoom
    steps[:, :, 2] = shift
    grid = functional.affine_grid(steps, list(pictures.shape), align_corners=False)
    moved = functional.grid_sample(pictures, grid, padding_mode="reflection", align_corners=False)
    # One above the class, so that outside (0) differs from the first class.
    numbers = (classes.float() + 1.0)[:, None]
    labels = functional.grid_sample(numbers, grid, mode="nearest", align_corners=False)
    labels = labels[:, 0].round().long() - 1
    return moved, torch.where(labels < 0, VOID, labels)
