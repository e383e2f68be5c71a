"""The MaterialX files of the shipped library: nodes of its standard library, files that exist."""

from pathlib import Path
from xml.etree import ElementTree as ET

import pytest

from envgen_usd.assets.asset_catalogue import read_catalogue

FOLDER = Path(str(read_catalogue().folder)) / "materials"
DOCUMENTS = sorted(FOLDER.glob("*.mtlx"))
INPUTS = {"file", "texcoord", "rotationrange", "scalerange"}
"""Inputs of ND_hextiledimage_color3 and ND_hextilednormalmap_vector3 of MaterialX 1.39."""


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: path.stem)
def test_a_document_bombs_the_textures_of_its_material(path):
    root = ET.parse(path).getroot()
    names = {node.get("name") for node in root}
    assert root.find("surfacematerial").get("name") == path.stem
    bombed = [*root.iter("hextiledimage"), *root.iter("hextilednormalmap")]
    assert bombed
    for node in bombed:
        given = {each.get("name"): each for each in node}
        assert set(given) == INPUTS
        assert (FOLDER / given["file"].get("value")).is_file()
    links = {each.get("nodename") for each in root.iter("input")} - {None}
    assert links <= names


def test_ground_has_documents_and_bricks_have_none():
    names = {path.stem for path in DOCUMENTS}
    assert {"asphalt", "grass", "rubble", "gravel"} <= names
    assert not {"brick_red", "paving", "roof_slate"} & names
