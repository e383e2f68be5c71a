"""The package: OpenUSD's validators, OpenMATERIAL's documented structure, the road's bytes."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from pxr import Usd, UsdGeom, UsdValidation
from tests.exchange.gltf_files import sums_of_stage
from tests.exchange.open_material_rules import OF_SUFFIX
from tests.kept_work import kept

from envgen_usd.errors import EnvgenError
from envgen_usd.exchange.stage_package import PackageResult, package_environment


@pytest.fixture(scope="module")
def packed(environment: Path, tmp_path_factory: pytest.TempPathFactory) -> PackageResult:
    road = environment.parent / "street.xodr"

    def make(folder: Path) -> PackageResult:
        return package_environment(environment, folder / "town", road=road)

    return kept(tmp_path_factory, "exchange_package", make)


def content(path: Path) -> dict:
    return json.loads(path.read_text())


def test_the_usdz_is_valid_and_shows_the_stage(packed, environment):
    registry = UsdValidation.ValidationRegistry()
    context = UsdValidation.ValidationContext(registry.GetOrLoadAllValidators())
    stage = Usd.Stage.Open(str(packed.stage))
    assert [error.GetMessage() for error in context.Validate(stage)] == []
    instances = Usd.TraverseInstanceProxies()
    counts = [
        sum(prim.IsA(UsdGeom.Mesh) for prim in each.Traverse(instances))
        for each in (stage, Usd.Stage.Open(str(environment / "stage.usda")))
    ]
    assert counts[0] == counts[1] > 100


def test_all_files_obey_the_published_schemas(packed):
    files = [path for path in packed.asset.parent.rglob("*.xom*") if path.is_file()]
    assert {path.suffix for path in files} == set(OF_SUFFIX)
    assert len(files) > 40
    faults = [f for path in files for f in OF_SUFFIX[path.suffix](content(path), path.name)]
    assert faults == []


@pytest.mark.parametrize(
    ("suffix", "change"),
    [
        (".xoma", lambda asset: asset["metadata"].pop("boundingBox")),
        (".xoma", lambda asset: asset["metadata"].update(textureResolutions=["3K"])),
        (".xomm", lambda table: table["materialMapping"][0].pop()),
        (".xomp", lambda look: look["materialProperties"].update(brdfUris=["a.xompt"])),
        (".xompt", lambda table: table["brdf"]["lookupTable"][0].__setitem__(1, 2.0)),
        (".xompt", lambda table: table["metadata"].update(uuid="1")),
    ],
)
def test_the_rules_find_faults(packed, suffix, change):
    path = next(iter(packed.asset.parent.rglob(f"*{suffix}")))
    broken = content(path)
    change(broken)
    assert len(list(OF_SUFFIX[suffix](broken, path.name))) == 1


def test_the_asset_says_what_the_stage_holds(packed, environment):
    asset = content(packed.asset)
    head = asset["metadata"]
    truth = sums_of_stage(environment / "stage.usda")
    assert head["triangleCount"] == sum(truth.triangles.values())
    box = np.array([head["boundingBox"][axis] for axis in "xyz"]).T
    assert (box[0] <= truth.low + 1e-3).all()
    assert (box[1] >= truth.high - 1e-3).all()
    assert (packed.asset.parent / asset["materialMappingUri"]).is_file()


def test_every_material_of_the_stage_has_a_file(packed, environment):
    stage = Usd.Stage.Open(str(environment / "stage.usda"))
    rows = content(packed.asset.with_suffix(".xomm"))["materialMapping"]
    names = {prim.GetName() for prim in stage.GetPrimAtPath("/World/Materials").GetChildren()}
    assert {name for name, _, _ in rows} == set(packed.materials) <= names
    assert {"asphalt", "grass", "glass"} & set(packed.materials)
    for name, file, _ in rows:
        material = content(packed.asset.parent / file)
        assert material["metadata"]["name"] == name
        for table in material["materialProperties"]["brdfUris"]:
            brdf = content((packed.asset.parent / file).parent / table)
            rows_of_table = brdf["brdf"]["lookupTable"]
            assert rows_of_table == sorted(rows_of_table)
            assert {row[0] for row in rows_of_table} == set(brdf["brdf"]["wavelengths"])
            assert all(0.0 <= row[4] <= 1.0 / math.pi for row in rows_of_table)


def test_albedo_is_that_of_the_texture(packed, environment):
    name = next(each for each in packed.materials if each.startswith("asphalt"))
    image = Image.open(environment / "textures" / f"{name}_colour.jpg").convert("RGB")
    values = np.asarray(image, float) / 255.0
    linear = np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)
    material = content(packed.asset.parent / "materials" / f"{name}.xomp")["materialProperties"]
    albedo = material["customProperties"]["albedo"]
    assert albedo == pytest.approx(linear.mean(axis=(0, 1)), abs=2e-3)
    assert 0.03 < albedo[1] < 0.2
    assert material["emissivityData"]["emissivityCoefficient"] == 0.93


def test_the_road_is_that_of_the_build(packed, environment, tmp_path):
    original = environment.parent / "street.xodr"
    assert packed.road is not None
    assert packed.road.read_bytes() == original.read_bytes()
    other = tmp_path / "other.xodr"
    other.write_bytes(original.read_bytes() + b"\n")
    with pytest.raises(EnvgenError, match="is not the road"):
        package_environment(environment, tmp_path / "out", road=other)
    with pytest.raises(EnvgenError, match="no such file"):
        package_environment(environment, tmp_path / "out", road=tmp_path / "none.xodr")
    assert not (tmp_path / "out").exists()
