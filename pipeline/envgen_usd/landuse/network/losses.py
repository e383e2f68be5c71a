"""Losses of the generator and of the critic."""

import torch
from torch import Tensor
from torch.nn import functional as F  # noqa: N812 - torch's own convention

from envgen_usd.landuse.network.critic import Critic


def hole_loss(logits: Tensor, channels: Tensor, mask: Tensor, smoothing: float) -> Tensor:
    """Cross-entropy with label smoothing over the hole, one value a sample.

    Args:
        logits: B x `OUTPUTS` x H x W.
        channels: B x H x W, true channels; the road is known and does not count.
        mask: B x 1 x H x W, 1 where known.
        smoothing: Share of the probability that goes to all classes alike.
    """
    target = (channels - 1).clamp(min=0)
    each = F.cross_entropy(logits.float(), target, reduction="none", label_smoothing=smoothing)
    hole = 1 - mask[:, 0]
    return (each * hole).sum((1, 2)) / hole.sum((1, 2)).clamp(min=1)


def smoothed(image: Tensor, smoothing: float = 0.1) -> Tensor:
    """Softens a real one-hot map (B x C x H x W), so that softness alone does not give it away."""
    return image * (1 - smoothing) + smoothing / image.shape[1]


def generator_score(scores: Tensor) -> Tensor:
    """Non-saturating loss of the generator (Goodfellow et al. 2014)."""
    return F.softplus(-scores).mean()


def critic_score(real: Tensor, fake: Tensor) -> Tensor:
    """Logistic loss of the critic."""
    return F.softplus(-real).mean() + F.softplus(fake).mean()


def gradient_penalty(critic: Critic, real: Tensor, mask: Tensor, condition: Tensor) -> Tensor:
    """R1: mean squared gradient of the scores of real maps (Mescheder et al. 2018)."""
    real = real.detach().requires_grad_(True)
    scores = critic(real, mask, condition)
    (gradient,) = torch.autograd.grad(scores.sum(), real, create_graph=True)
    return gradient.square().sum((1, 2, 3)).mean()
