"""The written layer, read again by OpenUSD."""

import json
import subprocess
import sys
from functools import partial

import numpy as np
import pytest
from pxr import Sdf, Usd, UsdGeom, UsdValidation
from typer.testing import CliRunner

from envgen_usd.commands.command_line import app
from envgen_usd.errors import EnvgenError
from envgen_usd.recipe.build_options import BuildOptions
from envgen_usd.recipe.environment_build import build
from envgen_usd.recipe.traffic_build import add_traffic, remove_traffic
from envgen_usd.traffic.traces.esmini_csv import read_csv_trace

KILLED = """
import os, sys
from pathlib import Path
from envgen_usd.whole_files import part_folder
with part_folder(Path(sys.argv[1])):
    os._exit(9)
"""
HEADER = "time,id,kind,length,width,height,x,y,h\n"


def rows(name, kind, size, path):
    times, places, headings = path
    sizes = ",".join(map(str, size))
    return "".join(
        f"{t:.3f},{name},{kind},{sizes},{x:.4f},{y:.4f},{h:.5f}\n"
        for t, (x, y), h in zip(times, places, headings, strict=True)
    )


def write_trace(folder):
    """A car that turns over the back of its heading, and a person who comes later and goes."""
    times = np.arange(0, 4.01, 0.1)
    car = np.stack([50 - 8 * times, 1.8 + 0 * times], axis=1)
    headings = np.where(times < 2, np.pi - 0.02, -np.pi + 0.02)
    later = np.arange(1.0, 3.01, 0.1)
    walk = np.stack([10 + 1.4 * (later - 1), 4.5 + 0 * later], axis=1)
    text = rows("car 1", "car", (4.2, 1.8, 1.5), (times, car, headings))
    text += rows("p", "pedestrian", (0.5, 0.5, 1.75), (later, walk, 0 * later))
    path = folder / "trace.csv"
    path.write_text(HEADER + text)
    return path


def drawn_points(root, time):
    """Points of all meshes below a prim; bounding boxes of turned wheels would be too large."""
    found = []
    for prim in Usd.PrimRange(root):
        if prim.IsA("Mesh") and UsdGeom.Imageable(prim).ComputePurpose() != "guide":
            matrix = np.array(UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(time))
            points = np.array(UsdGeom.Mesh(prim).GetPointsAttr().Get(time), dtype=float)
            found.append(points @ matrix[:3, :3] + matrix[3, :3])
    return np.concatenate(found)


@pytest.fixture
def stage(town, tmp_path):
    path = write_trace(tmp_path)
    add_traffic(town, lambda: read_csv_trace(path))
    return Usd.Stage.Open(str(town / "stage.usda"))


def test_actors_move_on_the_stage(stage):
    assert (stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (0.0, 40.0)
    assert stage.GetTimeCodesPerSecond() == 10.0
    car = UsdGeom.Xformable(stage.GetPrimAtPath("/World/Traffic/car_1"))
    points = drawn_points(car.GetPrim(), 10.0)
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    np.testing.assert_allclose(middle[:2], [42.0, 1.8], atol=0.05)
    # The street is level at height 0.
    assert points[:, 2].min() == pytest.approx(0.0, abs=0.01)
    # Between two samples, the car is in between, and its heading goes the short way.
    between = car.ComputeLocalToWorldTransform(19.5)
    ahead = np.array(between.TransformDir((1.0, 0.0, 0.0)))
    assert ahead[0] / np.linalg.norm(ahead) == pytest.approx(-1.0, abs=1e-3)
    there = car.ComputeLocalToWorldTransform(20.0).ExtractTranslation()
    before = car.ComputeLocalToWorldTransform(19.0).ExtractTranslation()
    np.testing.assert_allclose(
        between.ExtractTranslation(), (np.array(there) + before) / 2, atol=1e-6
    )


def test_actors_are_visible_while_they_are_there(stage):
    person = UsdGeom.Imageable(stage.GetPrimAtPath("/World/Traffic/p"))
    seen = [person.ComputeVisibility(float(code)) for code in (0, 9, 10, 30, 31, 40)]
    assert seen == ["invisible", "invisible", "inherited", "inherited", "invisible", "invisible"]
    car = UsdGeom.Imageable(stage.GetPrimAtPath("/World/Traffic/car_1"))
    assert not car.GetVisibilityAttr().HasAuthoredValue()


def test_actors_say_what_they_are(stage):
    prim = stage.GetPrimAtPath("/World/Traffic/car_1")
    facts = {
        name: prim.GetAttribute(f"userProperties:{name}").Get()
        for name in ("gml_id", "category", "segmentation_class", "source")
    }
    assert facts == {
        "gml_id": "car 1", "category": "car", "segmentation_class": "car", "source": "trace.csv"
    }  # fmt: skip
    assert prim.GetAttribute("userProperties:length").Get() == pytest.approx(4.2, rel=0.1)
    assert prim.GetAttribute("semantics:labels:class").Get()[0] == "car"
    assert not prim.IsInstance()
    schema = Usd.SchemaRegistry().FindAppliedAPIPrimDefinition("EnvgenActorAPI")
    mine = {n for n in prim.GetAuthoredPropertyNames() if n.startswith("userProperties:")}
    # Only parked actors have a place, and the country and area type of an environment.
    parked = {f"userProperties:{name}" for name in ("country", "area_type", "place")}
    assert mine == set(schema.GetPropertyNames()) - parked


def test_actors_that_stand_are_in_the_way(town, tmp_path):
    stage = Usd.Stage.Open(str(town / "stage.usda"))
    standing = next(p.GetPath() for p in stage.Traverse() if p.GetParent().GetName() == "Actors")
    place = UsdGeom.Xformable(stage.GetPrimAtPath(standing)).ComputeLocalToWorldTransform(0.0)
    x, y, _ = place.ExtractTranslation()
    times = np.arange(0, 2.01, 0.1)
    path = tmp_path / "through.csv"
    way = np.stack([x - 8 + 8 * times, y + 0 * times], axis=1)
    path.write_text(HEADER + rows("car 1", "car", (4.2, 1.8, 1.5), (times, way, 0 * times)))
    result = add_traffic(town, lambda: read_csv_trace(path))
    (issue,) = [each for each in result.issues if each.kind == "traffic.through_objects"]
    assert f"car 1 through {standing}" in issue.message


def test_validators_find_nothing(town, stage):
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    prims = list(Usd.PrimRange(stage.GetPrimAtPath("/World/Traffic")))
    context = UsdValidation.ValidationContext(validators)
    assert [error.GetErrorString() for error in context.Validate(prims)] == []
    layer = Sdf.Layer.FindOrOpen(str(town / "layers" / "traffic.usdc"))
    assert [error.GetErrorString() for error in context.Validate(layer)] == []
    assert not stage.GetCompositionErrors()


def test_a_build_keeps_the_actors_of_its_surface_and_removes_others(town, street, tmp_path):
    path = write_trace(tmp_path)
    add_traffic(town, lambda: read_csv_trace(path))
    before = (town / "stage.usda").read_text()
    road = street.parent / "street.xodr"
    options = BuildOptions(road, "1", "residential", town, workers=1)
    assert not [i for i in build(options).issues if i.kind.startswith("traffic")]
    assert (town / "stage.usda").read_text() == before
    # Another road: the actors would float.
    text = road.read_text().replace('<elevation s="0" a="0"', '<elevation s="0" a="1.5"')
    other = tmp_path / "street.xodr"
    other.write_text(text.replace('length="60"', 'length="50"'))
    issues = build(BuildOptions(other, "1", "residential", town, workers=1)).issues
    assert [i.kind for i in issues if i.kind.startswith("traffic")] == ["traffic.removed"]
    stage = Usd.Stage.Open(str(town / "stage.usda"))
    assert not stage.GetPrimAtPath("/World/Traffic")
    assert not (town / "layers" / "traffic.usdc").exists()


def test_removal_restores_the_stage(town, tmp_path):
    before = (town / "stage.usda").read_text()
    path = write_trace(tmp_path)
    add_traffic(town, lambda: read_csv_trace(path))
    assert (town / "stage.usda").read_text() != before
    assert remove_traffic(town)
    assert (town / "stage.usda").read_text() == before
    assert not remove_traffic(town)


def test_what_a_killed_run_was_writing_is_removed(town, tmp_path):
    path = write_trace(tmp_path)
    read = partial(read_csv_trace, path)
    for again in (partial(add_traffic, town, read), partial(remove_traffic, town)):
        subprocess.run([sys.executable, "-c", KILLED, str(town)], check=False)
        assert [*town.glob(".envgen-usd.*")]
        again()
        assert not [*town.rglob(".envgen-usd.*")]


def test_a_faulty_trace_leaves_the_stage_as_it_was(town, tmp_path):
    def files():
        return {path: path.read_bytes() for path in town.rglob("*") if path.is_file()}

    path = write_trace(tmp_path)
    before = files()
    far = tmp_path / "far.csv"
    far.write_text(HEADER + rows("a", "car", (4, 2, 1.5), ([0, 1], [(9e3, 0), (9e3, 1)], [0, 0])))
    with pytest.raises(EnvgenError, match="no actor is on the map"):
        add_traffic(town, lambda: read_csv_trace(far))
    blind = tmp_path / "blind.csv"
    blind.write_text(path.read_text().replace(",car,", ",hovercraft,"))
    with pytest.raises(EnvgenError, match="accepts none"):
        add_traffic(town, lambda: read_csv_trace(blind), strict=True)
    assert files() == before


def test_a_build_whose_environment_is_gone_gets_all_looks_alike(town, tmp_path):
    """The environment's folder that the manifest names was moved away since."""
    path, manifest = write_trace(tmp_path), town / "manifest.json"

    def named(result):
        return [issue for issue in result.issues if issue.kind == "traffic.environment"]

    assert not named(add_traffic(town, lambda: read_csv_trace(path)))
    content = json.loads(manifest.read_text())
    content["inputs"]["environments"] = str(tmp_path / "gone")
    manifest.write_text(json.dumps(content))
    result = add_traffic(town, lambda: read_csv_trace(path))
    (issue,) = named(result)
    assert issue.action == "all looks are equally likely"
    assert "gone" in issue.message
    assert result.actors == {"car": 1, "pedestrian": 1}


def test_the_command_asks_for_one_source(town, tmp_path):
    run = CliRunner().invoke
    for arguments in ([], ["--csv", "a.csv", "--fcd", "b.xml"]):
        result = run(app, ["traffic", str(town), *arguments])
        assert isinstance(result.exception, EnvgenError)
        assert "give one of" in str(result.exception)
    result = run(app, ["traffic", str(town), "--csv", str(write_trace(tmp_path))])
    assert result.exit_code == 0, result.output
    assert "1 car, 1 pedestrian; 4.0 s at 10 frames a second" in result.output
    assert "removed" in run(app, ["traffic", str(town), "--remove"]).output
    missing = run(app, ["traffic", str(tmp_path / "none"), "--remove"])
    assert "holds no finished build" in str(missing.exception)
    stage = run(app, ["traffic", str(town / "stage.usda"), "--remove"])
    assert f"is a file; name the folder of the build, {town}" in str(stage.exception)
