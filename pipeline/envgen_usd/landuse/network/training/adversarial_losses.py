"""Adversarial losses of the generator and of the critic."""

import torch
from torch import Tensor, nn
from torch.nn import functional as F  # noqa: N812 - torch's own convention


def generator_score(scores: Tensor) -> Tensor:
    """Non-saturating loss of the generator (Goodfellow et al. 2014)."""
    return F.softplus(-scores).mean()


def critic_score(real: Tensor, fake: Tensor) -> Tensor:
    """Logistic loss of the critic."""
    return F.softplus(-real).mean() + F.softplus(fake).mean()


def gradient_penalty(critic: nn.Module, real: Tensor, mask: Tensor, condition: Tensor) -> Tensor:
    """R1: mean squared gradient of the scores of real maps (Mescheder et al. 2018)."""
    real = real.detach().requires_grad_(True)
    scores = critic(real, mask, condition)
    (gradient,) = torch.autograd.grad(scores.sum(), real, create_graph=True)
    return gradient.square().sum((1, 2, 3)).mean()
