import numpy as np

from envgen_usd.chunks import Chunk
from envgen_usd.landuse.plot_index import PlotIndex
from envgen_usd.models.landuse import LanduseClass, Plot


def test_plots_that_touch_a_chunk_are_found_in_their_order():
    draw = np.random.default_rng(0)
    corners = draw.uniform(-300.0, 300.0, (200, 1, 2)) + draw.uniform(-30.0, 30.0, (200, 4, 2))
    corners[0] = [(200.0, 0.0), (230.0, 0.0), (230.0, 40.0), (200.0, 40.0)]  # On a border.
    plots = [Plot(f"{n}", c, LanduseClass.LAWN, c[:2]) for n, c in enumerate(corners)]
    index = PlotIndex(plots)
    for chunk in [Chunk(x, y) for x in range(-3, 3) for y in range(-3, 3)]:
        low, high = np.array(chunk.bounds).reshape(2, 2)
        expected = [
            plot
            for plot in plots
            if (plot.polygon.max(axis=0) >= low).all() and (plot.polygon.min(axis=0) <= high).all()
        ]
        assert [plot.id for plot in index.touching(chunk)] == [plot.id for plot in expected]
    assert PlotIndex([]).touching(Chunk(0, 0)) == ()
