"""Interface of a network's task: its inputs, outputs and losses."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any, ClassVar, Generic, Literal, TypeVar

from numpy.typing import NDArray
from torch import Tensor

from envgen_usd.landuse.network.data.training_sample import Sample
from envgen_usd.models.array_types import BoolArray, ByteArray

S = TypeVar("S", bound=Sample)
Target = Literal["landuse", "height", "place"]
"""Kinds of maps that a network can learn."""


class Task(ABC, Generic[S]):
    """A kind of map whose holes the network fills.

    Attributes:
        inputs: Number of input channels.
        outputs: Number of output channels.
        given: Number of input channels, the first ones, that are always known and never generated.
    """

    inputs: ClassVar[int]
    outputs: ClassVar[int]
    given: ClassVar[int] = 0

    @abstractmethod
    def truth(self, windows: Sequence[S]) -> Tensor:
        """True values of the cells of windows of equal size, B x H x W."""

    @abstractmethod
    def road(self, window: S) -> BoolArray:
        """Cells of the road, H x W; they are always known."""

    @abstractmethod
    def fields(self, windows: Sequence[S]) -> Tensor:
        """Fields known everywhere, B x E x H / 2 x W / 2."""

    @abstractmethod
    def encode(self, truth: Tensor) -> Tensor:
        """Encodes B x H x W cell values as the input, B x `inputs` x H x W."""

    @abstractmethod
    def decode(self, output: Tensor) -> Tensor:
        """Decodes the output, B x `outputs` x H x W, to the most likely values, B x H x W."""

    @abstractmethod
    def composite(self, output: Tensor, known: Tensor, mask: Tensor) -> Tensor:
        """The composite map: given in known cells, generated in the hole.

        Args:
            output: B x `outputs` x H x W.
            known: B x `inputs` x H x W.
            mask: B x 1 x H x W, 1 where known.

        Returns:
            B x `inputs` x H x W.
        """

    @abstractmethod
    def loss(self, output: Tensor, truth: Tensor, mask: Tensor, smoothing: float) -> Tensor:
        """Distance to the truth over the hole, a value per sample.

        Args:
            output: B x `outputs` x H x W.
            truth: B x H x W.
            mask: B x 1 x H x W, 1 where known.
            smoothing: Label smoothing, for class maps.
        """

    @abstractmethod
    def real(self, known: Tensor) -> Tensor:
        """A real map, B x `inputs` x H x W, as input of the critic."""

    @abstractmethod
    def picture(self, values: NDArray[Any], known: BoolArray | None = None) -> ByteArray:
        """Cell values, H x W, as an image, H x W x 3; a hole has a separate colour."""
