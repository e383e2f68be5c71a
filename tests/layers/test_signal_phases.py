"""Traffic lights: lit lenses of each phase, and the phases of a junction."""

import numpy as np
import pytest
from pxr import Usd, UsdShade

from envgen_usd.assets.asset_catalogue import read_catalogue
from envgen_usd.assets.variant_choice import Choice
from envgen_usd.layers.signal_phases import with_phase
from envgen_usd.models.city_model import CityObject, Placement

LIBRARY = read_catalogue()
ASSET = LIBRARY.assets["traffic_light"]
GO = {"green", "amber", "red_amber"}


def light(x, heading, **attributes):
    place = Placement(np.array([x, 20.0, 0.0]), heading, np.zeros(3), "traffic_light")
    return CityObject("light", "CityFurniture", attributes, placement=place), place


def phase(x, heading, seed, **attributes):
    choice = with_phase(Choice(ASSET, {"design": "post"}), *light(x, heading, **attributes), seed)
    return choice.selections["phase"], choice.selections["design"]


def test_lights_of_a_junction_agree_and_crossing_roads_do_not_both_go():
    found = set()
    for seed in range(60):
        ahead, crossing = phase(10.0, 0.1, seed)[0], phase(40.0, np.pi / 2, seed)[0]
        assert phase(60.0, np.pi, seed)[0] == ahead, "both directions of a road"
        assert not {ahead, crossing} <= GO
        found |= {ahead, crossing}
    assert {"red", "green"} <= found
    far = {phase(10.0 + 1000 * k, 0.0, 0)[0] for k in range(40)}
    assert {"red", "green"} <= far, "another junction is another draw"


def test_lights_of_pedestrians_have_two_lenses():
    shown = {phase(10.0, 0.0, seed, opendrive_type="1000002") for seed in range(40)}
    assert shown == {("red", "pedestrian"), ("green", "pedestrian")}


@pytest.mark.parametrize("design", ASSET.variants["design"])
@pytest.mark.parametrize(
    ("chosen", "lit"),
    [
        ("red", {"Red"}),
        ("red_amber", {"Red", "Amber"}),
        ("amber", {"Amber"}),
        ("green", {"Green"}),
        ("off", set()),
    ],
)
def test_a_phase_lights_its_lenses_alone(design, chosen, lit):
    stage = Usd.Stage.Open(str(LIBRARY.folder / ASSET.path))
    stage.SetEditTarget(stage.GetSessionLayer())
    for name, variant in (("design", design), ("phase", chosen)):
        stage.GetDefaultPrim().GetVariantSet(name).SetVariantSelection(variant)
    lenses = [
        prim for prim in stage.Traverse() if prim.GetName() in {"Red", "Amber", "Green"}
    ]  # fmt: skip
    glowing = set()
    for lens in lenses:
        material, _ = UsdShade.MaterialBindingAPI(lens).ComputeBoundMaterial()
        surface, _, _ = material.ComputeSurfaceSource()
        emission = surface.GetInput("emissiveColor")
        if emission and sum(emission.Get()) > 0.1:
            glowing.add(lens.GetName())
    assert glowing == lit & {lens.GetName() for lens in lenses}
