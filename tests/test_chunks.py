import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from envgen_usd.chunks import (
    CHUNK_SIZE,
    HEIGHT_SAMPLES,
    Chunk,
    chunk_at,
    chunks_of_points,
    snap,
    tiles_of,
    without_holes,
)


@given(st.integers(-30000, 30000), st.integers(-30000, 30000))
def test_neighbours_share_their_border_samples_exactly(x: int, y: int) -> None:
    left, right, above = Chunk(x, y), Chunk(x + 1, y), Chunk(x, y + 1)
    assert left.corner_axes()[0][-1] == right.corner_axes()[0][0] == (x + 1) * CHUNK_SIZE
    assert left.corner_axes()[1][-1] == above.corner_axes()[1][0] == (y + 1) * CHUNK_SIZE
    np.testing.assert_array_equal(left.corner_axes()[1], right.corner_axes()[1])


def test_corners_are_even_and_increasing() -> None:
    steps = np.diff(Chunk(-1, 7).corner_axes()[0])
    assert len(steps) == HEIGHT_SAMPLES - 1
    np.testing.assert_allclose(steps, 200 / 255, atol=1.1e-3)


@given(st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=50))
def test_snapping_is_to_the_millimetre_and_happens_once(values: list[float]) -> None:
    once = snap(np.array(values))
    assert np.abs(once - values).max() <= 0.5e-3 + 1e-9
    np.testing.assert_array_equal(snap(once), once)
    np.testing.assert_array_equal([float(f"{value:.3f}") for value in once], once)


@given(
    st.lists(st.tuples(st.floats(-2e3, 2e3), st.floats(-2e3, 2e3)), min_size=1, max_size=20),
    st.floats(0, CHUNK_SIZE),
)
def test_chunks_of_points_hold_every_point_with_its_margin(
    points: list[tuple[float, float]], margin: float
) -> None:
    chunks = chunks_of_points(np.array(points), margin)
    assert list(chunks) == sorted(set(chunks))
    for x, y in points:
        for dx, dy in ((0, 0), (margin, 0), (-margin, 0), (0, margin), (0, -margin)):
            place = np.array([x + dx, y + dy])
            bounds = np.array([chunk.bounds for chunk in chunks])
            inside = (bounds[:, :2] <= place + 1e-9) & (place <= bounds[:, 2:] + 1e-9)
            assert inside.all(axis=1).any()
    for chunk in chunks:
        low, high = np.array(chunk.bounds[:2]) - margin, np.array(chunk.bounds[2:]) + margin
        near = (np.array(points) >= low - 1e-9) & (np.array(points) <= high + 1e-9)
        assert near.all(axis=1).any()


@given(st.lists(st.tuples(st.floats(-2e3, 2e3), st.floats(-2e3, 2e3)), min_size=1, max_size=20))
def test_a_point_lies_in_its_chunk(points: list[tuple[float, float]]) -> None:
    for point, tile in zip(points, tiles_of(np.array(points)).tolist(), strict=True):
        x0, y0, x1, y1 = Chunk(*tile).bounds
        assert x0 - 1e-9 <= point[0] <= x1
        assert y0 - 1e-9 <= point[1] <= y1
        assert chunk_at(np.array([*point, 7.0])) == Chunk(*tile)


def test_a_point_on_a_border_is_in_the_eastern_and_northern_chunk() -> None:
    assert chunk_at(np.array([200.0, -200.0])) == Chunk(1, -1)
    assert chunk_at(np.array([199.999, -200.001])) == Chunk(0, -2)


def test_names_are_unique_and_usable() -> None:
    chunks = [Chunk(x, y) for x in (-11, -1, 0, 1, 11) for y in (-11, -1, 0, 1, 11)]
    assert len({chunk.name for chunk in chunks}) == len(chunks)
    assert len({chunk.prim_name for chunk in chunks}) == len(chunks)
    assert all(chunk.prim_name.isidentifier() for chunk in chunks)
    assert len(set(Chunk(3, 4).neighbours())) == 8


def test_enclosed_chunks_are_added_and_bays_are_not():
    ring = [Chunk(x, y) for x in range(-1, 2) for y in range(-1, 2) if (x, y) != (0, 0)]
    assert set(without_holes(ring)) == {*ring, Chunk(0, 0)}
    bay = [chunk for chunk in ring if chunk != Chunk(1, 0)]
    assert without_holes(bay) == tuple(sorted(bay))
