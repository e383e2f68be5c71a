"""Wheels on a road with hills, a bend and a bank, against the closed form of its surface."""

from collections import defaultdict

import numpy as np
import pytest
from pxr import Usd, UsdGeom
from tests.kept_work import kept

from envgen_usd.recipe.build_options import BuildOptions
from envgen_usd.recipe.environment_build import build
from envgen_usd.recipe.traffic_build import add_traffic
from envgen_usd.traffic.traces.esmini_csv import read_csv_trace

LENGTH, RADIUS, LANE = 110.0, 120.0, 3.5
RISE, FALL, TWIST = 0.08, -0.0012, 0.0008
"""Slope at the begin, change of it by metre / 2, and change of the bank by metre, radians."""
ROAD = f"""<OpenDRIVE><header revMajor="1" revMinor="7"/>
<road id="1" name="" length="{LENGTH}" junction="-1"><link/>
<type s="0" type="town"><speed max="50" unit="km/h"/></type>
<planView><geometry s="0" x="0" y="20" hdg="0" length="{LENGTH}"><arc curvature="{1 / RADIUS}"/>
</geometry></planView>
<elevationProfile><elevation s="0" a="3" b="{RISE}" c="{FALL}" d="0"/></elevationProfile>
<lateralProfile><superelevation s="0" a="-0.04" b="{TWIST}" c="0" d="0"/></lateralProfile>
<lanes><laneSection s="0"><left><lane id="1" type="driving"><width sOffset="0" a="{LANE}" b="0"
c="0" d="0"/></lane></left><center><lane id="0" type="none"/></center><right><lane id="-1"
type="driving"><width sOffset="0" a="{LANE}" b="0" c="0" d="0"/></lane></right></laneSection>
</lanes></road></OpenDRIVE>"""
HEADER = "time,id,kind,length,width,height,x,y,h\n"
SPEED = 9.0


def height(points):
    """Height of the road at points in plan, N x 2: of the reference line, and t sin(bank).

    The cross section is square to the reference line in plan; the bank moves it by t (1 - cos),
    which is less than 3 mm here.
    """
    out = points - [0.0, 20.0 + RADIUS]
    s = RADIUS * np.arctan2(out[:, 0], -out[:, 1])
    t = RADIUS - np.linalg.norm(out, axis=1)
    bank = -0.04 + TWIST * s
    return 3.0 + RISE * s + FALL * s**2 + t * np.tan(bank)


@pytest.fixture(scope="module")
def hills(tmp_path_factory):
    """The road with a car and a long bus, one on each lane."""
    town, result = kept(tmp_path_factory, "traffic_hills", built_hills)
    return Usd.Stage.Open(str(town / "stage.usda")), result


def built_hills(folder):
    road = folder / "hills.xodr"
    road.write_text(ROAD)
    build(BuildOptions(road, "1", "industrial", folder / "town", workers=1, actors=False))
    rows = []
    for name, kind, size, t, way in (
        ("car", "car", (4.5, 1.8, 1.5), -1.75, 1.0),
        ("bus", "bus", (12.0, 2.55, 3.1), 1.75, -1.0),
    ):
        for time in np.arange(0.0, 9.01, 0.1).tolist():
            s = 12.0 + SPEED * time if way > 0 else LENGTH - 12.0 - SPEED * time
            angle, away = s / RADIUS, RADIUS - t
            x, y = away * np.sin(angle), 20.0 + RADIUS - away * np.cos(angle)
            heading = angle if way > 0 else angle + np.pi
            rows.append(
                f"{time:.2f},{name},{kind},{','.join(map(str, size))},{x:.5f},{y:.5f},{heading:.6f}"
            )
    trace = folder / "trace.csv"
    trace.write_text(HEADER + "\n".join(rows) + "\n")
    result = add_traffic(folder / "town", lambda: read_csv_trace(trace))
    return folder / "town", result


def wheels_at(prim, time):
    """Points of each wheel, world: of its tyre and its rim, which turn about one axle."""
    found = defaultdict(list)
    for each in Usd.PrimRange(prim):
        if each.IsA("Mesh") and each.HasAttribute("xformOp:rotateY"):
            matrix = np.array(UsdGeom.Xformable(each).ComputeLocalToWorldTransform(time))
            points = np.array(UsdGeom.Mesh(each).GetPointsAttr().Get(), float)
            axle = each.GetAttribute("xformOp:translate:axle").Get()
            found[tuple(axle)].append(points @ matrix[:3, :3] + matrix[3, :3])
    return [np.concatenate(meshes) for meshes in found.values()]


@pytest.mark.parametrize("name", ["car", "bus"])
def test_no_wheel_floats_or_sinks_more_than_a_centimetre(hills, name):
    stage, _ = hills
    prim = stage.GetPrimAtPath(f"/World/Traffic/{name}")
    gaps = []
    for code in np.arange(0.0, 90.1, 6.5).tolist():
        wheels = wheels_at(prim, code)
        assert len(wheels) == 4
        gaps += [np.min(points[:, 2] - height(points[:, :2])) for points in wheels]
    assert np.abs(gaps).max() < 0.01


def test_the_road_turns_the_body(hills):
    """Pitch and roll are those of the slope and of the bank below it."""
    stage, result = hills
    assert [issue.kind for issue in result.issues if issue.kind == "traffic.outside"] == []
    prim = UsdGeom.Xformable(stage.GetPrimAtPath("/World/Traffic/car"))
    for code in (0.0, 45.0, 90.0):
        matrix = prim.ComputeLocalToWorldTransform(code)
        ahead, left = (np.array(matrix.TransformDir(axis)) for axis in ((1, 0, 0), (0, 1, 0)))
        s = 12.0 + SPEED * code / 10.0
        slope = (RISE + 2 * FALL * s - 1.75 * TWIST) * RADIUS / (RADIUS + 1.75)
        assert ahead[2] / np.linalg.norm(ahead[:2]) == pytest.approx(slope, abs=2e-3)
        assert left[2] / np.linalg.norm(left[:2]) == pytest.approx(-0.04 + TWIST * s, abs=2e-3)
