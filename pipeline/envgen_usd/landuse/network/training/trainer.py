"""Training step by step, with a state that can be saved and restored."""

import copy
from collections.abc import Sequence
from dataclasses import dataclass, field

import torch
from torch import Tensor, nn

from envgen_usd.landuse.network.data.training_sample import Sample
from envgen_usd.landuse.network.model.compute_precision import computes_in_half
from envgen_usd.landuse.network.model.critic import Critic
from envgen_usd.landuse.network.model.forward_draws import Draws
from envgen_usd.landuse.network.model.generator import make_generator
from envgen_usd.landuse.network.model.network_config import NetworkConfig, TrainConfig
from envgen_usd.landuse.network.tasks.known_tasks import task_of
from envgen_usd.landuse.network.training.adversarial_losses import (
    critic_score,
    generator_score,
    gradient_penalty,
)
from envgen_usd.landuse.network.training.training_batches import Batch, training_batch

Losses = dict[str, float]


@dataclass(frozen=True)
class TrainState:
    """State of a training run.

    Attributes:
        step: Number of finished steps.
        generator: Weights of the generator.
        average: Moving average of the weights, which is the final result.
        critic: Weights of the critic.
        generator_optimizer: Adam state of the generator.
        critic_optimizer: Adam state of the critic.
        losses: Step, name and value of each loss so far, for the curves.
    """

    step: int
    generator: dict[str, Tensor]
    average: dict[str, Tensor]
    critic: dict[str, Tensor]
    generator_optimizer: dict[str, object]
    critic_optimizer: dict[str, object]
    losses: list[tuple[int, str, float]] = field(default_factory=list)


class Trainer:
    """Trains a generator against truth and critic.

    Every draw depends on the step and the seed alone. A resumed run therefore ends with the weights
    of an uninterrupted run (on the same machine).
    """

    def __init__(self, network: NetworkConfig, config: TrainConfig, device: torch.device) -> None:
        """Args: layer sizes, hyperparameters of the training, compute device."""
        torch.manual_seed(config.seed)
        self.config, self.device, self.step = config, device, 0
        self.task = task_of(network.target)
        self.generator = make_generator(network).to(device)
        self.critic = Critic(network).to(device)
        for network_part in (self.generator, self.critic):
            use_fast_layout(network_part)
        self.average = copy.deepcopy(self.generator).requires_grad_(False)
        betas = (config.beta1, 0.99)
        self._generator_adam = torch.optim.Adam(self.generator.parameters(), config.rate, betas)
        self._critic_adam = torch.optim.Adam(
            self.critic.parameters(), config.critic_rate, (0.0, 0.99)
        )

    @property
    def steps(self) -> int:
        """Number of steps of the whole run."""
        return self.config.images // self.config.batch

    def advance(self, samples: Sequence[Sample]) -> Losses:
        """Runs a step and returns its losses by name."""
        config = self.config
        drawn = training_batch(self.task, samples, self.step, self._windows(), config)
        batch = drawn.to(self.device)
        for group in self._generator_adam.param_groups:
            group["lr"] = config.rate * rate_share(self.step / self.steps, config.decay_from)
        adversarial = config.adversarial and self.step >= config.adversarial_from * self.steps
        losses, fake = self._train_generator(batch, bool(adversarial))
        if adversarial:
            losses |= self._train_critic(batch, fake)
        decay = 0.5 ** (config.batch / config.ema_half_life)
        update_average(self.average, self.generator, decay)
        self.step += 1
        return losses

    def state(self) -> TrainState:
        """Returns the state for `load`."""
        return TrainState(
            self.step,
            self.generator.state_dict(),
            self.average.state_dict(),
            self.critic.state_dict(),
            self._generator_adam.state_dict(),
            self._critic_adam.state_dict(),
        )

    def load(self, state: TrainState) -> None:
        """Restores a saved state."""
        self.step = state.step
        self.generator.load_state_dict(state.generator)
        self.average.load_state_dict(state.average)
        self.critic.load_state_dict(state.critic)
        self._generator_adam.load_state_dict(state.generator_optimizer)
        self._critic_adam.load_state_dict(state.critic_optimizer)

    def _windows(self) -> tuple[int, int]:
        """Side and number of this step's windows."""
        if self.step < self.config.small * self.steps:
            return self.config.size // 2, 2 * self.config.batch
        return self.config.size, self.config.batch

    def _train_generator(self, batch: Batch, adversarial: bool) -> tuple[Losses, Tensor]:
        config = self.config
        with self._precision():
            fine, coarse = self._best_draw(batch)
        second = self._loss(fine, batch).mean()
        first = second if coarse is fine else self._loss(coarse, batch).mean()
        loss = second + config.first_stage * first
        losses = {"second": float(second.detach()), "first": float(first.detach())}
        fake = fine
        if adversarial:  # a critic alone needs the composite
            fake = self.task.composite(fine, self.task.real(batch.known), batch.mask)
            self.critic.requires_grad_(False)
            score = generator_score(self.critic(fake, batch.mask, batch.condition))
            self.critic.requires_grad_(True)
            loss = loss + config.adversarial * score
            losses["adversarial"] = float(score.detach())
        self._generator_adam.zero_grad()
        loss.backward()  # type: ignore[no-untyped-call]
        nn.utils.clip_grad_norm_(self.generator.parameters(), 10.0)
        self._generator_adam.step()
        return losses, fake.detach()

    def _best_draw(self, batch: Batch) -> tuple[Tensor, Tensor]:
        """Outputs of both stages for the draw that is nearest to the truth, sample by sample."""
        config, count = self.config, len(batch.truth)
        first = (self.step * count) * config.draws
        seeds = [[first + count * k + n for n in range(count)] for k in range(config.draws)]
        best = torch.zeros(count, dtype=torch.int64)
        if config.draws > 1:
            with torch.no_grad():
                best = torch.stack([self._draw_loss(batch, row) for row in seeds]).argmin(0).cpu()
        chosen = [config.seed * 2**32 + seeds[k][n] for n, k in enumerate(best.tolist())]
        fine, coarse = self._run(batch, chosen)
        return fine, coarse

    def _draw_loss(self, batch: Batch, seeds: Sequence[int]) -> Tensor:
        seeds = [self.config.seed * 2**32 + seed for seed in seeds]
        return self._loss(self._run(batch, seeds)[0], batch)

    def _loss(self, output: Tensor, batch: Batch) -> Tensor:
        return self.task.loss(output, batch.truth, batch.mask, self.config.smoothing)

    def _run(self, batch: Batch, seeds: Sequence[int]) -> tuple[Tensor, Tensor]:
        fine, coarse = self.generator(
            batch.known, batch.mask, batch.fields, batch.condition, Draws(seeds)
        )
        return fine, coarse

    def _train_critic(self, batch: Batch, fake: Tensor) -> Losses:
        real = self.task.real(batch.known)
        loss = critic_score(
            self.critic(real, batch.mask, batch.condition),
            self.critic(fake, batch.mask, batch.condition),
        )
        value = float(loss.detach())
        if self.step % self.config.r1_every == 0:
            penalty = gradient_penalty(self.critic, real, batch.mask, batch.condition)
            loss = loss + self.config.r1 / 2 * self.config.r1_every * penalty
        self._critic_adam.zero_grad()
        loss.backward()  # type: ignore[no-untyped-call]
        self._critic_adam.step()
        return {"critic": value}

    def _precision(self) -> torch.autocast:
        return torch.autocast(
            self.device.type, torch.bfloat16, enabled=computes_in_half(self.device)
        )


def use_fast_layout(network: nn.Module) -> None:
    """Stores kernels with channels last, which is a quarter faster on CPUs."""
    for weight in network.parameters():
        if weight.ndim == 4:
            weight.data = weight.data.contiguous(memory_format=torch.channels_last)


def rate_share(progress: float, decay_from: float) -> float:
    """Factor of the learning rate: a short warm-up, then full, then a linear decay to 2 %."""
    rise = min(1.0, 0.1 + progress / 0.01)
    fall = max(0.0, progress - decay_from) / (1 - decay_from)
    return rise * (1.0 - 0.98 * fall)


@torch.no_grad()
def update_average(average: nn.Module, network: nn.Module, decay: float) -> None:
    """Moves the averaged weights towards the network's."""
    for kept, new in zip(average.parameters(), network.parameters(), strict=True):
        kept.lerp_(new, 1 - decay)
