import numpy as np
import pytest
import rasterio
from PIL import Image
from rasterio.transform import Affine

from envgen_usd.chunks import CELL_SIZE
from envgen_usd.errors import EnvgenError
from envgen_usd.landuse.network.data.known_fields import RAW
from envgen_usd.landuse.network.data.raster_samples import read_raster_samples
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


def test_a_training_raster_beyond_memory_is_refused(tmp_path):
    with rasterio.open(
        tmp_path / "a.tif", "w", driver="GTiff", width=40_000, height=40_000, count=1,
        dtype="uint8", tiled=True, SPARSE_OK=True, transform=Affine(1, 0, 500, 0, -1, 900),
    ):  # fmt: skip
        pass
    with pytest.raises(EnvgenError, match=r"has 40000 x 40000 pixels.*cut it into tiles"):
        read_raster_samples(tmp_path)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            "[classes]\n7 = 'sea'",
            "classes.7: expected one of unknown, road, .*, wood, .*'sea'$",
        ),
        ("[classes]\n256 = 'wood'", "classes: unknown 256; known: a whole number from 0 to 255$"),
        ("[classes]\nx = 'wood'", "classes: unknown x; known: a whole number from 0 to 255$"),
        ("[class]", "missing classes; unknown class; known: classes$"),
        ("7 = ", "cannot be read as TOML"),
    ],
)
def test_a_class_map_that_does_not_fit_is_named(tmp_path, text, said):
    Image.fromarray(np.zeros((80, 80), dtype=np.uint8)).save(tmp_path / "a.png")
    (tmp_path / "map.toml").write_text(text)
    with pytest.raises(EnvgenError, match=said) as caught:
        read_raster_samples(tmp_path, tmp_path / "map.toml")
    assert str(caught.value).startswith(str(tmp_path / "map.toml"))
