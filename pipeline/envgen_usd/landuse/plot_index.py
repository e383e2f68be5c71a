"""The plots of a map by place."""

from collections.abc import Sequence

import numpy as np

from envgen_usd.chunks import Chunk
from envgen_usd.geometry.square_index import SquareIndex
from envgen_usd.models.landuse import Plot


class PlotIndex:
    """Plots, sorted once so that a chunk looks at no others than those near it."""

    def __init__(self, plots: Sequence[Plot]) -> None:
        """Takes the plots of a map."""
        self._plots = plots
        boxes = [(plot.polygon.min(axis=0), plot.polygon.max(axis=0)) for plot in plots]
        self._low, self._high = np.array(boxes).reshape(-1, 2, 2).transpose(1, 0, 2)
        self._index = SquareIndex.of(self._low, self._high)

    def touching(self, chunk: Chunk) -> tuple[Plot, ...]:
        """Returns the plots whose bounding boxes touch a chunk, in the order of the map's."""
        rows = self._index.near(chunk.bounds, 0.0)
        touch = (self._low[rows] <= chunk.bounds[2:]) & (self._high[rows] >= chunk.bounds[:2])
        return tuple(self._plots[row] for row in rows[touch.all(axis=1)].tolist())
