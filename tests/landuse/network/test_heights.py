from copy import deepcopy
from dataclasses import replace

import numpy as np
import pytest
import rasterio
import shapely
import torch
from rasterio.transform import Affine

from envgen_usd.chunks import Chunk
from envgen_usd.errors import EnvgenError
from envgen_usd.landuse.network.data.height_sample import (
    HEIGHT_CELL,
    HEIGHT_CONDITIONS,
    HEIGHT_RAW,
    HeightSample,
)
from envgen_usd.landuse.network.data.road_layouts import draw_layout
from envgen_usd.landuse.network.data.training_masks import draw_mask
from envgen_usd.landuse.network.heights.drawn_land import draw_land
from envgen_usd.landuse.network.heights.height_evaluation import (
    HeightWindow,
    by_mean,
    by_membrane,
    by_nearest,
    height_table,
    score_heights,
)
from envgen_usd.landuse.network.heights.height_raster_samples import read_height_samples, read_piece
from envgen_usd.landuse.network.heights.height_scenes import (
    make_height_sample,
    make_height_scene,
    on_grid,
    square_centres,
)
from envgen_usd.landuse.network.heights.network_land import HeightNetwork
from envgen_usd.landuse.network.heights.road_membrane import ground_of_roads
from envgen_usd.landuse.network.model.forward_draws import Draws
from envgen_usd.landuse.network.model.generator import make_generator
from envgen_usd.landuse.network.model.network_config import NetworkConfig, TrainConfig
from envgen_usd.landuse.network.network_provider import NetworkProvider
from envgen_usd.landuse.network.tasks.height_task import (
    CONTRAST,
    HEIGHT_FIELDS,
    LEAST_RISE,
    HeightTask,
    height_fields,
    to_grey,
    to_rise,
)
from envgen_usd.landuse.network.training.trainer import Trainer
from envgen_usd.landuse.network.training.training_batches import mirror, stack, turn
from envgen_usd.landuse.network.training.weights_file import (
    LARGEST_WEIGHT,
    read_network,
    read_target,
    write_weights,
)

TINY = NetworkConfig(
    HEIGHT_FIELDS,
    HEIGHT_CONDITIONS,
    head=(8, 8, 8),
    dim=8,
    heads=2,
    style=8,
    mapping=1,
    refine=(8, 8, 8, 8),
    critic=(8, 8, 8),
    streets=False,
    target="height",
)
TASK = HeightTask()


@pytest.fixture(scope="module")
def scene():
    return make_height_scene("train", 4, 2)


@pytest.fixture(scope="module")
def sample(scene):
    return make_height_sample(scene)


def flat(side, rise=0.0):
    """A window beside a road along its southern edge, on a plane that rises by 5 % to the east."""
    axis = (np.arange(side) + 0.5) * HEIGHT_CELL
    places = (np.arange(side // 2) + 0.5) * 2 * HEIGHT_CELL
    reference = np.broadcast_to(0.05 * axis, (side, side)).astype(np.float32)
    distance = np.broadcast_to(places[:, None], (side // 2, side // 2))
    raw = np.zeros((len(HEIGHT_RAW), side // 2, side // 2), dtype=np.float16)
    raw[HEIGHT_RAW.index("distance")], raw[HEIGHT_RAW.index("normal_y")] = distance, 1.0
    road = np.zeros((side, side), dtype=np.bool_)
    road[:2] = True
    risen = np.where(road, 0.0, rise).astype(np.float32)
    return HeightSample(raw, np.zeros(HEIGHT_CONDITIONS, np.float32), reference, risen, road)


def test_greys_are_metres_between_black_and_white():
    rise = torch.tensor([-2 * CONTRAST, -CONTRAST, -3.0, 0.0, 7.5, CONTRAST, 90.0])
    assert torch.equal(to_grey(rise)[[0, 1, 3, 5, 6]], torch.tensor([-1.0, -1, 0, 1, 1]))
    assert torch.allclose(to_rise(to_grey(rise))[1:6], rise[1:6])


@pytest.mark.parametrize("kind", ["mat", "unet"])
def test_known_heights_stay(sample, kind):
    torch.manual_seed(0)
    network = make_generator(replace(TINY, kind=kind))
    mask = draw_mask(64, np.random.default_rng(1), 0.3)
    batch = stack(TASK, [sample], [mask])
    fine, coarse = network(batch.known, batch.mask, batch.fields, batch.condition, Draws([0]))
    assert fine.shape == coarse.shape == (1, 1, 64, 64)
    made = TASK.composite(fine, batch.known, batch.mask)[0, 0]
    known = batch.mask[0, 0] > 0
    assert torch.equal(made[known], batch.truth[0][known])
    assert torch.equal(made[~known], fine[0, 0][~known])


@pytest.mark.parametrize("metres", [0.5, 4.0, -20.0])
def test_the_loss_of_a_constant_error_is_its_square_beside_the_relief(metres):
    batch = stack(TASK, [flat(64, 3.0)], [np.zeros((64, 64), dtype=np.bool_)])
    wrong = torch.full((1, 1, 64, 64), (3.0 + metres) / CONTRAST)
    loss = TASK.loss(wrong, batch.truth, batch.mask, 0.0)
    expected = metres**2 / np.hypot(3.0, LEAST_RISE) / CONTRAST
    assert float(loss[0]) == pytest.approx(expected, rel=1e-3)


def test_only_the_hole_counts():
    window = flat(64, 3.0)
    batch = stack(TASK, [window], [np.zeros((64, 64), dtype=np.bool_)])
    made = torch.where(torch.from_numpy(window.road), 1.0, batch.truth)[:, None]
    assert float(TASK.loss(made, batch.truth, batch.mask, 0.0)) == pytest.approx(0.0, abs=1e-7)
    rough = made.clone()
    rough[..., ::2] += 0.01
    smooth = made + 0.01
    losses = [float(TASK.loss(one, batch.truth, batch.mask, 0.0)) for one in (rough, smooth)]
    assert losses[0] > 2 * losses[1]


@pytest.mark.parametrize(
    ("move", "east", "north"),
    [
        (lambda one: one, 0.5, 0.0),
        (lambda one: turn(one, 1), 0.0, -0.5),
        (lambda one: turn(one, 2), -0.5, 0.0),
        (mirror, -0.5, 0.0),
    ],
)
def test_slopes_turn_with_the_window(move, east, north):
    moved = move(flat(64))
    fields = height_fields(
        torch.from_numpy(moved.raw[None]), torch.from_numpy(moved.reference.copy())[None]
    )
    assert torch.allclose(fields[0, 8], torch.tensor(east), atol=1e-3)
    assert torch.allclose(fields[0, 9], torch.tensor(north), atol=1e-3)
    # The road stays behind: away from it the distance grows.
    distance = moved.raw[0].astype(float)
    rows, columns = np.gradient(distance, 2 * HEIGHT_CELL)
    normal = moved.raw[list(moved.VECTOR)].astype(float)
    assert np.allclose(np.stack([columns, rows]), normal, atol=0.02)


def test_fields_tell_distance_and_direction_of_the_road(scene, sample):
    """Each is the mean of four cells."""
    road = shapely.union_all(shapely.polygons(scene.surface.vertices[scene.surface.triangles, :2]))
    centres = square_centres()
    rng = np.random.default_rng(0)
    for row, column in rng.integers(0, 32, (40, 2)):
        cells = [(2 * row + j, 2 * column + i) for j in (0, 1) for i in (0, 1)]
        places = np.array([(centres[i], centres[j]) for j, i in cells])
        if road.buffer(1.0).intersects(shapely.MultiPoint(places)):
            continue
        lines = shapely.shortest_line(road, shapely.points(places))
        feet = shapely.get_coordinates(lines)[::2]
        away, lengths = places - feet, shapely.length(lines)
        distance, x, y, above = sample.raw[:, row, column].astype(float)
        assert distance == pytest.approx(lengths.mean(), rel=2e-3, abs=0.2)
        assert (x, y) == pytest.approx((away / lengths[:, None]).mean(axis=0), abs=0.1)
        # Roads are level across, so their border lies a little off the land.
        reference = np.mean([sample.reference[cell] for cell in cells])
        assert above == pytest.approx(scene.land.followed(feet).mean() - reference, abs=1.2)


def test_the_truth_is_the_land_but_on_the_road(scene, sample):
    land = on_grid(scene.land.bare, square_centres(), square_centres())
    assert np.allclose(sample.heights[~sample.road], land[~sample.road], atol=1e-3)
    assert np.all(sample.rise[sample.road] == 0)
    assert 0 < sample.road.mean() < 0.5


def test_roads_over_land_are_level_across_and_follow_it_along():
    surface = draw_layout("straight", np.random.default_rng(3), lambda points: 0.05 * points[:, 1])
    line = surface.roads[0]
    start, end = line.points[[0, -1], :2]
    along = (end - start) / np.linalg.norm(end - start)
    s = np.clip((surface.vertices[:, :2] - start) @ along, 0, np.linalg.norm(end - start))
    inner = (s > 30) & (s < s.max() - 30)
    expected = 0.05 * (start + s[:, None] * along)[:, 1]
    assert np.allclose(surface.vertices[inner, 2], expected[inner], atol=0.02)
    assert inner.sum() > 100


def test_land_has_the_slope_that_was_drawn():
    rng = np.random.default_rng(5)
    points = rng.uniform(0, 400, (3000, 2))
    slopes = []
    for _ in range(12):
        land = draw_land(rng)
        step = land.followed(points + np.array([0.5, 0.0])) - land.followed(points)
        slopes.append(np.std(step) / 0.5)
    assert 0.005 < np.mean(slopes) < 0.05


def test_training_learns_a_window_and_goes_on_where_it_stopped(sample):
    window = sample
    run = TrainConfig(images=320, batch=4, size=64, small=0, rate=1e-2, adversarial=0.01)
    whole, part = (Trainer(TINY, run, torch.device("cpu")) for _ in range(2))
    losses = first = whole.advance([window])
    early = part.advance([window])
    assert early == first
    while whole.step < 0.75 * whole.steps:
        whole.advance([window])
    resumed = Trainer(TINY, run, torch.device("cpu"))
    resumed.load(deepcopy(whole.state()))
    while whole.step < whole.steps:
        losses = whole.advance([window])
    while resumed.step < resumed.steps:
        again = resumed.advance([window])
    assert losses == again
    assert {"adversarial", "critic"} <= set(losses)
    assert losses["second"] < 0.2 * first["second"]


@pytest.fixture(scope="module")
def weights(tmp_path_factory):
    torch.manual_seed(0)
    path = tmp_path_factory.mktemp("weights") / "height.safetensors"
    write_weights(make_generator(TINY), path)
    return path


def test_weights_know_what_they_are_for(weights, tmp_path):
    assert read_target(weights) == "height"
    with pytest.raises(EnvgenError, match="for height, not landuse"):
        NetworkProvider(weights)
    write_weights(make_generator(replace(TINY, target="landuse")), tmp_path / "landuse.safetensors")
    with pytest.raises(EnvgenError, match="for landuse, not height"):
        HeightNetwork(tmp_path / "landuse.safetensors")


def test_weights_of_another_version_are_refused(tmp_path):
    path = tmp_path / "old.safetensors"
    write_weights(make_generator(replace(TINY, fields=HEIGHT_FIELDS - 4)), path)
    with pytest.raises(EnvgenError, match=r"old\.safetensors: holds a network of another version"):
        HeightNetwork(path)


def test_an_output_that_overflows_is_refused(weights, scene, tmp_path):
    """Each weight is within its bound; their product is not."""
    network, path = read_network(weights), tmp_path / "large.safetensors"
    for value in network.parameters():
        value.fill_(LARGEST_WEIGHT)
    write_weights(network, path)
    with pytest.raises(EnvgenError, match="its output is not finite"):
        HeightNetwork(path).land(scene.surface, CHUNKS, 0)


CHUNKS = [Chunk(0, 0), Chunk(1, 0), Chunk(0, 1)]


def test_a_network_that_raises_everything_by_as_much_leaves_no_seam(weights, tmp_path):
    network = read_network(weights)
    for value in network.parameters():
        value.zero_()
    network.first.decoder.out[-1].conv.bias.fill_(3.0 / CONTRAST / TINY.output_gain)
    write_weights(network, tmp_path / "even.safetensors")
    surface = draw_layout("tee", np.random.default_rng(3), lambda points: 0.0 * points[:, 0])
    land = HeightNetwork(tmp_path / "even.safetensors").land(surface, CHUNKS, 0)
    axis = np.linspace(2.0, 398.0, 60)
    points = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
    road = shapely.union_all(shapely.polygons(surface.vertices[surface.triangles, :2]))
    # The rise is 0 on cells of the road, and a spline between cells.
    free = shapely.distance(road, shapely.points(points)) > 60.0
    assert free.sum() > 300
    assert np.allclose(land(points[free]), 3.0, atol=0.02)
    assert np.allclose(land(np.array([[-900.0, 100.0], [1500.0, 100.0]])), 3.0, atol=0.02)


def test_the_ground_of_roads_on_a_plane_is_the_plane():
    rows, columns = np.indices((20, 30))
    plane = 7.0 + 0.3 * columns - 0.1 * rows
    road = np.zeros(plane.shape, bool)
    road[4], road[:, 11], road[13, 20:] = True, True, True
    ground = ground_of_roads(np.where(road, plane, np.nan), road)
    # A level plane has a small weight, and the membrane takes up what it changes.
    assert np.allclose(ground, plane, atol=0.2)
    assert np.allclose(ground[road], plane[road])


def test_ground_beside_roads_is_the_mean_of_its_neighbours_above_a_plane():
    rng = np.random.default_rng(2)
    road = rng.random((16, 12)) < 0.1
    ground = ground_of_roads(rng.normal(50.0, 5.0, road.shape), road)
    bend = sum(np.roll(ground, n, axis) for n in (1, -1) for axis in (0, 1)) - 4.0 * ground
    assert np.allclose(bend[1:-1, 1:-1][~road[1:-1, 1:-1]], 0.0, atol=1e-8)
    assert not np.allclose(bend[1:-1, 1:-1][road[1:-1, 1:-1]], 0.0)


def test_ground_without_roads_is_level():
    assert not ground_of_roads(np.full((4, 6), np.nan), np.zeros((4, 6), bool)).any()


def test_land_is_as_smooth_across_borders_as_inside(weights, scene):
    network = HeightNetwork(weights)
    land, again = (network.land(scene.surface, chunks, 1) for chunks in (CHUNKS, CHUNKS[::-1]))
    along = np.column_stack([np.linspace(5.0, 195.0, 500), np.full(500, 200.0)])
    step = np.array([0.0, 0.1])
    across = np.abs(land(along + step) - land(along - step))
    inside = np.abs(land(along - [0, 60.3] + step) - land(along - [0, 60.3] - step))
    assert np.quantile(across, 0.95) < 2 * np.quantile(inside, 0.95) + 1e-3
    assert np.array_equal(land(along), again(along))


def test_figures_of_a_constant_error():
    one = flat(8, 1.5)
    one.raw[HEIGHT_RAW.index("distance")] *= 0.5  # some of the middle half counts as near
    windows = [HeightWindow(one, np.zeros((8, 8), dtype=np.float32))]
    perfect = score_heights(windows, lambda window: window.sample.rise)
    assert (perfect.rmse, perfect.mae, perfect.near, perfect.slope) == (0, 0, 0, 0)
    found = score_heights(windows, by_membrane)
    assert (found.rmse, found.mae, found.near) == pytest.approx((1.5, 1.5, 1.5))
    assert found.slope == pytest.approx(0.0, abs=1e-6)
    # The mean of the road is that of a plane which rises by 5 %, measured on four columns.
    places = (np.arange(4) - 1.5) * HEIGHT_CELL
    expected = np.sqrt(1.5**2 + np.mean((0.05 * places) ** 2))
    assert score_heights(windows, by_mean).rmse == pytest.approx(expected, rel=1e-3)
    assert score_heights(windows, by_nearest).rmse == pytest.approx(1.5)
    assert height_table({"one": found}).count("\n") == 2


def write_dem(path, heights, pixel=4.0, crs="EPSG:32632", bands=1):
    transform = Affine(pixel, 0.0, 500_000.0, 0.0, -pixel, 5_000_000.0)
    profile = {"driver": "GTiff", "width": heights.shape[1], "height": heights.shape[0]}
    with rasterio.open(
        path, "w", **profile, count=bands, dtype="float32", crs=crs, transform=transform, nodata=-99
    ) as file:
        for band in range(bands):
            file.write(heights.astype(np.float32), band + 1)


def test_a_piece_of_a_dem_has_its_slopes(tmp_path):
    row, column = np.indices((300, 260)) * 4.0  # metres to the south and to the east
    heights = 700.0 + 0.03 * column - 0.06 * row
    heights[100:104, 100:104] = -99
    write_dem(tmp_path / "dem.tif", heights)
    piece = read_piece(tmp_path / "dem.tif", np.random.default_rng(0))
    north, east = np.gradient(piece[20:80, 20:80], HEIGHT_CELL)
    assert np.median(east) == pytest.approx(0.03, abs=1e-3)
    assert np.median(north) == pytest.approx(0.06, abs=1e-3)
    assert piece.min() > 500.0


@pytest.mark.parametrize("value", [1e30, np.inf])
def test_heights_that_no_land_has_are_gaps_of_a_piece(tmp_path, value):
    row, column = np.indices((300, 260)) * 4.0
    heights = 700.0 + 0.03 * column - 0.06 * row
    heights[100:104, 100:104] = value
    write_dem(tmp_path / "dem.tif", heights)
    piece = read_piece(tmp_path / "dem.tif", np.random.default_rng(0))
    assert 500.0 < piece.min() < piece.max() < 800.0


def test_roads_are_laid_into_small_dems(tmp_path):
    row, column = np.indices((205, 210)) * 4.0
    write_dem(tmp_path / "dem.tif", 30 + 0.02 * column + row * 0.0)
    one, other = read_height_samples(tmp_path, 2, 0)
    assert one.side == other.side == 64
    assert not np.array_equal(one.heights, other.heights)
    assert np.ptp(one.heights[~one.road]) == pytest.approx(0.02 * 63 * HEIGHT_CELL, abs=0.2)


@pytest.mark.parametrize(
    ("options", "match"),
    [
        ({"crs": "EPSG:4326"}, "degrees"),
        ({"bands": 2}, "2 bands"),
        ({"pixel": 1.0}, "at least 64"),
    ],
)
def test_dems_that_cannot_be_used(tmp_path, options, match):
    write_dem(tmp_path / "dem.tif", np.zeros((40, 40)), **options)
    with pytest.raises(EnvgenError, match=match):
        list(read_height_samples(tmp_path, 1, 0))


def test_a_folder_without_dems(tmp_path):
    with pytest.raises(EnvgenError, match="no elevation model"):
        list(read_height_samples(tmp_path, 1, 0))
