"""Formats of other data sets, read by our own eyes and by the readers of their makers."""

import json

import numpy as np
import pytest
from PIL import Image
from tests.datasets.conftest import as_kitti
from typer.testing import CliRunner

from envgen_usd.commands.command_line import app
from envgen_usd.datasets.dataset_index import read_index
from envgen_usd.datasets.formats.coco_format import panoptic_ids, segments
from envgen_usd.datasets.formats.dataset_formats import FORMATS, check_formats, write_formats
from envgen_usd.datasets.formats.kitti360.short_instances import (
    pixels_of,
    sequence_numbers,
    short_instances,
)
from envgen_usd.errors import EnvgenError
from envgen_usd.label_taxonomy import label, labels
from envgen_usd.render.cameras.camera_rig import Camera
from envgen_usd.render.cameras.lens_models import Mei
from envgen_usd.render.frames.frame_folder import OUTPUTS

FACTOR = 10_000_000


def image(path):
    return np.asarray(Image.open(path))


def test_cityscapes_own_evaluation_of_truth_against_itself_is_perfect(written, read):
    folder, frames = written("cityscapes")
    said = read("cityscapes", folder)
    assert said["score"] == 1.0
    assert set(said["classes"].values()) == {1.0}
    assert {"road", "building", "vegetation", "pole"} <= said["classes"].keys()
    assert said["cities"] == ["a-road-1-residential-0", "b-2-industrial-3"]
    assert len(set(said["names"])) == len(frames) == 24
    assert said["names"] == said["pictures"]
    # Instance images give the same pixels to each class as the label images.
    first = image(next(iter(sorted(folder.glob("gtFine/*/*/*labelIds.png")))))
    for name, count in said["instances"].items():
        assert count == (first == said["labels"][name][0]).sum()


def test_the_labels_are_those_of_both_makers(written, read):
    for name in ("cityscapes", "kitti360"):
        folder, _ = written(name)
        rows = read(name, folder if name == "cityscapes" else folder / "two")["labels"]
        for entry in labels():
            number, train_id, colour, *separate = rows[entry.cityscapes]
            key = "cityscapes" if name == "cityscapes" else "kitti_360"
            assert getattr(entry, f"{key}_id") == number
            assert getattr(entry, f"{key}_train_id") == train_id
            assert entry.name == "static" or list(entry.colour) == colour
            assert not separate or separate == [entry.kitti_360_has_instances]


def test_cityscapes_train_ids_and_pictures(written):
    folder, frames = written("cityscapes")
    for kind, trained in (("road", 0), ("sky", 10), ("building", 2)):
        for path in folder.glob("gtFine/*/*/*labelTrainIds.png"):
            ids = image(str(path).replace("labelTrainIds", "labelIds"))
            np.testing.assert_array_equal(image(path) == trained, ids == label(kind).id)
    one = frames[0]
    picture = folder / "leftImg8bit" / "train" / "a-road-1-residential-0"
    picture /= "a-road-1-residential-0_000000_000000_leftImg8bit.png"
    assert picture.samefile(folder.parent / one.file("rgb"))
    place = folder / "camera" / "val" / "b-2-industrial-3"
    camera = json.loads((place / "b-2-industrial-3_000001_000002_camera.json").read_text())
    assert camera["intrinsic"] == {"fx": 50.0, "fy": 51.0, "u0": 29.5, "v0": 19.5}
    assert camera["extrinsic"]["y"] == -0.3
    assert camera["extrinsic"]["pitch"] == camera["extrinsic"]["yaw"] == 0.0


def test_pycocotools_reads_the_masks(written, read):
    folder, frames = written("coco")
    rows = read("coco", folder)["annotations"]
    stored = {path.name: path for path in (folder / "train").iterdir()}
    truth = {}
    for each in (each for each in frames if each.split == "train"):
        values = image(folder.parent / each.file("instance"))
        name = next(n for n, p in stored.items() if p.samefile(folder.parent / each.file("rgb")))
        for value in np.unique(values[values % FACTOR > 0]).tolist():
            y, x = np.nonzero(values == value)
            box = [x.min(), y.min(), np.ptp(x) + 1, np.ptp(y) + 1]
            truth[name, value] = len(y), box
    assert {(row["file"], row["instance"]) for row in rows} == truth.keys()
    for row in rows:
        area, box = truth[row["file"], row["instance"]]
        assert row["area"] == [area, area]
        assert row["bbox"] == [box, box]
        assert row["corner"] == area
        assert label(row["category"].replace(" ", "_")).id == row["instance"] // FACTOR


def test_panoptic_segments_are_the_pixels(written):
    folder, frames = written("coco")
    content = json.loads((folder / "annotations" / "panoptic_val.json").read_text())
    names = {row["id"]: row["file_name"] for row in content["images"]}
    things = {row["id"]: row["isthing"] for row in content["categories"]}
    assert len(content["annotations"]) == len(names) == 12
    for annotation in content["annotations"]:
        assert names[annotation["image_id"]] == annotation["file_name"]
        pixels = image(folder / "panoptic_val" / annotation["file_name"]).astype(int)
        ids = pixels[..., 0] + 256 * pixels[..., 1] + 65536 * pixels[..., 2]
        rows = annotation["segments_info"]
        assert {row["id"] for row in rows} == set(np.unique(ids[ids > 0]).tolist())
        for row in rows:
            assert row["area"] == (ids == row["id"]).sum()
            assert bool(row["instance"] % FACTOR) == bool(things[row["category_id"]])
    assert len(frames) == 24


def test_a_run_over_the_end_of_a_column_is_whole():
    values = np.full((4, 5), 7 * FACTOR, np.uint32)
    values[1:, 1] = values[:, 2] = values[0, 3] = 11 * FACTOR + 1
    road, house = segments(values)
    assert (house.area, house.box) == (8, (1, 0, 3, 4))
    assert house.runs == (5, 8, 7)
    assert (road.area, road.box, road.runs) == (12, (0, 0, 5, 4), (0, 5, 8, 7, 0))


def test_panoptic_images_refuse_what_they_cannot_hold():
    with pytest.raises(EnvgenError, match=r"coco: panoptic images .* hold 99,999 objects"):
        panoptic_ids(np.array([[21 * FACTOR + 100_000]], np.uint32))


def test_ultralytics_trains_with_the_boxes_of_the_pixels(written, read):
    folder, frames = written("yolo")
    before = {path for path in folder.rglob("*") if path.is_file()}
    said = read("ultralytics", folder)
    for path in {path for path in folder.rglob("*") if path.is_file()} - before:
        assert path.suffix == ".cache"
    assert said["names"] == [entry.cityscapes for entry in labels() if entry.has_instances]
    names = {entry.id: entry.cityscapes for entry in labels()}
    for split, rows in said["splits"].items():
        stored = {path.stem: path for path in (folder / "images" / split).iterdir()}
        assert sorted(row["stem"] for row in rows) == sorted(stored)
        for row in rows:
            assert row["shape"] == [40, 60]
            source = next(
                folder.parent / each.file("instance")
                for each in frames
                if stored[row["stem"]].samefile(folder.parent / each.file("rgb"))
            )
            values, truth = image(source), []
            for value in np.unique(values[values % FACTOR > 0]).tolist():
                y, x = np.nonzero(values == value)
                wide, high = np.ptp(x) + 1, np.ptp(y) + 1
                middle = (x.min() + wide / 2) / 60, (y.min() + high / 2) / 40
                truth.append((names[value // FACTOR], *middle, wide / 60, high / 40))
            found = [(kind, *box) for kind, box in zip(row["classes"], row["boxes"], strict=True)]
            shown = [
                sorted((kind, *np.round(box, 4).tolist()) for kind, *box in rows)
                for rows in (found, truth)
            ]
            assert shown[0] == shown[1]


def test_yolo_boxes_are_those_of_the_pixels(written, read):
    folder, frames = written("yolo")
    said = read("yolo", folder)
    assert said["classes"] == [entry.cityscapes for entry in labels() if entry.has_instances]
    stored = {path.stem: path for path in (folder / "images" / "train").iterdir()}
    assert said["boxes"].keys() == stored.keys()
    for each in (each for each in frames if each.split == "train"):
        values = image(folder.parent / each.file("instance"))
        name = next(n for n, p in stored.items() if p.samefile(folder.parent / each.file("rgb")))
        boxes = []
        for value in np.unique(values[values % FACTOR > 0]).tolist():
            y, x = np.nonzero(values == value)
            box = [x.min(), y.min(), x.max() + 1, y.max() + 1]
            kind = next(e.cityscapes for e in labels() if e.id == value // FACTOR)
            boxes.append((kind, *map(float, box)))
        found = [(kind, *np.round(box, 2)) for kind, *box in said["boxes"][name]]
        assert sorted(found) == sorted(boxes)


def test_kitti360scripts_reads_poses_calibration_and_labels(written, read):
    folder, frames = written("kitti360")
    said = read("kitti360", folder / "two")
    assert said["score"] == 1.0
    assert said["files"] == 12
    of_take = [each for each in frames if each.folder.startswith(frames[0].folder[:-5])]
    for each in of_take:
        rows = json.loads((folder.parent / each.folder / "cameras.json").read_text())["frames"]
        number = {"left": 0, "right": 1}[each.camera]
        pose = said["poses"][f"{number} {each.frame}"]
        np.testing.assert_allclose(pose, rows[each.frame]["camera_to_world"], atol=1e-9)
    # 50 / 30 + 29.5 and 51 * 2 / 30 + 19.5, to whole pixels.
    assert said["projected"] == [[31.0, 23.0]] * 2
    first = image(folder.parent / frames[0].file("semantic"))
    assert said["semantic"] == np.unique(first).tolist()
    values = image(folder.parent / frames[0].file("instance"))
    table = folder / "two" / "data_2d_semantics" / "train" / "2013_05_28_drive_0000_sync"
    table = json.loads((table / "image_00" / "instance_table" / "0000000000.json").read_text())
    kept = [entry.id for entry in labels() if entry.kitti_360_has_instances]
    shown = {v for v in np.unique(values).tolist() if v % FACTOR and v // FACTOR in kept}
    assert set(table.values()) == shown
    assert {int(value) for value in said["seen"]} == {int(value) for value in table}
    assert all("0000000000.png" in names for names in said["seen"].values())


def test_kitti360scripts_reads_a_rig_of_one_camera(made_up, read):
    frames = [each for each in read_index(made_up) if each.camera == "right"]
    write_formats(made_up, frames, ["kitti360"])
    said = read("kitti360", made_up / "kitti360" / "two")
    assert said["score"] == 1.0
    rows = json.loads((made_up / frames[0].folder / "cameras.json").read_text())["frames"]
    assert said["poses"].keys() == {"0 0", "0 1", "0 2"}
    np.testing.assert_allclose(said["poses"]["0 2"], rows[2]["camera_to_world"], atol=1e-9)


def test_kitti360scripts_reads_the_velodyne(written, read):
    folder, frames = written("kitti360")
    said = read("kitti360", folder / "two")
    take = folder.parent / frames[0].folder.rsplit("/", 1)[0] / "velodyne"
    rows = np.load(take / "points" / "000002.npy")
    pose = json.loads((take / "lidar.json").read_text())["frames"][2]["lidar_to_world"]
    points = np.column_stack([rows[axis] for axis in "xyz"]).astype(float)
    world = points @ np.array(pose)[:3, :3].T + np.array(pose)[:3, 3]
    np.testing.assert_allclose(np.array(said["world"])[:, :3], world, atol=1e-5)
    np.testing.assert_allclose(said["intensities"], rows["intensity"], atol=1e-7)


def test_scans_in_files_of_kitti_are_linked(made_up):
    write_formats(made_up, read_index(made_up), ["kitti360"])
    folder = made_up / "kitti360" / "two" / "data_3d_raw"
    scans = sorted(folder.rglob("*.bin"))
    assert len(scans) == 12
    whole = [path.read_bytes() for path in scans]
    as_kitti(made_up)
    write_formats(made_up, read_index(made_up), ["kitti360"])
    assert [path.read_bytes() for path in scans] == whole
    assert all(path.stat().st_nlink == 2 for path in scans)


def test_each_scan_of_kitti360_has_a_time(written):
    """Frames 0 and 1 are a drive, frame 2 is the next; only the drives in fog have times."""
    folder, _ = written("kitti360")
    clear = ["08:00:00.000000000", "08:00:00.100000000", "08:00:10.100000000"]
    fog = ["08:00:00.000000000", "08:00:00.750000000", "08:00:10.750000000"]
    found = []
    for path in sorted((folder / "two" / "data_3d_raw").glob("*/velodyne_points/timestamps.txt")):
        lines = path.read_text().splitlines()
        assert {line[:11] for line in lines} == {"2013-05-28 "}
        found.append([line[11:] for line in lines])
    assert found == [clear, fog] * 2


def test_a_data_set_without_lidars_has_no_files_of_scans(made_up):
    for path in list(made_up.rglob("lidar.json")):
        path.unlink()
    write_formats(made_up, read_index(made_up), ["kitti360", "nuscenes"])
    for name in ("data_3d_raw", "calib_cam_to_velo.txt", "LIDAR_TOP", "lidarseg", "lidarseg.json"):
        assert not list(made_up.rglob(name))


def test_scans_that_cannot_be_read_are_named(made_up):
    check_formats(["kitti360", "nuscenes"], OUTPUTS, "npy")
    check_formats(["coco"], OUTPUTS, "las")
    with pytest.raises(EnvgenError, match="take lidar_format kitti or npy, not las"):
        check_formats(["kitti360"], OUTPUTS, "las")
    frames = read_index(made_up)
    broken = made_up / "frames" / frames[0].town / "clear_two" / "velodyne/points/000001.npy"
    broken.write_bytes(broken.read_bytes()[:100])
    with pytest.raises(EnvgenError, match=r"points/000001.npy: cannot be read"):
        write_formats(made_up, frames, ["nuscenes"])


def test_kitti360scripts_reads_a_fisheye(made_up, read):
    """The right camera gets the lens of a fisheye: its place is image_02."""
    lens = {"model": "mei", "xi": 1.5, "k1": 0.02, "k2": 0.3, "p1": 0.0, "p2": 0.0, "field": 180.0}
    for path in made_up.rglob("right/cameras.json"):
        content = json.loads(path.read_text())
        content["camera"]["lens"] = lens
        path.write_text(json.dumps(content))
    frames = read_index(made_up)
    write_formats(made_up, frames, ["kitti360"])
    said = read("kitti360", made_up / "kitti360" / "two")
    assert said["poses"].keys() == {"0 0", "0 1", "0 2"}
    right = next(each for each in frames if each.camera == "right")
    rows = json.loads((made_up / right.folder / "cameras.json").read_text())["frames"]
    assert said["fisheyes"].keys() == {"2 0", "2 1", "2 2"}
    for number, row in enumerate(rows):
        np.testing.assert_allclose(
            said["fisheyes"][f"2 {number}"], row["camera_to_world"], atol=1e-9
        )
    camera = Camera(60, 40, 50.0, 51.0, 29.5, 19.5, lens=Mei(**lens))
    place = camera.lens.project(np.array([(1.0, 2.0, 30.0)]))[0] * (50.0, 51.0) + (29.5, 19.5)
    assert said["bent"] == [pytest.approx(place.tolist(), abs=1e-9)]
    raw = made_up / "kitti360" / "two" / "data_2d_raw" / "2013_05_28_drive_0000_sync"
    assert (raw / "image_02" / "data_rgb" / "0000000001.png").samefile(
        made_up / right.folder / "rgb" / "000001.png"
    )


def alone(values):
    """A frame that is a sequence of its own."""
    return short_instances(values, sequence_numbers([pixels_of(values)]))


def test_numbers_that_fit_in_16_bits_stay():
    """Objects of a class up to 999 keep their number; others get free ones, and none is shared."""
    pole = label("pole").id
    rng = np.random.default_rng(2)
    numbers = rng.choice(np.arange(1, 5000), 700, replace=False)
    values = (
        (pole * FACTOR + rng.permutation(np.repeat(numbers, 3))).astype(np.uint32).reshape(30, 70)
    )
    short = alone(values)
    assert short.image.dtype == np.uint16
    np.testing.assert_array_equal(short.image // 1000, pole)
    back = np.vectorize(short.table.get)(short.image)
    np.testing.assert_array_equal(back, values)
    small = values % FACTOR <= 999
    np.testing.assert_array_equal(short.image[small] % 1000, values[small] % FACTOR)


def test_more_objects_than_16_bits_hold_have_no_number():
    """Numbers 500 to 999 stay, and the other 499 are for objects beyond 999."""
    pole = label("pole").id * FACTOR
    numbers = np.random.default_rng(1).permutation(np.arange(500, 2500)).reshape(50, 40)
    short = alone((pole + numbers).astype(np.uint32))
    kept = {value - pole for value in short.table.values()}
    assert len(kept) == len(short.table) == 999
    assert {*range(500, 1000)} < kept
    left = np.isin(numbers, sorted(kept), invert=True)
    np.testing.assert_array_equal(short.image % 1000 == 0, left)


def test_classes_without_instances_in_kitti_360_have_no_numbers():
    values = np.array([[21 * FACTOR + 5, 7 * FACTOR, 4 * FACTOR + 9, 0]], np.uint32)
    short = alone(values)
    assert short.image.tolist() == [[21000, 7000, 4000, 0]]
    assert short.table == {}


def test_unknown_formats_and_missing_outputs_are_named(made_up):
    with pytest.raises(EnvgenError, match=r"unknown format nuscene; known: cityscapes, coco"):
        check_formats(["nuscene"], ["rgb"])
    with pytest.raises(EnvgenError, match="coco needs the outputs instance"):
        check_formats(["coco"], ["rgb", "semantic"])
    result = CliRunner().invoke(app, ["dataset", "convert", str(made_up), "cityscapes", "yolo"])
    assert result.exit_code == 0, result.output
    assert result.stdout.splitlines() == [str(made_up / "cityscapes"), str(made_up / "yolo")]
    assert list(FORMATS) == ["cityscapes", "coco", "kitti360", "nuscenes", "webdataset", "yolo"]


def test_writing_again_gives_the_same_files(made_up):
    def state():
        names = sorted(p for n in FORMATS for p in (made_up / n).rglob("*") if p.is_file())
        return {str(path): path.read_bytes() for path in names}

    write_formats(made_up, read_index(made_up), list(FORMATS))
    before = state()
    write_formats(made_up, read_index(made_up), list(FORMATS))
    assert state() == before
    assert not list(made_up.rglob(".envgen*"))
