"""A distance of image sets in the features of an encoder that is trained here.

The kernel distance of KID (Bińkowski et al. 2018) with another encoder, so its values compare only
within a run: *task KID*, not KID.
"""

import numpy as np
import torch
from torch.nn import functional

from envgen_usd.models.array_types import ByteArray, FloatArray
from envgen_usd.study.known_networks import make_network
from envgen_usd.study.labelled_images import Images
from envgen_usd.study.small_network import SmallNetwork
from envgen_usd.study.study_classes import VOID
from envgen_usd.study.torch_learner import normalised
from envgen_usd.study.training_options import TrainingOptions

_BATCH = 16


def train_encoder(images: Images, options: TrainingOptions) -> SmallNetwork:
    """Trains the small network on labelled images; its encoder gives the features."""
    torch.manual_seed(0)
    network = make_network("small")
    assert isinstance(network, SmallNetwork)
    optimiser = torch.optim.AdamW(network.parameters(), options.rate)
    chance = np.random.default_rng(0)
    for _ in range(options.iterations):
        chosen = chance.choice(len(images), options.batch)
        logits = network(normalised(_tensor(images.pictures[chosen])))
        classes = torch.from_numpy(images.classes[chosen]).long()
        loss = functional.cross_entropy(logits, classes, ignore_index=VOID)
        optimiser.zero_grad(set_to_none=True)
        loss.backward()  # type: ignore[no-untyped-call]
        optimiser.step()
    return network.eval()


def picture_features(network: SmallNetwork, pictures: ByteArray) -> FloatArray:
    """Mean and deviation of the two coarsest levels, N x F."""
    parts = []
    with torch.no_grad():
        for first in range(0, len(pictures), _BATCH):
            levels = network.features(normalised(_tensor(pictures[first : first + _BATCH])))[-2:]
            flat = [level.flatten(2) for level in levels]  # B x C x HW
            parts.append(torch.cat([v for f in flat for v in (f.mean(2), f.std(2))], 1))
    features: FloatArray = torch.cat(parts).double().numpy()
    return features


def kernel_distance(first: FloatArray, second: FloatArray) -> float:
    """Unbiased squared maximum mean discrepancy with the kernel (x · y / F + 1)³.

    Its mean is 0 for two samples of one distribution, so a value can be below 0.

    Args:
        first: N x F, N at least 2.
        second: M x F, M at least 2.
    """
    n, m, size = len(first), len(second), first.shape[1]

    def kernel(a: FloatArray, b: FloatArray) -> FloatArray:
        values: FloatArray = (a @ b.T / size + 1.0) ** 3
        return values

    own, other = kernel(first, first), kernel(second, second)
    within = (own.sum() - own.trace()) / (n * (n - 1))
    within += (other.sum() - other.trace()) / (m * (m - 1))
    return float(within - 2.0 * kernel(first, second).mean())


def scaled(reference: FloatArray, *sets: FloatArray) -> tuple[FloatArray, ...]:
    """Features with the mean and the deviation of a reference taken out."""
    mean, deviation = reference.mean(0), np.maximum(reference.std(0), 1e-6)
    return tuple((each - mean) / deviation for each in sets)


def _tensor(pictures: ByteArray) -> torch.Tensor:
    return torch.from_numpy(np.ascontiguousarray(np.moveaxis(pictures, 3, 1))).float() / 255.0
