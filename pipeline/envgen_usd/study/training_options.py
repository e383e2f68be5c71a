"""How networks are trained: the same in every arm of a study."""

from dataclasses import dataclass, field

from envgen_usd.errors import EnvgenError
from envgen_usd.idle_options import refuse_idle
from envgen_usd.study.picture_augmentation import Augmentation

WEIGHTS = ("none", "root", "inverse")
"""Weights of the classes in the loss: equal, the inverse root of their share, its inverse."""
ADAPTATIONS = ("none", "colour", "fourier")
"""How synthetic pictures are adapted to unlabelled real ones."""
SCHEDULES = ("joint", "finetune")
"""Synthetic and real images together, or first synthetic and then real ones."""
BATCHES = ("even", "proportional")
"""Half of each batch is synthetic where both kinds are there, or each image counts the same."""
NORMS = ("domain", "joint")
"""Batch norm of the synthetic and the real half of a batch apart, or of all together."""


@dataclass(frozen=True)
class TrainingOptions:
    """What a training follows from besides its images.

    Attributes:
        network: ``small``, ``yolov8n``, ``torchvision:NAME`` or ``smp:NAME:ENCODER``.
        weights: File of first weights; empty: random.
        iterations: Steps of the optimiser, the same in all arms; a larger value learns more.
        epochs: Passes over the images instead of `iterations`, as in the article; 0: none.
        batch: Images of a step.
        width: Width of training pictures, pixels.
        height: Height, pixels.
        rate: Largest learning rate.
        augmentation: What is changed in training pictures.
        class_weights: One of `WEIGHTS`.
        balanced: Draw images with rare classes more often.
        batches: One of `BATCHES`.
        batch_norm: One of `NORMS`; other than even batches are normed together.
        adaptation: One of `ADAPTATIONS`.
        unlabelled: Number of real pictures, without labels, that the adaptation sees; 0: all.
        schedule: One of `SCHEDULES`.
    """

    network: str = "small"
    weights: str = ""
    iterations: int = 600
    epochs: int = 0
    batch: int = 8
    width: int = 240
    height: int = 176
    rate: float = 3e-3
    augmentation: Augmentation = field(default_factory=lambda: Augmentation(light=True))
    class_weights: str = "none"
    balanced: bool = False
    batches: str = "even"
    batch_norm: str = "domain"
    adaptation: str = "none"
    unlabelled: int = 0
    schedule: str = "joint"

    def __post_init__(self) -> None:
        """Checks the names and the size.

        Raises:
            EnvgenError: A name is unknown, a side is no multiple of 16, or a value has no effect
                beside the others.
        """
        for option, value, known in (
            ("--class-weights", self.class_weights, WEIGHTS),
            ("--adapt", self.adaptation, ADAPTATIONS),
            ("--schedule", self.schedule, SCHEDULES),
            ("--batches", self.batches, BATCHES),
            ("--batch-norm", self.batch_norm, NORMS),
        ):
            if value not in known:
                raise EnvgenError(f"{option} {value}: unknown; choose from {', '.join(known)}")
        if self.width % 16 or self.height % 16 or min(self.width, self.height) < 32:
            raise EnvgenError(
                f"--resolution {self.width}x{self.height}: sides are multiples of 16, from 32"
            )
        if self.epochs:
            given = {"--iterations": self.iterations != TrainingOptions.iterations}
            refuse_idle(given, f"with --epochs {self.epochs}")
        if self.adaptation == "none":
            refuse_idle({"--unlabelled": self.unlabelled}, "without --adapt colour or fourier")

    @property
    def size(self) -> tuple[int, int]:
        """Width and height, pixels."""
        return self.width, self.height

    def steps(self, images: int) -> int:
        """Steps of the optimiser for a number of images."""
        return max(self.epochs * images // self.batch, 1) if self.epochs else self.iterations
