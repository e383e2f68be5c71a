"""Actors on the page in a headless browser: they are shown, named, labelled, and hidden."""

import threading
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from tests.exchange.browser import Browser, chromium
from tests.exchange.conftest import ACTORS
from tests.exchange.gltf_files import sums_of_gltf
from tests.exchange.test_viewer import READY, look, photograph

from envgen_usd.exchange.viewer.page_server import PageServer
from envgen_usd.label_taxonomy import label

PLACES = {name: place for name, (_, _, begin, place) in ACTORS.items() if begin == 0.0}
"""x, y and speed of those who are there at the start, in the frame of the road."""


@pytest.fixture(scope="module")
def page(files: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    """The page of a street with parked and moving actors."""
    chromium()
    with PageServer(files) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        opened = Browser(tmp_path_factory.mktemp("profile"))
        opened.open(f"{server.url}?camera=12,1.7,1.6,60,2,1.6")
        opened.wait_for(READY)
        yield opened
        opened.close()
        server.shutdown()
        thread.join()


def stand_beside(page: Browser, name: str, high: float) -> None:
    """Looks at the middle of an actor from 4 m away, across the road; y is up in the page."""
    x, y, _ = PLACES[name]
    side = -np.sign(y)
    look(page, np.array((x, 1.6, -(y + 4.0 * side))), np.array((x, high, -y)))
    page.value("new Promise((done) => setTimeout(done, 1500))")


@pytest.mark.parametrize(
    ("name", "high", "kind", "of_class"),
    [("ahead", 0.7, "car", "car"), ("walker", 1.1, "pedestrian", "person"),
     ("rider", 0.75, "bicycle", "bicycle")],
)  # fmt: skip
def test_a_click_names_a_moving_actor(page, name, high, kind, of_class):
    stand_beside(page, name, high)
    page.click(320, 200)
    page.wait_for("document.querySelector('#facts table') !== null")
    text = page.value("document.querySelector('#facts').innerText").lower()
    for word in (name, kind, of_class, f"/world/traffic/{name}"):
        assert word in text


def test_a_moving_actor_has_the_colour_of_its_class(page, tmp_path):
    stand_beside(page, "ahead", 0.7)
    page.value("envgen.setLabels(true)")
    picture = photograph(page, tmp_path / "labels.png")
    page.value("envgen.setLabels(false)")
    assert tuple(picture[200, 320]) == label("car").colour


def test_layers_of_parked_and_moving_actors_are_switched_apart(page, files):
    """The page hides exactly what the file of the moving actors holds near by."""
    names = page.value("[...document.querySelectorAll('#layers label')].map((e) => e.innerText)")
    assert [name.strip() for name in names][-2:] == ["Actors", "Traffic"]
    stand_beside(page, "ahead", 0.7)
    shown = "envgen.render(), envgen.report().triangles"
    everything = page.value(shown)
    rest = {}
    for name in ("Actors", "Traffic"):
        page.value(f"envgen.setLayer('{name}', false)")
        rest[name] = everything - page.value(shown)
        page.value(f"envgen.setLayer('{name}', true)")
    assert page.value(shown) == everything
    in_file = sums_of_gltf([files / "Traffic.glb"]).triangles
    assert rest["Actors"] > 1000
    assert 1000 < rest["Traffic"] <= sum(in_file.values())
    page.click(320, 200)
    page.wait_for("document.querySelector('#facts').innerText.includes('ahead')")
    page.value("envgen.setLayer('Traffic', false)")
    page.click(320, 200)
    page.wait_for("!document.querySelector('#facts').innerText.includes('ahead')")
    page.value("envgen.setLayer('Traffic', true)")
