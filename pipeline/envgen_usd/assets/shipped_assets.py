"""All assets of the shipped library."""

from dataclasses import replace

from envgen_usd.assets.asset_design import AssetDesign, Model
from envgen_usd.assets.furniture_assets import furniture_designs
from envgen_usd.assets.shapes import (
    broadleaf_trees,
    conifers,
    crowned_trees,
    opening_shapes,
    shrubs,
    street_light_shapes,
    traffic_light_shapes,
    traffic_sign_shapes,
)
from envgen_usd.seeds import generator


def designs() -> tuple[AssetDesign, ...]:
    """All assets, by kind and name."""
    return (*_trees(), *_street_lights(), *_windows(), *_doors(), *_signs(), *furniture_designs())


def _trees() -> tuple[AssetDesign, ...]:
    seasons = {
        season: {"Leaves": foliage, "LeavesProxy": foliage}
        for season, foliage in {
            "summer": "leaves",
            "autumn": "leaves_autumn",
            "winter": "twigs",
        }.items()
    }
    broadleaves = {
        name: crowned_trees.crowned_tree(species, "leaves", generator(0, "tree_broadleaf", name))
        for name, species in broadleaf_trees.BROADLEAF_SPECIES.items()
    }
    whorled = {
        name: conifers.whorled_tree(cone, "needles", generator(0, "tree_conifer", name))
        for name, cone in conifers.CONES.items()
    }
    crowned = {
        name: crowned_trees.crowned_tree(species, "needles", generator(0, "tree_conifer", name))
        for name, species in conifers.CONIFER_SPECIES.items()
    }
    bare, green = (
        {name: shrubs.shrub(form, foliage, generator(0, "bush", name)) for name, form in of.items()}
        for of, foliage in (
            (shrubs.DECIDUOUS_SHRUBS, "leaves"),
            (shrubs.EVERGREEN_SHRUBS, "leaves_evergreen"),
        )
    )
    looks = {"season": seasons}
    return (
        AssetDesign("tree_broadleaf", "tree", "vegetation", broadleaves, "shape", looks),
        AssetDesign("tree_conifer", "tree", "vegetation", {**whorled, **crowned}, "shape"),
        AssetDesign("bush", "bush", "vegetation", bare, "shape", looks),
        AssetDesign("bush_evergreen", "bush", "vegetation", green, "shape"),
    )


def _street_lights() -> tuple[AssetDesign, ...]:
    models = {
        "virginia": street_light_shapes.lantern_post(),
        "new_york": street_light_shapes.cobra_head(),
        "column": street_light_shapes.bracket_column(),
        "twin": street_light_shapes.twin_column(),
    }
    finishes = {
        "black": {"Post": "paint_black"},
        "green": {"Post": "paint_green"},
        "grey": {"Post": "metal_galvanised"},
    }
    looks = {"finish": finishes}
    return (AssetDesign("street_light", "street_light", "pole", models, "design", looks),)


def _windows() -> tuple[AssetDesign, ...]:
    frames = {
        "white": {"Frame": "paint_white"},
        "brown": {"Frame": "paint_brown"},
        "grey": {"Frame": "paint_grey"},
    }
    casements = {
        "single": opening_shapes.casement(cross=False),
        "cross": opening_shapes.casement(cross=True),
    }
    panes = {"dark": "glass", "lit": "glass_lit", "draped": "glass_draped"}
    interiors = {name: {"Pane": material} for name, material in panes.items()}
    looks = {"frame": frames, "interior": interiors}
    strips = {
        "strip": opening_shapes.industrial(strip=True),
        "single": opening_shapes.industrial(strip=False),
    }
    return (
        _opening("window_casement", "window", casements, "glazing", looks),
        _opening("window_industrial", "window", strips, "glazing", looks),
    )


def _doors() -> tuple[AssetDesign, ...]:
    def colours(*names: str) -> dict[str, dict[str, dict[str, str]]]:
        return {"colour": {name: {"Leaf": f"paint_{name}"} for name in names}}

    of_doors = colours("brown", "green", "red", "blue", "white")
    of_gates = colours("grey", "blue", "red", "green", "white")
    house = _opening("door_house", "door", {"": opening_shapes.house_door()}, "", of_doors)
    gate = _opening("door_gate", "door", {"": opening_shapes.gate()}, "", of_gates)
    models = {
        "sectional": opening_shapes.sectional_garage(),
        "wooden": opening_shapes.wooden_garage(),
    }
    of_garages = colours("white", "brown", "green", "grey", "red", "blue")
    garage = _opening("door_garage", "door", models, "style", of_garages)
    return (
        replace(house, widths=(0.6, 1.9)),
        replace(garage, widths=(1.9, 3.2)),
        replace(gate, widths=(3.2, 12.0)),
    )


def _opening(
    name: str,
    kind: str,
    models: dict[str, Model],
    model_set: str,
    looks: dict[str, dict[str, dict[str, str]]],
) -> AssetDesign:
    return AssetDesign(name, kind, "building", models, model_set, looks)


def _signs() -> tuple[AssetDesign, ...]:
    plates = {
        "round": ("paint_red", "paint_white"),
        "triangle": ("paint_red", "paint_white"),
        "inverted_triangle": ("paint_red", "paint_white"),
        "octagon": ("paint_white", "paint_red"),
        "diamond": ("paint_white", "paint_yellow"),
        "square": ("paint_white", "paint_blue"),
        "rectangle": ("paint_black", "paint_white"),
    }
    shapes = {name: traffic_sign_shapes.traffic_sign(name, *look) for name, look in plates.items()}
    return (
        AssetDesign("traffic_sign", "traffic_sign", "pole", shapes, "shape"),
        traffic_light_shapes.traffic_light_design(),
    )
