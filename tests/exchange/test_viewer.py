"""The page in a headless browser, and what its server gives away."""

import http.client
import json
import shutil
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from tests.exchange.browser import Browser, chromium
from tests.exchange.gltf_files import Gltf

from envgen_usd.errors import EnvgenError
from envgen_usd.exchange.viewer.page_server import PageServer, file_at
from envgen_usd.label_taxonomy import label

READY = "window.envgen && envgen.report().ready && envgen.report().triangles > 1000"
STREET = "camera=12,1.7,1.6,60,2,1.6"
"""On the right lane of the road, which runs along x; z points to the south."""


@pytest.fixture(scope="module")
def exported(exported: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy, into which a test puts files that are not served."""
    return Path(shutil.copytree(exported, tmp_path_factory.mktemp("viewed") / "gltf"))


@pytest.fixture(scope="module")
def server(exported: Path) -> Iterator[PageServer]:
    with PageServer(exported) as running:
        thread = threading.Thread(target=running.serve_forever)
        thread.start()
        yield running
        running.shutdown()
        thread.join()


@pytest.fixture(scope="module")
def page(server: PageServer, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    """The page, opened once: software needs a while for its textures."""
    chromium()
    opened = Browser(tmp_path_factory.mktemp("profile"))
    opened.open(f"{server.url}?{STREET}")
    opened.wait_for(READY)
    yield opened
    opened.close()


def look(page: Browser, eye: np.ndarray, target: np.ndarray) -> None:
    """Moves the camera of the page."""
    page.value(f"envgen.camera.position.set({','.join(map(str, eye))})")
    page.value(f"envgen.controls.target.set({','.join(map(str, target))})")
    page.value("envgen.controls.update()")


def photograph(page: Browser, path: Path) -> np.ndarray:
    """The window when it stands still."""
    page.value("new Promise((done) => setTimeout(done, 1500))")
    page.wait_for("envgen.renderer.getPixelRatio() === 1 && envgen.tiles.sight.reach === 1", 30)
    return np.asarray(Image.open(page.screenshot(path)).convert("RGB"))


def answer(server: PageServer, target: str, host: str = "") -> tuple[int, bytes]:
    connection = http.client.HTTPConnection("127.0.0.1", server.server_port)
    connection.request("GET", target, headers={"Host": host} if host else {})
    response = connection.getresponse()
    content = response.read()
    connection.close()
    return response.status, content


def test_the_page_shows_every_chunk_and_asks_no_other_host(server, page, exported, tmp_path):
    report = page.value("envgen.report()")
    assert report["loaded"] == report["all"] == len(list(exported.glob("*.glb")))
    assert report["failed"] == page.messages == []
    assert all(url.startswith((server.url, "data:", "blob:")) for url in page.requests)
    picture = photograph(page, tmp_path / "street.png")
    upper, road = picture[:100].reshape(-1, 3), picture[375:395, 330:360].reshape(-1, 3)
    blue = upper[:, 2].astype(int) - upper[:, 0] > 15
    assert blue.mean() > 0.05, "a blue sky above"
    assert np.ptp(road.mean(axis=0)) < 25, "grey asphalt below"
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 1000


def test_label_colours_are_those_of_the_taxonomy(page, tmp_path):
    page.value("envgen.setLabels(true)")
    picture = photograph(page, tmp_path / "labels.png")
    page.value("envgen.setLabels(false)")
    assert tuple(picture[390, 340]) == label("road").colour
    kinds, counts = np.unique(picture[:, 260:].reshape(-1, 3), axis=0, return_counts=True)
    seen = {tuple(kind.tolist()) for kind, count in zip(kinds, counts, strict=True) if count > 50}
    expected = {label(name).colour for name in ("road", "sidewalk", "building", "vegetation")}
    assert expected <= seen


def test_a_click_names_the_object_of_the_stage(page, exported):
    file = Gltf.of(exported / "chunk_0_0.glb")
    node, places = next(
        (node, places)
        for node, places in file.nodes()
        if node.get("extras", {}).get("common", {}).get("kind") == "street_light"
    )
    extras = node["extras"]
    names = extras["each"].get("id") or [extras["common"]["id"]]
    chunks = json.loads((exported / "tiles.json").read_text())["chunks"]
    offset = np.array(file.content["asset"]["extras"]["offset"]) - chunks[0]["offset"]
    place = places[0][:3, 3] + offset
    # Vehicles stand before the foot of a pole.
    look(page, place + np.array((2.0, 3.3, 2.0)), place + np.array((0.0, 3.2, 0.0)))
    page.click(320, 200)
    page.wait_for("document.querySelector('#facts table') !== null")
    text = page.value("document.querySelector('#facts').innerText")
    assert names[0] in text
    assert "street_light" in text
    assert "pole" in text
    assert "country" in text


def test_a_distant_chunk_is_a_few_meshes_that_know_their_objects(page, exported):
    """Instances join beyond the first ring; a click still names a single object."""
    meshes = (
        "(() => { let n = 0; envgen.tiles.group.traverse((o) => { let seen = o.isMesh; "
        "for (let e = o; e; e = e.parent) seen &&= e.visible; n += seen ? 1 : 0; }); return n; })()"
    )
    near = page.value(meshes)
    eye, target = np.array((30.0, 90.0, 600.0)), np.array((30.0, 3.0, 0.0))
    look(page, eye, target)
    page.wait_for("envgen.tiles.loaded.every((tile) => tile.ring > 0)")
    far = page.value(meshes)
    assert far < 0.5 * near
    file = Gltf.of(exported / "chunk_0_0.glb")
    offsets = [
        each["offset"] for each in json.loads((exported / "tiles.json").read_text())["chunks"]
    ]
    offset = np.array(file.content["asset"]["extras"]["offset"]) - offsets[0]
    rows = {}
    for node, places in file.nodes():
        extras = node.get("extras", {})
        if extras.get("common", {}).get("kind") == "tree":
            names = extras["each"].get("id") or [extras["common"]["id"]]
            for name, place in zip(names, places, strict=True):
                rows[name] = place[:3, 3] + offset
    seen = 0
    for name, place in list(rows.items())[:12]:
        crown, back = place + np.array((0.0, 4.0, 0.0)), np.array((10.0, 250.0, 60.0))
        look(page, crown + back, crown)
        facts = page.value("envgen.pick(320, 200)")
        if facts and facts["id"] in rows:
            stem = rows[facts["id"]] + np.linspace((0.0, 0.0, 0.0), (0.0, 20.0, 0.0), 41)
            aside = np.cross(stem - crown, back / np.linalg.norm(back))
            assert np.linalg.norm(aside, axis=1).min() < 7.0, "a tree on the line of sight"
            assert (facts["class"], facts["asset"][:5]) == ("vegetation", "tree_")
            seen += facts["id"] == name
    assert seen > 0
    look(page, np.array((12.0, 1.7, 1.6)), np.array((60.0, 2.0, 1.6)))
    page.wait_for("envgen.tiles.loaded.some((tile) => tile.ring === 0)")


def test_what_is_out_of_sight_is_not_drawn_and_nobody_sees_that(page, tmp_path):
    """The picture is that of all geometry, with fewer triangles; in any direction."""
    eye = np.array((12.0, 1.7, 1.6))
    drawn = "(envgen.render(), envgen.report().triangles)"
    everything = (
        "(() => { const { tiles } = envgen, kind = tiles.sight.constructor.prototype; "
        "const { depth } = kind; kind.depth = () => Infinity; tiles.sight = null; "
        "const all = (envgen.render(), envgen.report().triangles); "
        "kind.depth = depth; return all; })()"
    )
    fewer = []
    for angle in (0.0, 1.5, 2.4, 4.0):
        look(page, eye, eye + 30.0 * np.array((np.cos(angle), 0.0, np.sin(angle))))
        seen = photograph(page, tmp_path / "seen.png").astype(int)
        part = page.value(drawn)
        whole = page.value(everything)
        complete = photograph(page, tmp_path / "all.png").astype(int)
        fewer.append(part / whole)
        assert (np.abs(seen - complete).max(axis=2) > 8).mean() < 2e-3
        page.value("envgen.tiles.sight = null")
    assert np.mean(fewer) < 0.6


def test_far_houses_have_mean_colours_and_keep_class_and_material(page, tmp_path):
    """Software draws a distant chunk in a few draws: no textures, the same labels and facts."""
    look(page, np.array((-60.0, 260.0, 40.0)), np.array((30.0, 0.0, 1.6)))
    page.wait_for("envgen.tiles.loaded.every((tile) => tile.ring > 0 && tile.flat.length)")
    page.value("new Promise((done) => setTimeout(done, 2500))")
    assert page.value("envgen.report().calls") < 40 * page.value("envgen.report().loaded")
    facts = [page.value(f"envgen.pick({x}, {y})") for x in range(20, 640, 40) for y in (190, 220)]
    known = {(each["class"], each["material"]) for each in facts if each}
    assert {"building", "terrain"} <= {name for name, _ in known}
    assert {material.split("_")[0] for name, material in known if name == "building"} <= {
        *("brick", "plaster", "render", "roof", "flagstone", "bitumen", "concrete", "glass"),
        *("paint", "trim", "sheet", "wood", "terracotta", "metal"),
    }
    page.value("envgen.setLabels(true)")
    picture = photograph(page, tmp_path / "far.png")
    page.value("envgen.setLabels(false)")
    kinds, counts = np.unique(picture[100:, 280:].reshape(-1, 3), axis=0, return_counts=True)
    seen = {tuple(kind.tolist()) for kind, count in zip(kinds, counts, strict=True) if count > 100}
    assert {label(name).colour for name in ("road", "building", "vegetation")} <= seen
    look(page, np.array((12.0, 1.7, 1.6)), np.array((60.0, 2.0, 1.6)))
    page.wait_for("envgen.tiles.loaded.some((tile) => tile.ring === 0)")


NOTE_REACHES = """
    globalThis.reaches = [], envgen.tiles.see = function (camera, reach, grain) {
      reaches.push(reach);
      return Object.getPrototypeOf(this).see.call(this, camera, reach, grain);
    }, 0
"""
"""Notes how much of the stage each picture may show; a busy machine draws the next one late."""


def test_a_resting_picture_is_complete_and_sharp(page):
    page.value(NOTE_REACHES)
    look(page, np.array((14.0, 1.7, 1.6)), np.array((60.0, 2.0, 1.6)))
    page.wait_for("reaches.some((reach) => reach < 1)")  # A moving picture leaves out small things.
    page.value("delete envgen.tiles.see")
    page.wait_for("envgen.tiles.sight.reach === 1 && envgen.renderer.getPixelRatio() === 1", 30)


def test_layers_hide_and_come_back(page):
    shown = "envgen.render(), envgen.report().triangles"
    page.value("new Promise((done) => setTimeout(done, 1500))")  # Until instances are chosen.
    everything = page.value(shown)
    counts = {}
    for name in ("Terrain", "Roads", "Buildings", "Props", "Actors"):
        page.value(f"envgen.setLayer('{name}', false)")
        counts[name] = page.value(shown)
        page.value(f"envgen.setLayer('{name}', true)")
    assert min(counts.values()) < everything
    assert page.value(shown) == everything
    missing = sum(everything - count for count in counts.values())
    assert missing == pytest.approx(everything, abs=2000), "all but the sky is in a layer"


def test_chunks_come_and_go_with_the_camera(page):
    page.value("envgen.tiles.range = 30")
    look(page, np.array((100.0, 2.0, -100.0)), np.array((130.0, 2.0, -100.0)))
    page.wait_for("envgen.report().loaded === 1")
    look(page, np.array((5000.0, 2.0, -100.0)), np.array((5030.0, 2.0, -100.0)))
    page.wait_for("envgen.report().loaded === 0")
    look(page, np.array((100.0, 2.0, 100.0)), np.array((130.0, 2.0, 100.0)))
    page.wait_for("envgen.report().loaded === 1")


def test_the_server_serves_two_folders_and_nothing_else(server, exported):
    (exported / "link.json").symlink_to("/etc/hostname")
    (exported / ".hidden").write_text("x")
    assert answer(server, "/gltf/tiles.json")[0] == 200
    assert b"envgen-usd view" in answer(server, "/")[1]
    outside = [
        "/gltf/../../../../etc/passwd",
        "/gltf/%2e%2e/%2e%2e/secret",
        "/gltf//etc/passwd",
        "/gltf/link.json",
        "/gltf/.hidden",
        "/gltf/",
        "/gltf/%00",
        "/etc/passwd",
        "/page/../page_server.py",
        "/stage.usda",
    ]
    assert {target: answer(server, target)[0] for target in outside} == dict.fromkeys(outside, 404)
    assert answer(server, "/", host="evil.example:80")[0] == 404
    assert file_at("/page/three.js", server.folders) is not None
    (exported / "link.json").unlink()
    (exported / ".hidden").unlink()


def test_a_taken_port_is_an_error(server):
    with pytest.raises(EnvgenError, match="try another"):
        PageServer(Path(), server.server_port)


def test_the_command_ends_cleanly_with_an_interrupt(exported):
    command = [sys.executable, "-m", "envgen_usd", "view", str(exported), "--no-export"]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as run:
        assert run.stdout is not None
        line = run.stdout.readline()
        port = int(line.split("127.0.0.1:")[1].split("/")[0])
        connection = http.client.HTTPConnection("127.0.0.1", port)
        connection.request("HEAD", "/gltf/tiles.json")
        assert connection.getresponse().status == 200
        connection.close()
        run.send_signal(signal.SIGINT)
        out, error = run.communicate(timeout=30)
    assert run.returncode == 0
    assert out == "ended\n"
    assert error == ""
