import numpy as np

from envgen_usd.seeds import generator


def test_a_stream_follows_from_seed_and_names_alone() -> None:
    first = generator(7, "city", "1_-2", 3).random(8)
    generator(7, "city", "other").random(100)
    np.testing.assert_array_equal(first, generator(7, "city", "1_-2", 3).random(8))


def test_other_seeds_and_names_give_other_streams() -> None:
    paths = [(0, "a"), (1, "a"), (0, "b"), (0, "a", "b"), (0, "ab"), (0, "a", 1), (0, "a1")]
    draws = {tuple(generator(*path).integers(0, 2**32, 4)) for path in paths}
    assert len(draws) == len(paths)
