"""Known cells spread over the hole, so that few of them are seen from afar.

A convolution sums over all of its inputs, and a single known cell among thousands barely moves the
sum. Push and pull (Gortler et al. 1996) gives each unknown cell the mean of the known ones in the
smallest square of a pyramid that holds any.
"""

import torch
from torch import Tensor
from torch.nn import functional as F  # noqa: N812 - torch's own convention

_LEAST = 1e-6


def spread(known: Tensor, mask: Tensor) -> tuple[Tensor, Tensor]:
    """Spreads known values over unknown cells.

    Args:
        known: B x C x H x W.
        mask: B x 1 x H x W, 1 where known.

    Returns:
        B x C x H x W, known values where known, else means of the nearest; 0 where nothing is
        known. B x 1 x H x W, level of the pyramid that each comes from: 0 where known.
    """
    return _spread(known * mask, mask, 0)


def _spread(values: Tensor, mask: Tensor, level: int) -> tuple[Tensor, Tensor]:
    height, width = values.shape[2:]
    if height == 1 and width == 1:
        return values, (level + 1.0 - mask) if level else 1.0 - mask
    weights = F.avg_pool2d(mask, 2, ceil_mode=True)
    means = F.avg_pool2d(values, 2, ceil_mode=True) / weights.clamp(min=_LEAST)
    coarse, levels = _spread(means, (weights > 0).to(mask), level + 1)
    size = (height, width)
    below, deeper = (F.interpolate(one, size, mode="nearest") for one in (coarse, levels))
    return torch.where(mask > 0, values, below), torch.where(mask > 0, float(level), deeper)
