"""What tells one use of the network from another: what goes in and out, and how it is judged."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any, ClassVar, Generic, TypeVar

from numpy.typing import NDArray
from torch import Tensor

from envgen_usd.landuse.network.sample import Sample
from envgen_usd.models.arrays import BoolArray, ByteArray

S = TypeVar("S", bound=Sample)


class Task(ABC, Generic[S]):
    """A kind of map that the network fills the holes of.

    Attributes:
        inputs: Channels of a map that goes in.
        outputs: Channels that come out.
    """

    inputs: ClassVar[int]
    outputs: ClassVar[int]

    @abstractmethod
    def truth(self, windows: Sequence[S]) -> Tensor:
        """True values of the cells of windows of one size, B x H x W."""

    @abstractmethod
    def road(self, window: S) -> BoolArray:
        """The road's cells, H x W; they are always known."""

    @abstractmethod
    def fields(self, windows: Sequence[S]) -> Tensor:
        """What is known everywhere, B x E x H / 2 x W / 2."""

    @abstractmethod
    def encode(self, truth: Tensor) -> Tensor:
        """B x H x W values of cells to the B x `inputs` x H x W that goes in."""

    @abstractmethod
    def decode(self, output: Tensor) -> Tensor:
        """B x `outputs` x H x W that came out to the most likely values, B x H x W."""

    @abstractmethod
    def composite(self, output: Tensor, known: Tensor, mask: Tensor) -> Tensor:
        """The map that goes on: given where known, generated in the hole.

        Args:
            output: B x `outputs` x H x W.
            known: B x `inputs` x H x W.
            mask: B x 1 x H x W, 1 where known.

        Returns:
            B x `inputs` x H x W.
        """

    @abstractmethod
    def loss(self, output: Tensor, truth: Tensor, mask: Tensor, smoothing: float) -> Tensor:
        """Distance to the truth over the hole, one value a sample.

        Args:
            output: B x `outputs` x H x W.
            truth: B x H x W.
            mask: B x 1 x H x W, 1 where known.
            smoothing: Label smoothing, where there are labels.
        """

    @abstractmethod
    def real(self, known: Tensor) -> Tensor:
        """A true map, B x `inputs` x H x W, as the critic is shown it."""

    @abstractmethod
    def picture(self, values: NDArray[Any], known: BoolArray | None = None) -> ByteArray:
        """Values of cells, H x W, as a picture, H x W x 3; a hole has a colour of its own."""
