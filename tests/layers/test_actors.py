"""The actors layer: instances at their poses, labels, muting, metadata alone."""

import numpy as np
import pytest
from pxr import Sdf, Usd, UsdGeom, UsdValidation
from tests.kept_work import kept

from envgen_usd.assets.asset_catalogue import read_catalogue
from envgen_usd.chunks import Chunk
from envgen_usd.layers.actors_layer import write_actors
from envgen_usd.layers.parked_looks import missing_kinds, parked_looks
from envgen_usd.layers.stage_composition import compose_stage
from envgen_usd.models.parked_actors import ParkedActor

CHUNK = Chunk(-1, 2)


@pytest.fixture(scope="module")
def looks(scene):
    return parked_looks(scene.profile, scene.catalogue)


@pytest.fixture(scope="module")
def actors(looks):
    look = looks["wheelie_bin"][0]
    origin = np.array([*CHUNK.origin, 0.0])
    poses = [(10.0, 20.0, 0.5, 0.3, 0.0, 0.0), (30.0, 40.0, 1.0, -2.5, 0.04, -0.07)]
    return [
        ParkedActor(f"bin_{n}", look, origin + p[:3], p[3], "sidewalk", p[4], p[5])
        for n, p in enumerate(poses)
    ]


@pytest.fixture(scope="module")
def stage_file(scene, make, actors, tmp_path_factory):
    return kept(
        tmp_path_factory, "layers_actors", lambda out: write_stage(scene, make, actors, out)
    )


def write_stage(scene, make, actors, out):
    one = type(scene)(scene.profile, scene.catalogue, (CHUNK,))
    one.write(out)
    path = out / "chunks" / CHUNK.name / "actors.usdc"
    write_actors(actors, CHUNK, scene.profile, scene.catalogue, 0, path)
    surface = make.surface()
    return compose_stage(out, one.chunks, surface, scene.profile, scene.catalogue, actors=True)


@pytest.fixture
def stage(stage_file):
    return Usd.Stage.Open(str(stage_file))


PRIMS = f"/World/{CHUNK.prim_name}/Actors"


def test_actors_stand_at_their_poses(stage, actors):
    for actor in actors:
        prim = stage.GetPrimAtPath(f"{PRIMS}/{actor.id}")
        assert prim.IsInstance()
        matrix = np.array(UsdGeom.XformCache().GetLocalToWorldTransform(prim)).T
        assert np.allclose(matrix[:3, 3], actor.position, atol=1e-4)
        front, left, up = matrix[:3, :3].T
        assert np.allclose(np.linalg.norm(matrix[:3, :3], axis=0), 1.0)
        assert np.arctan2(front[1], front[0]) == pytest.approx(actor.heading, abs=1e-5)
        assert np.arcsin(front[2]) == pytest.approx(actor.pitch, abs=1e-5)
        assert np.arcsin(left[2] / np.cos(actor.pitch)) == pytest.approx(actor.roll, abs=1e-5)
        assert up[2] > 0.9


def test_actors_carry_their_label_and_what_is_known(stage, actors):
    prim = stage.GetPrimAtPath(f"{PRIMS}/{actors[1].id}")
    facts = {
        a.GetBaseName(): a.Get() for a in prim.GetAttributes() if "userProperties" in a.GetName()
    }
    assert facts["gml_id"] == "bin_1"
    assert facts["category"] == "wheelie_bin"
    assert facts["place"] == "sidewalk"
    assert facts["segmentation_class"] == "static"
    assert "EnvgenActorAPI" in prim.GetAppliedSchemas()
    assert prim.GetAttribute("semantics:labels:class").Get()[0] == "static"


def test_muting_the_layer_empties_the_streets(stage):
    layers = [layer.identifier for layer in stage.GetLayerStack(includeSessionLayers=False)]
    (muted,) = [name for name in layers if name.endswith("layers/actors.usda")]
    assert stage.GetPrimAtPath(PRIMS).GetChildren()
    stage.MuteLayer(muted)
    assert not stage.GetPrimAtPath(PRIMS)
    assert stage.GetPrimAtPath(f"/World/{CHUNK.prim_name}/Props").GetChildren()


def test_it_is_the_strongest_layer_of_the_chunks(stage):
    names = [path.split("/")[-1] for path in stage.GetRootLayer().subLayerPaths]
    assert names.index("actors.usda") == names.index("props.usda") - 1


def test_a_stage_without_actors_has_no_such_layer(scene, make, stage_file):
    out = stage_file.parent.parent / "again"
    one = type(scene)(scene.profile, scene.catalogue, (CHUNK,))
    one.write(out)
    write_actors(
        [], CHUNK, scene.profile, scene.catalogue, 0, out / "chunks" / CHUNK.name / "actors.usdc"
    )
    compose_stage(out, one.chunks, make.surface(), scene.profile, scene.catalogue, actors=True)
    assert (out / "layers" / "actors.usda").exists()
    stage = Usd.Stage.Open(str(one.compose(out)))
    assert not (out / "layers" / "actors.usda").exists()
    assert not stage.GetPrimAtPath(PRIMS)


def test_validators_of_openusd_find_nothing(stage):
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    errors = UsdValidation.ValidationContext(validators).Validate(stage)
    assert [error.GetErrorAsString() for error in errors] == []


def test_metadata_alone_has_no_references(scene, actors, tmp_path):
    path = tmp_path / "actors.usdc"
    library = read_catalogue(embed=False)
    write_actors(actors, CHUNK, scene.profile, library, 0, path, metadata_only=True)
    layer = Sdf.Layer.FindOrOpen(str(path))
    for actor in actors:
        prim = layer.GetPrimAtPath(f"/Actors/{actor.id}")
        assert not prim.hasReferences
        assert prim.attributes["userProperties:asset_path"].default.endswith("wheelie_bin.usda")
        assert "extentsHint" in prim.attributes


def test_the_environment_weights_the_variants_that_change_no_size(scene, actors, looks, tmp_path):
    path = tmp_path / "actors.usdc"
    many = [
        ParkedActor(f"bin_{n}", looks["wheelie_bin"][0], actors[0].position, 0.0, "sidewalk")
        for n in range(300)
    ]
    write_actors(many, CHUNK, scene.profile, scene.catalogue, 0, path)
    layer = Sdf.Layer.FindOrOpen(str(path))
    lids = [prim.variantSelections["lid"] for prim in layer.GetPrimAtPath("/Actors").nameChildren]
    weights = scene.profile.props["wheelie_bin"].variants["lid"]
    for lid, weight in weights.items():
        share = weight / sum(weights.values())
        assert lids.count(lid) / 300 == pytest.approx(share, abs=0.09)


def test_kinds_that_the_library_lacks_are_named(scene):
    issues = missing_kinds(scene.profile, {})
    assert {"car", "pedestrian"} <= {issue.message.split("'")[1] for issue in issues}
    assert all(scene.profile.source in issue.where for issue in issues)
