"""Sizes of the network, and hyperparameters of its training."""

from dataclasses import dataclass
from typing import Annotated, Literal, TypeAlias

from msgspec import Meta

from envgen_usd.landuse.network.tasks.network_task import Target

Network = Literal["mat", "unet"]
DIFFUSION_PASSES = 8
"""Passes of masked diffusion; a larger value takes longer, and samples fewer cells at once."""
Layers: TypeAlias = Annotated[int, Meta(ge=0, le=64)]
"""A number of layers; files of weights beyond it are refused."""
Passes: TypeAlias = Annotated[int, Meta(ge=1, le=1000)]
Levels: TypeAlias = Annotated[tuple[int, ...], Meta(max_length=16)]


@dataclass(frozen=True)
class NetworkConfig:
    """Sizes of the mask-aware transformer and of its critic.

    Attributes:
        fields: Channels of the fields.
        condition: Length of the condition.
        unshuffle: Cells per side that share a position of the network's finest grid.
        head: Channels of the convolutional head, finest first; each level halves the grid.
        dim: Channels of a token.
        heads: Attention heads.
        window: Largest side of an attention window, tokens.
        depths: Transformer blocks in each of the five groups.
        style: Width of the style.
        mapping: Fully connected layers of the mapping network.
        refine: Channels of the second stage, finest first.
        critic: Channels of the critic, finest first.
        output_gain: Scale of the logits at the start of training.
        mask_aware: True if convolutions and attention separate known cells from holes (ablation).
        styled: True if style is mixed into features and modulates the decoders (ablation).
        streets: True if the fields hold streets; training rasters have no streets.
        kind: ``mat``, or ``unet`` for the baseline without stages, mask or style.
        target: Content of the maps: ``landuse`` classes of the rules, ``height``, or ``place``:
            classes and buildings of real places.
        passes: Number of passes to fill a hole. Several passes mean masked diffusion (Austin et al.
            2021, absorbing state; Chang et al. 2022): a few cells are sampled first, and the next
            pass sees them. Such a network needs no requested plots.
    """

    fields: int
    condition: int
    unshuffle: int = 2
    head: Levels = (32, 48, 64)
    dim: int = 64
    heads: int = 4
    window: int = 8
    depths: tuple[Layers, Layers, Layers, Layers, Layers] = (1, 2, 2, 2, 1)
    style: int = 64
    mapping: Layers = 4
    refine: Levels = (32, 48, 64, 96)
    critic: Levels = (32, 48, 64, 96, 96, 96)
    output_gain: float = 0.1
    mask_aware: bool = True
    styled: bool = True
    streets: bool = True
    kind: Network = "mat"
    target: Target = "landuse"
    passes: Passes = 1


@dataclass(frozen=True)
class TrainConfig:
    """Hyperparameters of the training.

    Attributes:
        images: Number of training windows; two of half the size count as one.
        batch: Windows per step.
        size: Side length of a training window, cells; a multiple of 64.
        small: Share of the steps, from the start, with twice as many windows of half the size.
            These steps are faster, and details need no more context.
        rate: Adam's learning rate of the generator (equalised, so larger than usual).
        beta1: Adam's first decay.
        decay_from: Share of the images after which the rate falls linearly to 2 %.
        smoothing: Label smoothing.
        first_stage: Weight of the first stage's cross-entropy; the second stage's is 1.
        draws: Style draws per window, of which the best is trained (minimum over N, Theis et al.);
            it keeps the network from ignoring the style.
        adversarial: Weight of the adversarial loss; 0 trains without a critic.
        adversarial_from: Share of the images after which the critic joins.
        critic_rate: Adam's learning rate of the critic.
        r1: Weight of the gradient penalty.
        r1_every: Steps between gradient penalties.
        ema_half_life: Images after which a weight counts half in the moving average.
        scattered: Probability that a mask has scattered known cells too, as between passes.
        seed: Seed of weights, data order, masks and draws.
    """

    images: int = 28000
    batch: int = 4
    size: int = 256
    small: float = 0.44
    rate: float = 2e-2
    beta1: float = 0.9
    decay_from: float = 0.6
    smoothing: float = 0.02
    first_stage: float = 0.5
    draws: int = 1
    adversarial: float = 0.0
    adversarial_from: float = 0.7
    critic_rate: float = 3e-4
    r1: float = 1.0
    r1_every: int = 8
    ema_half_life: float = 600.0
    scattered: float = 0.3
    seed: int = 0


def small(fields: int, condition: int) -> NetworkConfig:
    """About two million weights; two processor cores train them within two hours."""
    return NetworkConfig(fields, condition)


def diffusion(fields: int, condition: int) -> NetworkConfig:
    """Masked diffusion by a plain U-Net, which samples unknown conditions cell by cell."""
    return NetworkConfig(
        fields, condition, kind="unet", refine=(32, 64, 96, 128, 128), passes=DIFFUSION_PASSES
    )


def article(fields: int, condition: int) -> NetworkConfig:
    """Widths of the original transformer at 256 x 256, for a GPU."""
    return NetworkConfig(
        fields,
        condition,
        unshuffle=1,
        head=(180, 180, 180),
        dim=180,
        heads=6,
        window=16,
        depths=(2, 3, 4, 3, 2),
        style=512,
        mapping=8,
        refine=(64, 128, 256, 512, 512),
        critic=(45, 90, 180, 360, 360, 360, 360),
    )
