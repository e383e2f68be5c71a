"""The street furniture of the shipped library."""

from collections.abc import Mapping

from envgen_usd.assets.asset_design import AssetDesign, Model, parted_model
from envgen_usd.assets.shapes import (
    crane_shapes,
    fence_shapes,
    furniture_shapes,
    garden_shapes,
    leaf_gate_shapes,
    pavement_shapes,
    seat_shapes,
    square_shapes,
    wheeled_bin_shapes,
    yard_shapes,
)

Looks = Mapping[str, Mapping[str, Mapping[str, str]]]


def furniture_designs() -> tuple[AssetDesign, ...]:
    """All street furniture besides lights, signs and what carries print, by kind."""
    return (*_designed(), *_posts(), *_single(), *_yards(), *_squares(), *_gardens(), *_fences())


def _colours(part: str, *names: str) -> Looks:
    return {"colour": {name: {part: f"paint_{name}"} for name in names}}


def _designed() -> tuple[AssetDesign, ...]:
    """Kinds with several designs that are no poles."""
    benches = {
        "slatted": furniture_shapes.bench(),
        "stone": seat_shapes.stone_bench(),
        "steel": seat_shapes.steel_bench(),
    }
    bins = {
        "round": furniture_shapes.bin_(),
        "pillar": seat_shapes.pillar_bin(),
        "post": seat_shapes.post_bin(),
    }
    hydrants = {"pillar": furniture_shapes.hydrant(), "squat": seat_shapes.squat_hydrant()}
    rails = {
        "single": furniture_shapes.guard_rail_post(double=False),
        "double": furniture_shapes.guard_rail_post(double=True),
    }
    bin_looks = _colours("Body", "black", "green", "grey", "red")
    hydrant_looks = _colours("Body", "red", "yellow", "blue")
    return (
        _designs("bench", "static", benches),
        _designs("bin", "static", bins, bin_looks),
        _designs("guard_rail", "guard_rail", rails),
        _designs("hydrant", "static", hydrants, hydrant_looks),
    )


def _posts() -> tuple[AssetDesign, ...]:
    bollards = {
        "steel": furniture_shapes.bollard(),
        "heritage": pavement_shapes.heritage_bollard(),
        "concrete": pavement_shapes.concrete_bollard(),
    }
    poles = {
        "plain": furniture_shapes.plain_pole(),
        "slim": pavement_shapes.slim_post(),
        "banner": pavement_shapes.banner_post(),
    }
    return (
        _designs("bollard", "pole", bollards),
        _single_design("delineator", "pole", furniture_shapes.delineator()),
        _designs("pole", "pole", poles),
        _single_design("utility_pole", "pole", pavement_shapes.utility_pole()),
    )


def _single() -> tuple[AssetDesign, ...]:
    """Kinds with one geometry that are no poles."""
    bicycles = {"paint": {name: {"Bicycles": f"paint_{name}"} for name in ("blue", "red", "grey")}}
    models: dict[str, tuple[Model, Looks]] = {
        "barrel": (furniture_shapes.barrel(), {}),
        "bicycle_rack": (pavement_shapes.bicycle_rack(), bicycles),
        "control_box": (furniture_shapes.control_box(), _colours("Body", "grey", "green")),
        "phone_box": (parted_model(pavement_shapes.phone_box()), {}),
        "mooring": (parted_model(yard_shapes.mooring()), {}),
        "traffic_cone": (furniture_shapes.traffic_cone(), {}),
    }
    lids = ("black", "blue", "yellow", "brown", "green")
    wheeled = {"lid": {name: dict.fromkeys(("Lid", "LidProxy"), f"paint_{name}") for name in lids}}
    models["wheelie_bin"] = (parted_model(wheeled_bin_shapes.wheelie_bin()), wheeled)
    singles = (
        _single_design(kind, "static", model, looks) for kind, (model, looks) in models.items()
    )
    # Cityscapes counts the buildings of bus stops as building.
    shelter = parted_model(furniture_shapes.shelter())
    return (*singles, _single_design("bus_stop", "building", shelter))


def _yards() -> tuple[AssetDesign, ...]:
    """What lies on roads and stands on yards."""
    gratings = {
        "barred": parted_model(yard_shapes.gully(slotted=False)),
        "slotted": parted_model(yard_shapes.gully(slotted=True)),
    }
    pallets = {
        "stack": parted_model(yard_shapes.pallets(loaded=False)),
        "loaded": parted_model(yard_shapes.pallets(loaded=True)),
    }
    silos = {
        "tall": parted_model(yard_shapes.silo(tall=True)),
        "low": parted_model(yard_shapes.silo(tall=False)),
    }
    cranes = {
        "portal": parted_model(crane_shapes.portal_crane(large=False)),
        "portal_large": parted_model(crane_shapes.portal_crane(large=True)),
        "gantry": parted_model(crane_shapes.gantry_crane()),
    }
    paints = ("blue", "red", "yellow", "grey", "green")
    crane_looks = {
        "paint": {name: dict.fromkeys(("Frame", "FrameProxy"), f"paint_{name}") for name in paints}
    }
    colours = ("blue", "red", "green", "grey", "orange", "brown")
    boxes = {
        "colour": {name: dict.fromkeys(("Body", "BodyProxy"), f"paint_{name}") for name in colours}
    }
    return (
        _designs("crane", "static", cranes, crane_looks),
        _designs("gully", "road", gratings),
        _single_design("container", "static", parted_model(yard_shapes.container()), boxes),
        _designs("pallets", "static", pallets),
        _designs("silo", "building", silos),
    )


def _squares() -> tuple[AssetDesign, ...]:
    """What stands on town squares."""
    fountains = {
        "bowl": parted_model(square_shapes.bowl_fountain()),
        "trough": parted_model(square_shapes.trough_fountain()),
    }
    monuments = {
        "obelisk": parted_model(square_shapes.obelisk()),
        "column": parted_model(square_shapes.column()),
    }
    planters = {
        "round": parted_model(square_shapes.round_planter()),
        "square": parted_model(square_shapes.square_planter()),
    }
    pits = {
        "kerb": parted_model(square_shapes.kerbed_pit()),
        "grille": parted_model(square_shapes.grille_pit()),
    }
    return (
        _designs("fountain", "static", fountains),
        _designs("monument", "static", monuments),
        _designs("planter", "static", planters),
        _designs("tree_pit", "terrain", pits),
    )


def _gardens() -> tuple[AssetDesign, ...]:
    """What stands in gardens."""
    timbers = {"natural": "wood", "green": "paint_green", "brown": "paint_brown"}
    looks = {
        "timber": {
            name: dict.fromkeys(("Boards", "BoardsProxy"), material)
            for name, material in timbers.items()
        }
    }
    sheds = {
        "gabled": parted_model(garden_shapes.shed(gabled=True)),
        "pent": parted_model(garden_shapes.shed(gabled=False)),
    }
    lines = {
        "laden": parted_model(garden_shapes.clothes_line(laden=True)),
        "bare": parted_model(garden_shapes.clothes_line(laden=False)),
    }
    terraces = {
        "stone": parted_model(garden_shapes.terrace(wooden=False)),
        "wooden": parted_model(garden_shapes.terrace(wooden=True)),
    }
    return (
        _designs("shed", "building", sheds, looks),
        _designs("clothes_line", "static", lines),
        _designs("terrace", "static", terraces),
    )


def _fences() -> tuple[AssetDesign, ...]:
    """Panels of fences, and gates that fit into them."""
    timber = {
        "natural": "wood",
        "white": "paint_white",
        "brown": "paint_brown",
        "grey": "paint_grey",
    }
    metal = {"black": "paint_black", "green": "paint_green", "galvanised": "metal_galvanised"}
    looks = {
        name: {
            variant: dict.fromkeys((part, f"{part}Proxy"), material)
            for variant, material in of.items()
        }
        for name, part, of in (("timber", "Timber", timber), ("metal", "Iron", metal))
    }
    gates = {
        "gate_garden": (leaf_gate_shapes.garden_gates(), "design", looks, (0.7, 2.0)),
        "gate_drive": (leaf_gate_shapes.drive_gates(), "design", looks, (2.0, 5.0)),
        "gate_yard": (
            {"": leaf_gate_shapes.yard_gate()}, "", {"metal": looks["metal"]}, (5.0, 12.0)
        ),
    }  # fmt: skip
    return (
        AssetDesign(
            "fence", "fence", "fence", _parted(fence_shapes.fence_panels()), "design", looks
        ),
        *(
            AssetDesign(name, "gate", "fence", _parted(models), of, sets, widths=widths)
            for name, (models, of, sets, widths) in gates.items()
        ),
    )


def _parted(models: Mapping[str, Model]) -> dict[str, Model]:
    return {variant: parted_model(model) for variant, model in models.items()}


def _designs(
    kind: str, label: str, models: Mapping[str, Model], looks: Looks | None = None
) -> AssetDesign:
    return AssetDesign(kind, kind, label, models, "design", looks or {})


def _single_design(kind: str, label: str, model: Model, looks: Looks | None = None) -> AssetDesign:
    return AssetDesign(kind, kind, label, {"": model}, "", looks or {})
