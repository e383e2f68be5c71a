"""Checks an asset library, so that authors see errors before a build."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import product
from pathlib import Path

import numpy as np
from pxr import Sdf, Tf, Usd, UsdSemantics, UsdValidation  # type: ignore[attr-defined]

from envgen_usd.assets.asset_catalogue import Asset, Catalogue, LibraryMaterial
from envgen_usd.assets.asset_geometry import (
    DrawnBoxes,
    StatedSizes,
    check_ground,
    check_meshes,
    check_points,
    drawn_meshes,
)
from envgen_usd.assets.crate_guard import deadly_layers
from envgen_usd.assets.library_files import UNREADABLE, check_files
from envgen_usd.errors import Issue, Severity, one_line
from envgen_usd.label_taxonomy import labels

PROTOTYPE_CAP = 192
"""Largest number of variant combinations without a warning; each that a stage uses is a prototype.

The shipped cars have 162: bodies, paints and lights.
"""


def check_library(catalogue: Catalogue) -> tuple[Issue, ...]:
    """Checks every material and every variant of every asset.

    1. OpenUSD's validators report no error.
    2. All layers are in metres with z up, and refer to nothing outside the library.
    3. An asset has the kind ``component`` and inherits its class prim.
    4. An asset's class is in the label taxonomy; it has a label of `cityscapes`.
    5. Every drawn mesh has a material, and a label of `part` from the taxonomy.
    6. All textures exist.
    7. `nominal_size` and `extentsHint` agree with the geometry; standing objects touch the ground.
    8. The number of combinations of variants stays below `PROTOTYPE_CAP`.
    9. No two points of a mesh repeat each other.
    """
    return check_used(catalogue, catalogue.assets, catalogue.materials)


def check_used(
    catalogue: Catalogue, assets: Iterable[str], materials: Iterable[str]
) -> tuple[Issue, ...]:
    """Checks the assets and materials of these names as `check_library` does."""
    used_assets = [catalogue.assets[name] for name in assets]
    used_materials = [catalogue.materials[name] for name in materials]
    issues: list[Issue] = []
    for material in used_materials:
        issues += _readable(_check_material(catalogue.folder, material), material.path)
    deadly = _deadly(catalogue.folder, used_assets)
    for asset in used_assets:
        faults = deadly[asset.path]
        issues += faults or _readable(_check_asset(catalogue.folder, asset), asset.path)
    return tuple(dict.fromkeys(issues))  # Assets share the layers of materials.


def _deadly(folder: Path, assets: Sequence[Asset]) -> dict[str, list[Issue]]:
    """Issues of binary layers that would end this process, by the asset's path."""
    layers = {asset.path: _binary_layers(folder / asset.path) for asset in assets}
    found = deadly_layers([path for each in layers.values() for path in each])
    text = "is damaged so that OpenUSD crashes; make it anew"
    return {
        of: [
            Issue(UNREADABLE, Severity.ERROR, path.relative_to(folder).as_posix(), text)
            for path in each
            if path in found
        ]
        for of, each in layers.items()
    }


def _binary_layers(interface: Path) -> list[Path]:
    """Layers in the folder of an asset that may be binary."""
    places = sorted(interface.parents[1].rglob("*.usd*"))
    return [path for path in places if path.suffix in {".usdc", ".usd"} and path.is_file()]


def _readable(issues: Iterator[Issue], path: str) -> Iterator[Issue]:
    """Yields issues, up to data that OpenUSD cannot unpack; it reads them when they are used."""
    try:
        yield from issues
    except Tf.ErrorException as error:
        text = f"cannot be read as a USD layer: {one_line(error)}"
        yield Issue(UNREADABLE, Severity.ERROR, path, text)


def _check_files(folder: Path, path: str) -> tuple[list[Issue], bool]:
    """Issues of the files of an asset or a material, and whether it can be composed."""
    issues = list(check_files(folder, path))
    return issues, all(issue.kind != UNREADABLE for issue in issues)


def _check_material(folder: Path, material: LibraryMaterial) -> Iterator[Issue]:
    issues, readable = _check_files(folder, material.path)
    yield from issues
    if not readable:
        return
    stage = Usd.Stage.Open(str(folder / material.path))
    yield from _validate(stage, material.path)
    yield from _check_textures(stage, material.path)


def _check_asset(folder: Path, asset: Asset) -> Iterator[Issue]:
    combinations = int(np.prod([len(variants) for variants in asset.variants.values()]))
    if combinations > PROTOTYPE_CAP:
        text = (
            f"{combinations} combinations of variants; more than {PROTOTYPE_CAP} slow down stages"
        )
        yield Issue("library.prototypes", Severity.WARNING, asset.path, text)
    issues, readable = _check_files(folder, asset.path)
    yield from issues
    if not readable:
        return
    stage = Usd.Stage.Open(str(folder / asset.path))
    yield from _validate(stage, asset.path)
    yield from _check_root(stage.GetDefaultPrim(), asset)
    stage.SetEditTarget(stage.GetSessionLayer())
    sizes, boxes, seen = StatedSizes(asset), DrawnBoxes(), set[tuple[str, str]]()
    for chosen in _selections(asset):
        _select(stage.GetDefaultPrim(), chosen)
        where = f"{asset.path} {' '.join(f'{k}={v}' for k, v in chosen.items())}".strip()
        yield from _check_textures(stage, where)
        meshes = [prim for prim in stage.Traverse() if prim.IsA("Mesh")]
        drawn = drawn_meshes(meshes)
        yield from check_meshes(drawn, where)
        yield from check_points(meshes, where, seen)
        box = boxes.box(drawn)
        if box is None:
            yield Issue("library.empty", Severity.WARNING, where, "has no drawn geometry")
            continue
        sizes.add(chosen, where, box)
        yield from check_ground(asset, box, where)
    yield from sizes.check()


def _select(root: Usd.Prim, chosen: Mapping[str, str]) -> None:
    """Selects variants; the stage composes the asset once, not once for each set."""
    with Sdf.ChangeBlock():
        for name, variant in chosen.items():
            root.GetVariantSet(name).SetVariantSelection(variant)


def _check_root(root: Usd.Prim, asset: Asset) -> Iterator[Issue]:
    """Checks the default prim: kind, class prim, labels."""

    def fault(kind: str, text: str) -> Issue:
        return Issue(f"library.{kind}", Severity.ERROR, asset.path, text)

    kind = Usd.ModelAPI(root).GetKind()
    if kind != "component":
        yield fault("kind", f"kind must be component, but is {kind or 'missing'}")
    template = f"/__class__/{asset.name}"
    if template not in map(str, root.GetInherits().GetAllDirectInherits()):
        yield fault("inherits", f"the default prim does not inherit <{template}>")
    known = [entry.name for entry in labels()]
    if asset.label not in known:
        text = f"class '{asset.label}' is not in the label taxonomy; known: {', '.join(known)}"
        yield fault("label", text)
    for taxonomy in ("class", "cityscapes"):
        labelled = root.HasAPI(UsdSemantics.LabelsAPI, taxonomy)
        if not labelled or not UsdSemantics.LabelsAPI(root, taxonomy).GetLabelsAttr().Get():
            yield fault("label", f"the default prim has no label of the taxonomy '{taxonomy}'")


def _selections(asset: Asset) -> Iterator[dict[str, str]]:
    """All combinations of variants, up to the cap."""
    names = list(asset.variants)
    for count, choice in enumerate(product(*asset.variants.values())):
        if count < PROTOTYPE_CAP:
            yield dict(zip(names, choice, strict=True))


def _validate(stage: Usd.Stage, where: str) -> Iterator[Issue]:
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    for error in UsdValidation.ValidationContext(validators).Validate(stage):
        yield Issue("library.validator", Severity.ERROR, where, str(error.GetErrorAsString()))


def _check_textures(stage: Usd.Stage, where: str) -> Iterator[Issue]:
    for prim in stage.Traverse():
        file = prim.GetAttribute("inputs:file").Get()
        if file is None:
            continue
        if not isinstance(file, Sdf.AssetPath):
            text = f"{prim.GetPath()}: inputs:file is no asset path; declare it as `asset`"
            yield Issue("library.texture", Severity.ERROR, where, text)
        elif not file.resolvedPath:
            text = f"{prim.GetPath()}: texture {file.path} does not exist"
            yield Issue("library.texture", Severity.ERROR, where, text)
