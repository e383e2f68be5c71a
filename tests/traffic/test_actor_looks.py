"""Assets of actors: which one, how large, wheels that roll, poses that follow one another."""

import numpy as np
import pytest
from pxr import Usd, UsdGeom

from envgen_usd.assets.asset_catalogue import read_catalogue, scan_library
from envgen_usd.layers.actor_choice import ActorChoice, size_issues
from envgen_usd.layers.time_samples import needed_rows
from envgen_usd.layers.traffic_layer import write_traffic
from envgen_usd.models.actors import Actor, Motion
from envgen_usd.models.atmosphere import STAGE_UNIT
from envgen_usd.models.environment_profile import PropRules

RADIUS = 0.3
STRIDE = 1.2
MESH = """def Mesh "{name}" (
    prepend apiSchemas = ["SemanticsLabelsAPI:part"]
)
{{
    float3[] extent = [{low}, {high}]
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    point3f[] points = [{low}, {high}, {high}, {low}]
    token[] semantics:labels:part = ["{part}"]
}}"""


def asset(folder, kind, label, sets, defaults):
    """Writes an asset; sets: name to variant to (custom data, box, payload or None)."""
    name = f"{kind}_a"
    home = folder / "assets" / kind / name
    (home / "usd").mkdir(parents=True)
    (home / "payload").mkdir()
    blocks = []
    for set_name, variants in sets.items():
        rows = []
        for variant, (data, box, payload) in variants.items():
            reference = f"prepend payload = @../payload/{variant}.usda@" if payload else ""
            if payload:
                text = (
                    f'#usda 1.0\n(defaultPrim = "{name}")\ndef Xform "{name}"\n{{\n{payload}\n}}\n'
                )
                (home / "payload" / f"{variant}.usda").write_text(text)
            hint = f"float3[] extentsHint = [{box[0]}, {box[1]}]" if box else ""
            api = 'prepend apiSchemas = ["GeomModelAPI"]' if box else ""
            rows.append(
                f'"{variant}" ({api}\ncustomData = {{\n{data}\n}}\n{reference}\n) {{\n{hint}\n}}'
            )
        blocks.append(f'variantSet "{set_name}" = {{\n{chr(10).join(rows)}\n}}')
    selected = "\n".join(f'string {key} = "{value}"' for key, value in defaults.items())
    names = ", ".join(f'"{each}"' for each in sets)
    (home / "usd" / f"{name}.usda").write_text(f"""#usda 1.0
(defaultPrim = "{name}"
 metersPerUnit = 1
 upAxis = "Z")
def Xform "{name}" (
    prepend apiSchemas = ["SemanticsLabelsAPI:class"]
    kind = "component"
    variants = {{
{selected}
    }}
    prepend variantSets = [{names}]
)
{{
    token[] semantics:labels:class = ["{label}"]
    {chr(10).join(blocks)}
}}
""")


def car_body(length):
    half = length / 2
    box = ((-half, -0.9, 0.0), (half, 0.9, 1.5))
    data = f"""double3 nominal_size = ({length}, 1.8, 1.5)
double3[] wheel_centres = [(1.2, 0.7, 0.3), (1.2, -0.7, 0.3), (-1.2, 0.7, 0.3), (-1.2, -0.7, 0.3)]
double wheel_radius = {RADIUS}"""
    wheel = MESH.format(
        name="WheelFrontLeft", low=(0.9, 0.6, 0.0), high=(1.5, 0.8, 0.6), part="wheel"
    )
    body = MESH.format(name="Body", low=box[0], high=box[1], part="bodywork")
    return data, box, f'def Xform "Geometry"\n{{\n{wheel}\n{body}\n}}'


def pose(height, reach, more=""):
    box = ((-reach, -0.2, 0.0), (reach, 0.2, height))
    body = MESH.format(name="Body", low=box[0], high=box[1], part="clothes")
    return f"double3 nominal_size = ({2 * reach}, 0.4, {height})\n{more}", box, body


@pytest.fixture(scope="module")
def catalogue(tmp_path_factory):
    folder = tmp_path_factory.mktemp("library")
    (folder / "materials").mkdir()
    bodies = {"small": car_body(3.6), "large": car_body(4.8), "police": car_body(4.8)}
    paints = dict.fromkeys(("blue", "red"), ("", None, None))
    lights = dict.fromkeys(("off", "on"), ("", None, None))
    asset(folder, "car", "car", {"body": bodies, "paint": paints, "lights": lights},
          {"body": "small", "paint": "blue", "lights": "off"})  # fmt: skip
    stride = f"double stride_length = {STRIDE}"
    poses = {
        "standing": pose(1.8, 0.15),
        **{f"walk_{k}": pose(1.78, 0.3, stride) for k in range(4)},
    }
    asset(folder, "pedestrian", "person", {"pose": poses}, {"pose": "standing"})
    found, faults = scan_library(folder)
    assert not [fault for fault in faults if "assets" in fault], faults
    return found


def actor(kind="car", size=(4.8, 1.8, 1.5), model="", name="a"):
    return Actor(name, kind, *size, np.zeros(1), np.zeros((1, 2)), np.zeros(1), model)


def test_the_nearest_body_is_scaled_by_a_tenth_at_most(catalogue):
    choice = ActorChoice(catalogue, 0)
    near, far = choice.look(actor(size=(3.7, 1.7, 1.4))), actor(size=(6.0, 2, 2), name="far")
    assert near.selections["body"] == "small"
    assert near.scale == pytest.approx(3.7 / 3.6)
    assert near.size[0] == pytest.approx(3.7)
    assert choice.look(far).size[0] == pytest.approx(4.8 * 1.1)
    looks = [near, choice.look(far), choice.look(actor("bus", name="b"))]
    issues = size_issues([actor(size=(3.7, 1.7, 1.4)), far, actor("bus", name="b")], looks, "t")
    assert [issue.kind for issue in issues] == ["traffic.no_asset", "traffic.size"]
    assert (
        "1 actors have no asset of their size; the largest misfit: far, 6.00 m" in issues[1].message
    )


def test_names_choose_and_liveries_are_seldom(catalogue):
    choice = ActorChoice(catalogue, 0)
    assert choice.look(actor(model="car_police")).selections["body"] == "police"
    red = [choice.look(actor(model="car_red", name=str(k))).selections["paint"] for k in range(20)]
    assert set(red) == {"red"}
    drawn = [choice.look(actor(name=str(k))).selections for k in range(400)]
    police = sum(each["body"] == "police" for each in drawn)
    # One in a hundred; with equal weights it would be half of them.
    assert police < 20
    blue = sum(each["paint"] == "blue" for each in drawn)
    assert 150 < blue < 250
    again = ActorChoice(catalogue, 0).look(actor(name="7"))
    assert again.selections == drawn[7]


def written(tmp_path, catalogue, who, places, lifts=None):
    """The layer of an actor that moves along x, opened with its library."""
    look = ActorChoice(catalogue, 0).look(who)
    frames = np.arange(len(places))
    spots = np.stack([places, 0 * places, 0 * places], axis=1)
    wheels = np.zeros((len(places), max(len(look.contacts()), 1))) if lifts is None else lifts
    motion = Motion(who, frames, spots, np.zeros((len(places), 3)), places - places[0],
                    ((0, len(places) - 1),), wheels)  # fmt: skip
    path = tmp_path / "traffic.usda"
    write_traffic([motion], [look], 10.0, "t", str(catalogue.folder), path, {})
    return Usd.Stage.Open(str(path)), look


def test_wheels_roll_without_sliding(tmp_path, catalogue):
    places = np.linspace(0.0, 3.0, 31)
    stage, look = written(tmp_path, catalogue, actor(size=(5.0, 1.8, 1.5)), places)
    wheel = UsdGeom.Xformable(stage.GetPrimAtPath("/World/Traffic/a/Geometry/WheelFrontLeft"))
    axle, radius = np.array([1.2, 0.7, 0.3]), RADIUS * look.scale

    def at(frame, point):
        return np.array(
            wheel.ComputeLocalToWorldTransform(frame).Transform(tuple(map(float, point)))
        )

    for frame in range(0, 30, 7):
        np.testing.assert_allclose(
            at(frame, axle), axle * look.scale + [places[frame], 0, 0], atol=1e-6
        )
        # The point of the tyre that touches the road does not move; the top moves twice as fast.
        turn = places[frame] / radius
        for way, speed in ((-1.0, 0.0), (1.0, 2.0)):
            spot = axle + way * RADIUS * np.array([-np.sin(turn), 0.0, np.cos(turn)])
            moved = at(frame + 0.01, spot) - at(frame, spot)
            np.testing.assert_allclose(moved, [speed * 0.001, 0, 0], atol=2e-5)


def test_moving_vehicles_are_lit_and_light_the_road_before_them(tmp_path, catalogue):
    """The beam's axis meets the road 0.65 m / tan(6.5 degrees) before the lamp."""
    stage, look = written(tmp_path, catalogue, actor(size=(4.4, 1.8, 1.5)), np.arange(0.0, 3.0))
    assert look.selections["lights"] == "on"
    lamp = stage.GetPrimAtPath("/World/Traffic/a/LowBeam")
    for code in (0, 2):
        matrix = UsdGeom.Xformable(lamp).ComputeLocalToWorldTransform(code)
        place = np.array(matrix.ExtractTranslation())
        beam = np.array(matrix.TransformDir((0.0, 0.0, -1.0)))
        spot = place - beam * place[2] / beam[2]
        away = 0.65 * look.scale / np.tan(np.radians(6.5))
        np.testing.assert_allclose(spot, [code + 2.2 + 0.03 + away, 0.0, 0.0], atol=1e-3)
    power = lamp.GetAttribute("inputs:intensity").Get() * STAGE_UNIT
    assert lamp.GetAttribute("inputs:normalize").Get()
    assert power == pytest.approx(3.0)  # klx at 1 m on the axis
    (tmp_path / "w").mkdir()
    walker, _ = written(
        tmp_path / "w", catalogue, actor("pedestrian", (0.4, 0.4, 1.8)), np.zeros(2)
    )
    assert not walker.GetPrimAtPath("/World/Traffic/a/LowBeam")


def test_wheels_follow_the_surface(tmp_path, catalogue):
    lifts = np.zeros((3, 4))
    lifts[1, 0] = 0.03
    stage, look = written(tmp_path, catalogue, actor(), np.zeros(3), lifts)
    wheel = UsdGeom.Xformable(stage.GetPrimAtPath("/World/Traffic/a/Geometry/WheelFrontLeft"))
    heights = [
        wheel.ComputeLocalToWorldTransform(frame).Transform((1.2, 0.7, 0.3))[2]
        for frame in (0, 1, 2)
    ]
    np.testing.assert_allclose(heights, np.array([0, 0.03, 0]) + 0.3 * look.scale, atol=1e-6)


@pytest.mark.parametrize(("sense", "radius"), [(1.0, 9.0), (-1.0, 9.0), (1.0, -30.0)])
def test_front_wheels_roll_around_the_centre_of_the_bend(tmp_path, catalogue, sense, radius):
    """Ahead and back, to the left and to the right: no wheel slides sideways."""
    who = actor(size=(4.8, 1.8, 1.5))
    look = ActorChoice(catalogue, 0).look(who)
    way = sense * np.linspace(0.0, 8.0, 81)
    headings = way / radius
    centre = np.array([0.0, radius])
    # The rear axle, 1.2 m behind the middle, is on the circle.
    rear = centre + radius * np.stack([np.sin(headings), -np.cos(headings)], axis=1)
    ahead = np.stack([np.cos(headings), np.sin(headings)], axis=1)
    places = np.column_stack([rear + 1.2 * ahead, 0 * way])
    turns = np.column_stack([0 * way, 0 * way, headings])
    motion = Motion(who, np.arange(81), places, turns, way, ((0, 80),), np.zeros((81, 4)))
    write_traffic([motion], [look], 10.0, "t", str(catalogue.folder), tmp_path / "t.usda", {})
    stage = Usd.Stage.Open(str(tmp_path / "t.usda"))
    wheel = UsdGeom.Xformable(stage.GetPrimAtPath("/World/Traffic/a/Geometry/WheelFrontLeft"))
    for frame in (0, 37, 80):
        matrix = wheel.ComputeLocalToWorldTransform(frame)
        axle = np.array(matrix.TransformDir((0.0, 1.0, 0.0)))[:2]
        front = places[frame, :2] + 1.2 * ahead[frame]
        out = (centre - front) / np.linalg.norm(centre - front) * np.sign(radius)
        np.testing.assert_allclose(axle, out, atol=2e-3)


def test_wheels_of_a_bicycle_roll_through_the_turn_of_its_pedals(tmp_path):
    """The pose changes four times a turn; the wheel that is seen rolls on without sliding."""
    way = np.linspace(0.0, 12.0, 61) ** 1.05
    who = actor("bicycle", (1.8, 0.6, 1.75))
    stage, look = written(tmp_path, read_catalogue(), who, way)
    assert len(look.cycle) == 4
    seen = set()
    for frame in range(60):
        (shown,) = [
            prim
            for prim in stage.GetPrimAtPath("/World/Traffic/a").GetAllChildren()
            if UsdGeom.Imageable(prim).ComputeVisibility(frame) == "inherited"
        ]
        seen.add(shown.GetName())
        for wheel, end in enumerate(("Front", "Rear")):
            axle = look.wheels[wheel]
            for part in ("Tyre", "Rim"):
                mesh = UsdGeom.Xformable(shown.GetPrimAtPath(f"Geometry/{part}{end}"))
                turn = (way[frame] - way[0]) / (look.radius * look.scale)
                spot = axle + look.radius * np.array([np.sin(turn), 0.0, -np.cos(turn)])
                low = [
                    np.array(
                        mesh.ComputeLocalToWorldTransform(code).Transform(tuple(spot.tolist()))
                    )
                    for code in (frame, frame + 0.01)
                ]
                assert low[0][2] == pytest.approx(0.0, abs=1e-3)
                np.testing.assert_allclose(low[1], low[0], atol=2e-4)
    assert seen == set(look.cycle)


def test_samples_are_those_that_linear_interpolation_needs():
    frames = np.array([0, 1, 2, 3, 4, 5, 8, 9, 10])
    line = 0.5 * frames
    bent = np.where(frames > 3, line + 2.0 * (frames - 3), line)
    wave = np.sin(frames / 2.0)
    assert np.flatnonzero(needed_rows(line[:, None], frames, 1e-4)).tolist() == [0, 5, 6, 8]
    both = needed_rows(np.stack([line, bent], axis=1), frames, 1e-4)
    assert np.flatnonzero(both).tolist() == [0, 3, 5, 6, 8]
    for tolerance in (1e-3, 0.1, 0.5):
        kept = needed_rows(wave[:, None], frames, tolerance)
        again = np.interp(frames, frames[kept], wave[kept])
        assert np.abs(again - wave).max() <= tolerance
    assert needed_rows(np.zeros((1, 3)), np.array([4]), 1e-4).tolist() == [True]


def test_wheels_of_a_car_at_rest_stay(tmp_path, catalogue):
    stage, _ = written(tmp_path, catalogue, actor(), np.zeros(3))
    wheel = stage.GetPrimAtPath("/World/Traffic/a/Geometry/WheelFrontLeft")
    assert not wheel.HasAttribute("xformOp:rotateZ")


def test_people_walk_by_the_way_and_stand_still(tmp_path, catalogue):
    way = np.concatenate([np.arange(0, 2.41, 0.15), np.full(8, 2.4)])
    stage, look = written(tmp_path, catalogue, actor("pedestrian", (0.4, 0.4, 1.8), name="p"), way)
    assert look.cycle == ("walk_0", "walk_1", "walk_2", "walk_3")
    poses = stage.GetPrimAtPath("/World/Traffic/p").GetAllChildren()
    assert {prim.GetName() for prim in poses} == {*look.cycle, "standing"}
    assert all(prim.IsInstanceable() for prim in poses)

    def shown(frame):
        seen = [
            prim.GetName()
            for prim in poses
            if UsdGeom.Imageable(prim).ComputeVisibility(frame) == "inherited"
        ]
        (name,) = seen
        return name

    # A cycle of 1.2 m in four poses: a new pose each 0.3 m, so each second frame.
    walked = [shown(frame) for frame in range(8)]
    assert walked == [
        "walk_0",
        "walk_0",
        "walk_1",
        "walk_1",
        "walk_2",
        "walk_2",
        "walk_3",
        "walk_3",
    ]
    assert shown(9) == "walk_0"
    assert [shown(frame) for frame in (20, 22, 24)] == ["standing"] * 3


def test_the_environment_weights_bodies_and_paints(catalogue):
    variants = {"body": {"large": 3.0, "police": 1.0}, "paint": {"blue": 1.0, "red": 4.0}}
    choice = ActorChoice(catalogue, 0, {"car": PropRules(variants=variants)})
    looks = [choice.look(actor(name=str(k))).selections for k in range(400)]
    assert np.mean([look["paint"] == "red" for look in looks]) == pytest.approx(0.8, abs=0.06)
    assert np.mean([look["body"] == "police" for look in looks]) == pytest.approx(0.25, abs=0.07)
    weights = {name: weight for _, name, _, weight in choice.bodies()}
    assert weights["car_large"] == 3.0
    assert weights["car_small"] < 1e-3  # left out by the environment, but it may be the only fit
