import numpy as np
import pytest
from PIL import Image

from envgen_usd.chunks import CELL_SIZE
from envgen_usd.landuse.network.fields import RAW
from envgen_usd.landuse.network.rasters import read_raster_samples
from envgen_usd.models.landuse import LanduseClass


@pytest.fixture
def sample(tmp_path):
    values = np.full((80, 100), 9, dtype=np.uint8)
    values[:10] = 200  # a road along the northern edge
    Image.fromarray(values).save(tmp_path / "a.png")
    (tmp_path / "map.toml").write_text('[classes]\n200 = "road"\n9 = "wood"\n')
    return read_raster_samples(tmp_path, tmp_path / "map.toml")[0]


def test_values_become_classes_with_the_south_first(sample):
    assert sample.classes.shape == (80, 80)
    assert np.all(sample.classes[70:] == LanduseClass.ROAD)
    assert np.all(sample.classes[:70] == LanduseClass.WOOD)


def test_fields_point_away_from_the_road_and_tell_its_distance(sample):
    fields = {name: sample.raw[n].astype(float) for n, name in enumerate(RAW)}
    assert np.all(fields["normal_y"][:35] == -1)
    assert np.all(fields["normal_x"][:35] == 0)
    assert fields["distance"][0] == pytest.approx(70 * CELL_SIZE, abs=CELL_SIZE)
    assert np.all(fields["told"] == 0)
