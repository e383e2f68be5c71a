"""The shop fronts and the fittings of facades of the shipped library."""

from collections.abc import Mapping

from envgen_usd.assets.asset_design import AssetDesign, Model, parted_model
from envgen_usd.assets.shapes import balcony_shapes, facade_fittings, shop_shapes

_COLOURS = ("black", "green", "blue", "red", "white", "brown", "grey")


def facade_designs() -> tuple[AssetDesign, ...]:
    """Shop fronts, and what is fixed to walls and roofs, by kind."""
    pipes = {name: {"Pipe": f"paint_{name}", "PipeProxy": f"paint_{name}"} for name in _PIPES}
    troughs = {name: {"Trough": f"paint_{name}", "TroughProxy": f"paint_{name}"} for name in _PIPES}
    rails = {
        name: dict.fromkeys(("Rail", "RailProxy"), material)
        for name, material in {
            "black": "paint_black",
            "white": "paint_white",
            "galvanised": "metal_galvanised",
        }.items()
    }
    pots = {
        name: facade_fittings.chimney_pots(count=count)
        for name, count in (("single", 1), ("pair", 2))
    }
    single: Mapping[str, Model] = {
        "stone_course": facade_fittings.stone_course(),
        "cornice": facade_fittings.cornice(),
        "aerial": facade_fittings.aerial(),
        "satellite_dish": facade_fittings.satellite_dish(),
    }
    return (
        *_shop_fronts(),
        *(_fitting(name, {"": model}) for name, model in single.items()),
        _fitting("balcony", balcony_shapes.balconies(), "design", {"rail": rails}),
        _fitting("chimney_pots", pots, "design"),
        _fitting("gutter", {"": facade_fittings.gutter()}, "", {"colour": troughs}),
        _fitting("downpipe", {"": facade_fittings.downpipe()}, "", {"colour": pipes}),
    )


_PIPES = ("black", "grey", "white")
"""Paint of gutters and pipes."""


def _shop_fronts() -> tuple[AssetDesign, ...]:
    frames = {name: {"Frame": f"paint_{name}", "FrameProxy": f"paint_{name}"} for name in _COLOURS}
    doors = {
        name: dict.fromkeys(("Frame", "FrameProxy", "Leaf", "LeafProxy"), f"paint_{name}")
        for name in _COLOURS
    }
    boards = {name: {"Board": f"paint_{name}"} for name in _COLOURS}
    fabrics = {name: {"Fabric": f"paint_{name}"} for name in ("red", "green", "blue", "brown")}
    awnings = {
        "striped": shop_shapes.awning(striped=True),
        "plain": shop_shapes.awning(striped=False),
    }
    window = AssetDesign(
        "window_shop", "window", "building", _parted(shop_shapes.displays()), "design",
        {"paint": frames}, widths=(1.9, 12.0),
    )  # fmt: skip
    door = AssetDesign(
        "door_shop", "door", "building", _parted({"": shop_shapes.shop_door()}), "",
        {"paint": doors}, widths=(1.35, 1.9),
    )  # fmt: skip
    return (
        window,
        door,
        _fitting("shop_fascia", {"": shop_shapes.fascia()}, "", {"paint": boards}),
        _fitting("awning", awnings, "design", {"fabric": fabrics}),
    )


def _fitting(
    kind: str,
    models: Mapping[str, Model],
    model_set: str = "",
    looks: Mapping[str, Mapping[str, Mapping[str, str]]] | None = None,
) -> AssetDesign:
    return AssetDesign(kind, kind, "building", _parted(models), model_set, looks or {})


def _parted(models: Mapping[str, Model]) -> dict[str, Model]:
    return {variant: parted_model(model) for variant, model in models.items()}
