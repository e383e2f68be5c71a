"""What a study asks of a network: learn from images, then predict classes."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from envgen_usd.models.array_types import ByteArray
from envgen_usd.study.labelled_images import Images

Predictor = Callable[[ByteArray, tuple[int, int]], ByteArray]
"""Called with pictures, N x H x W x 3, and the height and width wanted; classes, N x h x w."""
Watcher = Callable[[int, float, Predictor], None]
"""Called now and then with the step, the mean loss since the last call, and the present state."""


@dataclass(frozen=True, eq=False)
class Lesson:
    """What a network learns from.

    Attributes:
        real: Real images; may be none.
        synthetic: Synthetic images; may be none.
        unlabelled: Real pictures whose labels are not known, N x H x W x 3; may be none.
        seed: Seed of first weights, batches and augmentation.
        augmented: Light and framing are augmented as the options say.
        steps: Steps of the optimiser.
    """

    real: Images
    synthetic: Images
    unlabelled: ByteArray
    seed: int
    augmented: bool
    steps: int


class Learner(Protocol):
    """A network with its way of training."""

    def learn(self, lesson: Lesson, watch: Watcher) -> Predictor:
        """Trains from the start and returns the trained network.

        Raises:
            EnvgenError: The training failed.
        """
        ...
