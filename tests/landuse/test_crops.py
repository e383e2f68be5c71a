"""Fields hold the crops of the environment."""

from dataclasses import replace

import numpy as np
import pytest

from envgen_usd.chunks import LANDUSE_CELLS, Chunk
from envgen_usd.environment_files import read_profile
from envgen_usd.landuse.field_lattice import fields_of
from envgen_usd.landuse.outer_land import outer_land
from envgen_usd.models.land_rules import Crop
from envgen_usd.models.landuse import LanduseClass

AWAY = np.full((LANDUSE_CELLS, LANDUSE_CELLS), 40.0)
"""All land is farther from roads than fields keep, and nearer than the forest."""
CHUNKS = [Chunk(x, y) for x in range(5) for y in range(4)]
FIELD = LanduseClass.FIELD


def crops_of(crops: dict[Crop, float]) -> list[dict[LanduseClass, np.ndarray]]:
    profile = read_profile("1", "agricultural")
    sown = replace(profile, blocks=replace(profile.blocks, fields=0.5, crops=crops))
    return [outer_land(fields_of(chunk, 0), AWAY, sown) for chunk in CHUNKS]


def test_crops_share_the_fields_by_their_weights() -> None:
    plain = crops_of({})
    mixed = crops_of({"crop": 3.0, "orchard": 1.0, "field": 0.0, "grass": 4.0})
    area = dict.fromkeys(("crop", "orchard", "field", "grass"), 0.0)
    for fields, land in zip(plain, mixed, strict=True):
        layers = np.array([land[LanduseClass[name.upper()]] for name in area])
        # Each cell of a field has one crop, and nothing else changed.
        np.testing.assert_array_equal(layers.sum(axis=0), fields[FIELD])
        np.testing.assert_array_equal(land[LanduseClass.WOOD], fields[LanduseClass.WOOD])
        for name, layer in zip(area, layers, strict=True):
            area[name] += layer.sum()
    whole = sum(area.values())
    assert area["field"] == 0.0
    # Some 55 fields, each with its crop: three deviations of a binomial draw.
    for name, share in (("crop", 3 / 8), ("orchard", 1 / 8), ("grass", 4 / 8)):
        assert area[name] / whole == pytest.approx(share, abs=3 * np.sqrt(share * (1 - share) / 55))


def test_basins_have_walls_and_no_hedges() -> None:
    profile = read_profile("1", "harbour")
    basins = quays = 0
    for chunk in CHUNKS:
        fields = fields_of(chunk, 0)
        land = outer_land(fields, AWAY, profile)
        water, quay = land[LanduseClass.WATER], land[LanduseClass.QUAY]
        assert not (water & quay).any()
        assert not land[LanduseClass.WOOD].any()
        # Water keeps away from the border of its field, and all borders are walls.
        assert fields.margin[water].min() >= 2.6
        assert quay[fields.margin < 2.6].all()
        assert (water | quay).all()
        basins, quays = basins + water.sum(), quays + (quay & (fields.margin >= 2.6)).sum()
    assert basins / (basins + quays) == pytest.approx(2.0 / 3.5, abs=3 * np.sqrt(0.245 / 110))


def test_a_field_is_of_one_crop() -> None:
    """Between two crops lies a hedge: no cell of one touches a cell of another."""
    for land in crops_of({"crop": 1.0, "orchard": 1.0, "field": 1.0}):
        kinds = np.zeros(AWAY.shape, dtype=int)
        for kind in (LanduseClass.CROP, LanduseClass.ORCHARD, FIELD):
            kinds[land[kind] & ~land[LanduseClass.WOOD]] = kind
        for one, other in ((kinds[1:], kinds[:-1]), (kinds[:, 1:], kinds[:, :-1])):
            assert not np.any((one != other) & (one > 0) & (other > 0))
