"""Refuses outputs of a network that are no numbers."""

import torch
from torch import Tensor

from envgen_usd.errors import EnvgenError


def finite(output: Tensor) -> Tensor:
    """Returns a network's output unchanged.

    Weights within their bound may still overflow on their way through many layers.

    Raises:
        EnvgenError: The output holds values that are not finite.
    """
    # No copy: the ends are NaN where any value is.
    if not torch.isfinite(torch.stack(torch.aminmax(output))).all():
        raise EnvgenError(
            "the network's weights are too large: its output is not finite; train the network "
            "again, or name other weights"
        )
    return output
