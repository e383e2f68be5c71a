"""Stages to which an artist has added an asset that has a payload, in many places."""

from collections.abc import Callable, Mapping
from pathlib import Path

from pxr import Gf, Sdf, Usd, UsdGeom
from tests.render.conftest import Author, new_author

AT = (0.0, 40.0, 60.0)
"""Place of the asset, metres; a box of 1 x 1 x 2 m stands there."""
STEP = 5.0
"""Distance along x from one copy to the next."""


def _asset(stage: Usd.Stage, path: str, number: int = 0, *, instance: bool = False) -> None:
    prim = UsdGeom.Xform.Define(stage, path)
    prim.AddTranslateOp().Set(Gf.Vec3d(AT[0] + STEP * number, *AT[1:]))
    prim.GetPrim().GetReferences().AddReference("./asset.usda", "/World")
    prim.GetPrim().SetInstanceable(instance)


def _scattered(stage: Usd.Stage, path: str, prototype: str, first: int = 0) -> None:
    copies = UsdGeom.PointInstancer.Define(stage, path)
    copies.CreatePrototypesRel().SetTargets([prototype])
    copies.CreateProtoIndicesAttr([0, 0])
    copies.CreatePositionsAttr([(AT[0] + STEP * number, *AT[1:]) for number in (first, first + 1)])


def _prototype(stage: Usd.Stage, path: str, *, instance: bool = False) -> str:
    prim = stage.DefinePrim(path, "Xform")
    prim.GetReferences().AddReference("./asset.usda", "/World")
    prim.SetInstanceable(instance)
    return path


def _in_a_layer_of_a_chunk(stage: Usd.Stage) -> list[str]:
    _asset(stage, "/World/chunk_0/props/mine")
    return ["/World/chunk_0/props/mine"]


def _in_a_chunk(stage: Usd.Stage) -> list[str]:
    _asset(stage, "/World/chunk_0/mine", instance=True)
    return ["/World/chunk_0/mine"]


def _in_the_world(stage: Usd.Stage) -> list[str]:
    _asset(stage, "/World/mine", instance=True)
    _asset(stage, "/World/other", 1)
    return ["/World/mine", "/World/other"]


def _at_the_root(stage: Usd.Stage) -> list[str]:
    _asset(stage, "/mine")
    _asset(stage, "/other", 1, instance=True)
    return ["/mine", "/other"]


def _in_groups_in_groups(stage: Usd.Stage) -> list[str]:
    _asset(stage, "/World/Group/mine")
    _asset(stage, "/World/Group/Inner/mine", 1)
    _asset(stage, "/World/chunk_0/props/mine", 2)
    return ["/World/Group/mine", "/World/Group/Inner/mine", "/World/chunk_0/props/mine"]


def _in_groups_of_one_name(stage: Usd.Stage) -> list[str]:
    _asset(stage, "/World/Square/Benches/mine")
    _asset(stage, "/World/Park/Benches/mine", 1, instance=True)
    return ["/World/Square/Benches/mine", "/World/Park/Benches/mine"]


def _as_a_prototype(stage: Usd.Stage) -> list[str]:
    _scattered(stage, "/World/Many", _prototype(stage, "/World/Many/mine"))
    return ["/World/Many/mine[0]", "/World/Many/mine[1]"]


def _as_a_prototype_below_a_prim(stage: Usd.Stage) -> list[str]:
    _prototype(stage, "/World/Many/holder/mine", instance=True)
    _scattered(stage, "/World/Many", "/World/Many/holder")
    return ["/World/Many/holder/mine[0]", "/World/Many/holder/mine[1]"]


def _as_a_shared_prototype(stage: Usd.Stage) -> list[str]:
    stage.CreateClassPrim("/World/Shapes")
    path = _prototype(stage, "/World/Shapes/mine")
    _scattered(stage, "/World/Near", path)
    _scattered(stage, "/World/Far", path, 2)
    return [f"/World/{name}/mine[{k}]" for name in ("Near", "Far") for k in range(2)]


def _as_a_prototype_below_an_over(stage: Usd.Stage) -> list[str]:
    path = _prototype(stage, "/World/Many/Shapes/mine")
    stage.GetPrimAtPath("/World/Many/Shapes").SetSpecifier(Sdf.SpecifierOver)
    _scattered(stage, "/World/Many", path)
    return ["/World/Many/Shapes/mine[0]", "/World/Many/Shapes/mine[1]"]


def _inside_of_instances(stage: Usd.Stage) -> list[str]:
    corner = Usd.Stage.CreateNew(str(Path(stage.GetRootLayer().realPath).parent / "corner.usda"))
    UsdGeom.SetStageUpAxis(corner, "Z")
    UsdGeom.SetStageMetersPerUnit(corner, 1.0)
    corner.SetDefaultPrim(corner.DefinePrim("/Corner", "Xform"))
    _prototype(corner, "/Corner/mine", instance=True)
    corner.GetRootLayer().Save()
    for number, instance in enumerate((True, False)):
        prim = UsdGeom.Xform.Define(stage, f"/World/Artist/corner_{number}")
        prim.AddTranslateOp().Set(Gf.Vec3d(AT[0] + STEP * number, *AT[1:]))
        prim.GetPrim().GetReferences().AddReference("./corner.usda")
        prim.GetPrim().SetInstanceable(instance)
    return [f"/World/Artist/corner_{number}/mine" for number in range(2)]


CASES: Mapping[str, Callable[[Usd.Stage], list[str]]] = {
    each.__name__.removeprefix("_"): each
    for each in (
        _in_a_layer_of_a_chunk,
        _in_a_chunk,
        _in_the_world,
        _at_the_root,
        _in_groups_in_groups,
        _in_groups_of_one_name,
        _as_a_prototype,
        _as_a_prototype_below_a_prim,
        _as_a_shared_prototype,
        _as_a_prototype_below_an_over,
        _inside_of_instances,
    )
}
"""Adds the asset to a stage, and returns the paths of its copies: copy n stands n steps along x."""


def two_chunks(folder: Path) -> Path:
    """A town of two chunks, whose houses and props are payloads."""
    top = new_author(folder / "town.usda")
    for number in range(2):
        for layer, low, label in (("houses", 6.0, "building"), ("props", -6.0, "vegetation")):
            part: Author = new_author(folder / f"{layer}_{number}.usda")
            thing = part.box("/World/thing", (low, 40, 0), (low + 2, 60, 6), label=label)
            part.kind(thing.GetPrim(), "component")
            part.stage.Save()
            prim = top.stage.DefinePrim(f"/World/chunk_{number}/{layer}", "Xform")
            UsdGeom.Xformable(prim).AddTranslateOp().Set(Gf.Vec3d(0.0, 200.0 * number, 0.0))
            prim.GetPayloads().AddPayload(f"./{layer}_{number}.usda", "/World")
    world = top.stage.GetPrimAtPath("/World")
    Usd.ModelAPI(world).SetKind("assembly")
    top.stage.Save()
    _write_asset(folder)
    return folder / "town.usda"


def _write_asset(folder: Path) -> None:
    inside = new_author(folder / "inside.usda")
    inside.box("/World/box", (-0.5, -0.5, 0), (0.5, 0.5, 2), label="static")
    inside.stage.Save()
    asset = new_author(folder / "asset.usda")
    world = asset.stage.GetPrimAtPath("/World")
    asset.kind(world, "component")
    asset.label(world, "static")
    world.GetPayloads().AddPayload("./inside.usda", "/World")
    asset.stage.Save()


def edited(folder: Path, case: str) -> tuple[Path, list[str]]:
    """The town with an artist's layer on top, and the paths of the asset's copies."""
    two_chunks(folder)
    stage = Usd.Stage.CreateNew(str(folder / "edits.usda"))
    UsdGeom.SetStageUpAxis(stage, "Z")
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    stage.GetRootLayer().subLayerPaths.append("./town.usda")
    stage.GetRootLayer().defaultPrim = "World"
    paths = CASES[case](stage)
    stage.GetRootLayer().Save()
    return folder / "edits.usda", paths
