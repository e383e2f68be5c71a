"""All assets of the shipped library."""

from dataclasses import replace

from envgen_usd.assets.asset_design import AssetDesign, Model, parted_model
from envgen_usd.assets.coarse_pieces import with_far_pieces
from envgen_usd.assets.facade_assets import facade_designs
from envgen_usd.assets.furniture_assets import furniture_designs
from envgen_usd.assets.people.people_designs import people_designs
from envgen_usd.assets.shapes import (
    broadleaf_trees,
    conifers,
    crowned_trees,
    door_shapes,
    flower_bed_shapes,
    gate_shapes,
    shrubs,
    street_light_shapes,
    traffic_light_shapes,
    traffic_sign_shapes,
    window_shapes,
)
from envgen_usd.assets.two_wheelers.two_wheeler_designs import two_wheeler_designs
from envgen_usd.seeds import generator


def designs() -> tuple[AssetDesign, ...]:
    """All assets, by kind and name; large ones have far meshes."""
    return tuple(with_far_pieces(design) for design in _designs())


def _designs() -> tuple[AssetDesign, ...]:
    return (
        *_trees(),
        *_beds(),
        *_street_lights(),
        *_windows(),
        *_doors(),
        *_signs(),
        *facade_designs(),
        *furniture_designs(),
        *people_designs(),
        *two_wheeler_designs(),
    )


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


def _beds() -> tuple[AssetDesign, ...]:
    """Flower beds; other materials of the atlas' layout make their seasons."""
    models = {
        name: parted_model(flower_bed_shapes.flower_bed(bed, generator(0, "flower_bed", name)))
        for name, bed in flower_bed_shapes.BEDS.items()
    }
    seasons = {
        season: dict.fromkeys(("Flowers", "FlowersProxy"), material)
        for season, material in {
            "summer": "flowers",
            "autumn": "leaves_autumn",
            "winter": "twigs",
        }.items()
    }
    looks = {"season": seasons}
    return (AssetDesign("flower_bed", "flower_bed", "vegetation", models, "design", looks),)


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


def _painted(*parts: str, colours: tuple[str, ...]) -> dict[str, dict[str, str]]:
    """Paint of parts and of their proxies, by colour."""
    both = (*parts, *(f"{part}Proxy" for part in parts))
    return {colour: dict.fromkeys(both, f"paint_{colour}") for colour in colours}


_FRAMES = _painted("Frame", colours=("white", "brown", "grey"))
"""Paint of the frames of windows."""
_INTERIORS = {
    name: {"Pane": f"glass_{name}" if name != "dark" else "glass"}
    for name in ("dark", "lit", "draped", "dim", "cool")
}
"""What shows behind the panes of windows."""


def _windows() -> tuple[AssetDesign, ...]:
    models = window_shapes.house_windows()
    looks = {"frame": _FRAMES, "interior": _INTERIORS}

    def houses(name: str, *glazings: str) -> AssetDesign:
        several = len(glazings) > 1
        chosen = {each if several else "": models[each] for each in glazings}
        model_set = "glazing" if several else ""
        return replace(_opening(name, "window", chosen, model_set, looks), widths=(0.2, 1.9))

    strips = {
        "strip": window_shapes.hall_window(strip=True),
        "single": window_shapes.hall_window(strip=False),
    }
    roof = {"": window_shapes.roof_window()}
    shutters = {"shutters": _painted("Shutters", colours=("green", "brown", "white"))}
    return (
        houses("window_casement", "single", "cross", "two_light", "three_light", "top_hung"),
        houses("window_sash", "sash", "georgian"),
        houses("window_french", "french"),
        replace(houses("window_shuttered", "shuttered"), looks={**looks, **shutters}),
        _opening("window_industrial", "window", strips, "glazing", looks),
        _opening("roof_window", "roof_window", roof, "", {}),
    )


def _doors() -> tuple[AssetDesign, ...]:
    def colours(*names: str) -> dict[str, dict[str, dict[str, str]]]:
        return {"colour": {name: {"Leaf": f"paint_{name}"} for name in names}}

    paints = ("brown", "green", "red", "blue", "white")
    of_doors = {"colour": _painted("Leaf", colours=paints)}
    of_gates = colours("grey", "blue", "red", "green", "white")
    house = _opening("door_house", "door", door_shapes.front_doors(), "style", of_doors)
    gate = _opening("door_gate", "door", {"": gate_shapes.gate()}, "", of_gates)
    models = {
        "sectional": gate_shapes.sectional_garage(),
        "wooden": gate_shapes.wooden_garage(),
    }
    of_barns = {
        "colour": {"natural": {"Leaf": "wood"}, **colours("brown", "green", "red")["colour"]}
    }
    barn = _opening("door_barn", "door", {"": gate_shapes.barn_gate()}, "", of_barns)
    of_garages = colours("white", "brown", "green", "grey", "red", "blue")
    garage = _opening("door_garage", "door", models, "style", of_garages)
    return (
        replace(house, widths=(0.6, 1.35)),
        replace(garage, widths=(1.9, 3.2)),
        replace(gate, widths=(3.2, 12.0)),
        replace(barn, widths=(3.2, 6.0)),
    )


def _opening(
    name: str,
    kind: str,
    models: dict[str, Model],
    model_set: str,
    looks: dict[str, dict[str, dict[str, str]]],
) -> AssetDesign:
    merged = {variant: parted_model(model) for variant, model in models.items()}
    return AssetDesign(name, kind, "building", merged, model_set, looks)


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
