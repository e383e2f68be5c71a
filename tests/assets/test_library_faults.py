"""Each fault of a copied asset is found, and nothing else is."""

import shutil
from collections.abc import Callable
from importlib import resources
from pathlib import Path

import pytest
from pxr import Gf, Sdf

from envgen_usd.assets.asset_catalogue import read_catalogue
from envgen_usd.assets.library_check import check_library
from envgen_usd.assets.library_files import asset_paths

SHIPPED = Path(str(resources.files("envgen_usd.asset_library")))
METER = "parking_meter"
INTERFACE = "assets/parking_meter/parking_meter/usd/parking_meter.usda"
PAYLOAD = "assets/parking_meter/parking_meter/payload/parking_meter.usdc"
OTHERS = (SHIPPED / "materials/metal_dark.usda", SHIPPED / "materials/sign_prints.usda")
MATERIAL = "materials/brick_red.usda"
Change = Callable[[Sdf.Layer], None]


@pytest.fixture
def library(tmp_path: Path) -> Path:
    """The shipped parking meter with its materials, and a material with textures."""
    folder = tmp_path / "library"
    shutil.copytree(SHIPPED / "assets" / METER, folder / "assets" / METER)
    for name in ("materials", "textures"):
        (folder / name).mkdir()
    for path in (*SHIPPED.glob("materials/paint_*.usda"), *OTHERS, SHIPPED / MATERIAL):
        shutil.copy(path, folder / "materials")
    for path in (*SHIPPED.glob("textures/brick_red*"), *SHIPPED.glob("textures/sign_prints*")):
        shutil.copy(path, folder / "textures")
    return folder


def edit(path: Path, change: Change) -> None:
    layer = Sdf.Layer.OpenAsAnonymous(str(path))
    change(layer)
    layer.Export(str(path))


def stage_metadata(key: str, value: object) -> Change:
    return lambda layer: layer.pseudoRoot.SetInfo(key, value)


def root_metadata(key: str, value: object) -> Change:
    def change(layer: Sdf.Layer) -> None:
        layer.GetPrimAtPath("/parking_meter").customData[key] = value

    return change


def kind_of(value: str) -> Change:
    def change(layer: Sdf.Layer) -> None:
        layer.GetPrimAtPath("/parking_meter").kind = value

    return change


def without(*names: str, path: str = "/parking_meter") -> Change:
    """Removes labels, with the schemas that apply them."""

    def change(layer: Sdf.Layer) -> None:
        prim = layer.GetPrimAtPath(path)
        for name in names:
            del prim.properties[f"semantics:labels:{name}"]
        schemas = prim.GetInfo("apiSchemas")
        kept = [s for s in schemas.prependedItems if s.split(":")[-1] not in names]
        prim.SetInfo("apiSchemas", Sdf.TokenListOp.Create(prependedItems=kept))

    return change


def not_inherited(layer: Sdf.Layer) -> None:
    layer.GetPrimAtPath("/parking_meter").inheritPathList.ClearEdits()


def labelled_parts(layer: Sdf.Layer) -> list[Sdf.PrimSpec]:
    """The meshes of the asset; its collider has no part."""
    children = layer.GetPrimAtPath("/parking_meter/Geometry").nameChildren
    found = [prim for prim in children if "semantics:labels:part" in prim.attributes]
    assert found
    return found


def no_part(layer: Sdf.Layer) -> None:
    for prim in labelled_parts(layer):
        without("part", path=str(prim.path))(layer)


def wrong_part(layer: Sdf.Layer) -> None:
    for prim in labelled_parts(layer):
        prim.attributes["semantics:labels:part"].default = ["nose"]


def larger_hint(layer: Sdf.Layer) -> None:
    attribute = layer.GetAttributeAtPath("/parking_meter.extentsHint")
    attribute.default = [Gf.Vec3f(-1, -1, 0), Gf.Vec3f(1, 1, 3)]


def payload_from(path: str) -> Change:
    def change(layer: Sdf.Layer) -> None:
        layer.GetPrimAtPath("/parking_meter").payloadList.prependedItems = [Sdf.Payload(path)]

    return change


def reference_to(path: str) -> Change:
    def change(layer: Sdf.Layer) -> None:
        spec = layer.GetPrimAtPath("/parking_meter{colour=grey}Materials/paint_grey")
        spec.referenceList.prependedItems = [Sdf.Reference(path)]

    return change


def texture_from(path: str) -> Change:
    def change(layer: Sdf.Layer) -> None:
        layer.GetAttributeAtPath("/brick_red/Colour.inputs:file").default = Sdf.AssetPath(path)

    return change


FAULTS: dict[str, tuple[str, Change, str, str]] = {
    "centimetres": (
        INTERFACE, stage_metadata("metersPerUnit", 0.01),
        "library.units", "metersPerUnit must be 1.0, but is 0.01",
    ),
    "a payload in centimetres": (
        PAYLOAD, stage_metadata("metersPerUnit", 0.01),
        "library.units", "metersPerUnit must be 1.0, but is 0.01",
    ),
    "y up": (
        INTERFACE, stage_metadata("upAxis", "Y"), "library.units", "upAxis must be Z, but is Y",
    ),
    "a payload with y up": (
        PAYLOAD, stage_metadata("upAxis", "Y"), "library.units", "upAxis must be Z, but is Y",
    ),
    "a payload without units": (
        PAYLOAD, lambda layer: layer.pseudoRoot.ClearInfo("metersPerUnit"),
        "library.units", "metersPerUnit must be 1.0, but is missing",
    ),
    "a size in centimetres": (
        INTERFACE, root_metadata("nominal_size", Gf.Vec3d(32, 40, 162)),
        "library.size",
        "nominal_size [32.0, 40.0, 162.0] is not the geometry's size [0.32, 0.4, 1.62]",
    ),
    "a size of other proportions": (
        INTERFACE, root_metadata("nominal_size", Gf.Vec3d(1.62, 0.4, 0.32)),
        "library.size",
        "nominal_size [1.62, 0.4, 0.32] is not the geometry's size [0.32, 0.4, 1.62]",
    ),
    "a box that is too large": (
        INTERFACE, larger_hint,
        "library.extent",
        "extentsHint [[-1.0, -1.0, 0.0], [1.0, 1.0, 3.0]] is larger than the geometry "
        "[[-0.16, -0.2, 0.0], [0.16, 0.2, 1.62]]",
    ),
    "no part": (
        PAYLOAD, no_part,
        "library.part", "/parking_meter/Geometry/Body has no label of the taxonomy 'part'",
    ),
    "an unknown part": (
        PAYLOAD, wrong_part,
        "library.part", "/parking_meter/Geometry/Body: part 'nose' is not in the label taxonomy",
    ),
    "no label of cityscapes": (
        INTERFACE, without("cityscapes"),
        "library.label", "the default prim has no label of the taxonomy 'cityscapes'",
    ),
    "no kind": (
        INTERFACE, lambda layer: layer.GetPrimAtPath("/parking_meter").ClearInfo("kind"),
        "library.kind", "kind must be component, but is missing",
    ),
    "another kind": (
        INTERFACE, kind_of("group"), "library.kind", "kind must be component, but is group",
    ),
    "no class prim": (
        INTERFACE, not_inherited,
        "library.inherits", "the default prim does not inherit </__class__/parking_meter>",
    ),
    "a payload that is not there": (
        INTERFACE, payload_from("../payload/gone.usdc"),
        "library.unreadable", "../payload/gone.usdc does not exist",
    ),
}  # fmt: skip
OUTSIDE: dict[str, tuple[str, Callable[[str], Change], str]] = {
    "payload": (INTERFACE, payload_from, PAYLOAD),
    "reference": (INTERFACE, reference_to, "materials/paint_grey.usda"),
    "texture": (MATERIAL, texture_from, "textures/brick_red_colour.jpg"),
}


def found(library: Path) -> set[tuple[str, str, str]]:
    return {
        (issue.kind, issue.where.split(" ")[0], issue.message)
        for issue in check_library(read_catalogue(library))
    }


def test_the_copy_is_clean(library: Path) -> None:
    assert check_library(read_catalogue(library)) == ()


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_is_found_and_no_other(library: Path, name: str) -> None:
    file, change, kind, message = FAULTS[name]
    edit(library / file, change)
    issues = found(library)
    assert {issue[0] for issue in issues} == {kind}
    assert issues & {(kind, file, message), (kind, INTERFACE, message)}


@pytest.mark.parametrize("absolute", [True, False])
@pytest.mark.parametrize("name", OUTSIDE)
def test_a_path_that_leaves_the_library_is_found(
    library: Path, tmp_path: Path, name: str, absolute: bool
) -> None:
    """The file exists there, so that nothing else is wrong."""
    file, change, target = OUTSIDE[name]
    shutil.copytree(library, tmp_path / "elsewhere")
    up = "../" * len(Path(file).parts)
    path = str(tmp_path / "elsewhere" / target) if absolute else f"{up}elsewhere/{target}"
    edit(library / file, change(path))
    message = f"path {path} leaves the library; copy the file into it"
    assert found(library) == {("library.outside", file, message)}


def test_a_link_that_leaves_the_library_is_found(library: Path, tmp_path: Path) -> None:
    payload = library / PAYLOAD
    payload.rename(tmp_path / "parking_meter.usdc")
    payload.symlink_to(tmp_path / "parking_meter.usdc")
    message = "path ../payload/parking_meter.usdc leaves the library; copy the file into it"
    assert found(library) == {("library.outside", INTERFACE, message)}


def test_a_payload_that_is_no_usd_is_named(library: Path) -> None:
    (library / PAYLOAD).write_bytes(b"rubbish")
    message = "../payload/parking_meter.usdc cannot be read as a USD layer"
    assert found(library) == {("library.unreadable", INTERFACE, message)}


def test_all_paths_of_a_layer_are_known() -> None:
    layer = Sdf.Layer.OpenAsAnonymous(str(SHIPPED / INTERFACE))
    assert asset_paths(layer) == (
        *(f"../../../../materials/paint_{colour}.usda" for colour in ("blue", "grey")),
        "../payload/parking_meter.usdc",
        "./parking_meter.usda",
    )
