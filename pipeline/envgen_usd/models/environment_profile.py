"""An environment (country and area type) as ranges and distributions of its figures.

A range is (low, high), drawn uniformly, or quantiles (`distribution.Quantiles`). Weights are
relative; their sum need not be 1. The type of a figure gives its bounds, and
`toml_files.read_toml` checks them. A build ends within minutes at each bound.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Literal, TypeAlias

from msgspec import Meta

from envgen_usd.models.actor_rules import ActorRules
from envgen_usd.models.building_rules import BuildingRules
from envgen_usd.models.distribution import RangeOf
from envgen_usd.models.figure_types import Share, Weight, Weights
from envgen_usd.models.land_rules import BlockRules, PlotRules, SquareRules, TerrainRules
from envgen_usd.models.road_marks import MarkRules

Enclosure: TypeAlias = Literal["none", "hedge", "fence", "wall"]
LightSides: TypeAlias = Literal["one", "both", "alternating"]

LEAST_FURNITURE_SPACING = 1.0
"""Least metres of sidewalk per item of furniture; a smaller value would fill the sidewalk."""


@dataclass(frozen=True)
class RoadLook:
    """Appearance of roads.

    Attributes:
        marking_colour: Colour of ``standard`` marks: ``white`` or ``yellow``.
        marking_width: Metres, for standard marks without a width in the file.
        dash_length: Metres, for broken marks without lines in the file.
        dash_gap: Metres between dashes.
        motorway_dash_length: Metres, for broken marks of motorways without lines in the file.
        motorway_dash_gap: Metres between dashes of motorways.
        materials: Weights of the materials of driving lanes; each road and junction draws.
        sidewalk_materials: Weights of the materials of sidewalks.
        kerb_materials: Weights of the materials of kerbs.
        kerb_height: Height in metres of sidewalks above the road where the file gives none.
    """

    marking_colour: str
    marking_width: Annotated[float, Meta(ge=0.01, le=2.0)]
    dash_length: Annotated[float, Meta(ge=0.1, le=100.0)]
    dash_gap: Annotated[float, Meta(ge=0.1, le=100.0)]
    motorway_dash_length: Annotated[float, Meta(ge=0.1, le=100.0)]
    motorway_dash_gap: Annotated[float, Meta(ge=0.1, le=100.0)]
    materials: Weights
    sidewalk_materials: Weights
    kerb_materials: Weights
    kerb_height: Annotated[float, Meta(ge=0.0, le=0.3)] = 0.12

    @property
    def marks(self) -> MarkRules:
        """Sizes of marks, for the road's surface."""
        return MarkRules(
            width=self.marking_width,
            dash_length=self.dash_length,
            dash_gap=self.dash_gap,
            motorway_dash_length=self.motorway_dash_length,
            motorway_dash_gap=self.motorway_dash_gap,
        )


@dataclass(frozen=True)
class TreeRules:
    """Trees of the environment.

    Attributes:
        density: Trees per hectare of free land.
        wood_density: Trees per hectare of wood.
        plot_density: Trees per hectare of a plot's free ground.
        park_density: Trees per hectare of a park.
        spacing: Least distance in metres between two trunks; larger values thin the trees out.
        clearance: Least distance in metres of a trunk from roads and buildings.
        height: Metres.
        crown: Diameter of the crown as a share of the height.
        assets: Weights of the assets of the library.
        variants: Weights of the variants in each variant set.
    """

    density: Annotated[float, Meta(ge=0.0, le=1000.0)]
    wood_density: Annotated[float, Meta(ge=0.0, le=1000.0)]
    plot_density: Annotated[float, Meta(ge=0.0, le=1000.0)]
    spacing: Annotated[float, Meta(ge=0.5, le=20.0)]
    clearance: Annotated[float, Meta(ge=0.0, le=50.0)]
    height: RangeOf[Annotated[float, Meta(ge=0.5, le=100.0)]]
    crown: RangeOf[Annotated[float, Meta(ge=0.05, le=2.0)]]
    assets: Weights
    variants: Mapping[str, Weights]
    park_density: Annotated[float, Meta(ge=0.0, le=1000.0)] = 60.0


@dataclass(frozen=True)
class StreetLightRules:
    """Street lights of the environment.

    Attributes:
        spacing: Metres between lights along each side of the road.
        jitter: Largest displacement of a light as a share of the spacing, 0 to 0.5.
        offset: Metres from the road's outer border.
        kerb_width: Least width in metres of a sidewalk with lights at its kerb.
        sides: ``one``, ``both`` or ``alternating``.
        height: Metres.
        assets: Weights of the assets of the library.
        variants: Weights of the variants in each variant set.
    """

    spacing: RangeOf[Annotated[float, Meta(ge=2.0, le=1000.0)]]
    jitter: Annotated[float, Meta(ge=0.0, le=0.5)]
    offset: RangeOf[Annotated[float, Meta(ge=0.0, le=20.0)]]
    kerb_width: Annotated[float, Meta(ge=1.5, le=20.0)]
    sides: LightSides
    height: RangeOf[Annotated[float, Meta(ge=1.0, le=50.0)]]
    assets: Weights
    variants: Mapping[str, Weights]


@dataclass(frozen=True)
class MainStreetLightRules(StreetLightRules):
    """Street lights of wide roads, in place of the usual ones.

    Attributes:
        width: Least width of such a road between its outer borders, metres: the median along it.
    """

    width: Annotated[float, Meta(ge=0.0, le=200.0)]


@dataclass(frozen=True)
class StreetTreeRules:
    """Rows of trees along the roads; a row has one kind of tree.

    Attributes:
        share: Share of the roads that have rows.
        spacing: Metres between trees along each side of the road.
        jitter: Largest displacement of a tree as a share of the spacing, 0 to 0.5.
        gaps: Share of the places of a row without a tree.
        offset: Metres from the road's outer border.
        pit_width: Least width in metres of a sidewalk with trees at its kerb.
        sides: ``one``, ``both`` or ``alternating``.
        height: Metres.
        crown: Diameter of the crown as a share of the height.
        assets: Weights of the assets of the library.
        variants: Weights of the variants in each variant set.
    """

    share: Share
    spacing: RangeOf[Annotated[float, Meta(ge=2.0, le=1000.0)]]
    jitter: Annotated[float, Meta(ge=0.0, le=0.5)]
    gaps: Share
    offset: RangeOf[Annotated[float, Meta(ge=0.0, le=20.0)]]
    pit_width: Annotated[float, Meta(ge=1.5, le=20.0)]
    sides: LightSides
    height: RangeOf[Annotated[float, Meta(ge=0.5, le=100.0)]]
    crown: RangeOf[Annotated[float, Meta(ge=0.05, le=2.0)]]
    assets: Weights
    variants: Mapping[str, Weights]


@dataclass(frozen=True)
class EnclosureRules:
    """Enclosures along the borders of plots.

    Attributes:
        kinds: Weights of ``none``, ``hedge``, ``fence``, ``wall`` for a plot.
        height: Metres.
        gate: Least metres of gap in front of the door; a garage has a gap of its width.
        materials: Weights of the materials of hedges and walls; each plot draws. Fences and gates
            are assets, weighted by ``props.fence`` and ``props.gate``.
        gates: Share of the enclosed plots whose gaps have gates.
    """

    kinds: Annotated[Mapping[Enclosure, Weight], Meta(min_length=1)]
    height: RangeOf[Annotated[float, Meta(ge=0.1, le=10.0)]]
    gate: Annotated[float, Meta(ge=0.0, le=50.0)]
    materials: Mapping[Literal["hedge", "wall"], Weights]
    gates: Share = 0.0


@dataclass(frozen=True)
class GardenRules:
    """Gardens.

    Attributes:
        flower_beds: Share of the front gardens with flower beds, where there is room.
        terraces: Share of the houses with a terrace at the back, where there is room.
        sheds: Share of the gardens behind houses with a shed.
        clothes_lines: Share of the gardens behind houses with a clothes line.
        allotments: True for sheds and beds on allotments.
    """

    flower_beds: Share = 0.0
    terraces: Share = 0.0
    sheds: Share = 0.0
    clothes_lines: Share = 0.0
    allotments: bool = False


Spacing: TypeAlias = Annotated[float, Meta(ge=0.0, le=10000.0)]
"""Metres of sidewalk for each item; 0 without items."""


@dataclass(frozen=True)
class FurnitureRules:
    """Street furniture on sidewalks: metres of sidewalk for each item, 0 without items.

    Each name is a kind of asset. A figure between 0 and `LEAST_FURNITURE_SPACING` raises a
    ValueError.

    Attributes:
        bench: For benches.
        bin: For litter bins.
        bollard: For groups of bollards at the kerb.
        hydrant: For hydrants.
        bicycle_rack: For racks with bicycles.
        bus_stop: For shelters.
        control_box: For cabinets.
        gully: For gratings in the gutter of the carriageway beside it.
        hoarding: For advertising panels.
        mailbox: For mailboxes.
        parking_meter: For ticket machines.
        phone_box: For telephone boxes.
        pole: For bare poles at the kerb.
        street_sign: For small signs on posts at the kerb: parking, no parking, footway.
        utility_pole: For wooden poles with wires, along a side of each road.
    """

    bench: Spacing
    bin: Spacing
    bollard: Spacing
    hydrant: Spacing
    bicycle_rack: Spacing = 0.0
    bus_stop: Spacing = 0.0
    control_box: Spacing = 0.0
    gully: Spacing = 0.0
    hoarding: Spacing = 0.0
    mailbox: Spacing = 0.0
    parking_meter: Spacing = 0.0
    phone_box: Spacing = 0.0
    pole: Spacing = 0.0
    street_sign: Spacing = 0.0
    utility_pole: Spacing = 0.0

    def __post_init__(self) -> None:
        """Refuses a spacing below `LEAST_FURNITURE_SPACING`."""
        for name, spacing in vars(self).items():
            if 0.0 < spacing < LEAST_FURNITURE_SPACING:
                raise ValueError(
                    f"{name}: expected 0 or at least {LEAST_FURNITURE_SPACING:g}, not {spacing:g}"
                )


Density: TypeAlias = Annotated[float, Meta(ge=0.0, le=200.0)]
"""Number on a hectare of the free ground of plots."""


@dataclass(frozen=True)
class YardRules:
    """What stands on the free ground of plots, as a number on a hectare, and in harbours.

    Attributes:
        container: Freight containers.
        pallets: Stacks of pallets.
        silo: Silos.
        stacks: Share of the places of containers in harbours that hold some.
        cranes: Least distance of cranes along quays, metres; 0 without cranes.
    """

    container: Density = 0.0
    pallets: Density = 0.0
    silo: Density = 0.0
    stacks: Share = 0.7
    cranes: Annotated[float, Meta(ge=0.0, le=1000.0)] = 0.0


@dataclass(frozen=True)
class PropRules:
    """Choice of the assets of a kind of furniture.

    Attributes:
        assets: Weights of the assets of the library; empty: all of the kind are equally likely.
        variants: Weights of the variants in each variant set.
    """

    assets: Mapping[str, Weight] = field(default_factory=dict)
    variants: Mapping[str, Weights] = field(default_factory=dict)


@dataclass(frozen=True)
class WearRules:
    """How much use and weather show, as factors of what each material can show.

    Attributes:
        ground: Of tracks, repairs, cracks and stains on roads and sidewalks, and of worn paint.
        walls: Of dirt, streaks and soot on walls.
        sills: Share of the windows above others with dirt or rust on the wall below, 0 to 1.
    """

    ground: Annotated[float, Meta(ge=0.0, le=2.0)] = 1.0
    walls: Annotated[float, Meta(ge=0.0, le=2.0)] = 1.0
    sills: Annotated[float, Meta(ge=0.0, le=1.0)] = 0.5


@dataclass(frozen=True)
class Profile:
    """An environment: country and area type (Table A1 of the article, with figures).

    Attributes:
        country: Name of the country's folder without ``country_``.
        area: Stem of the environment's file.
        description: Row of Table A1: the words for each property.
        ground_materials: Material of each landuse class, by the class's name in lower case.
        road: Roads.
        plots: Plots.
        buildings: Buildings.
        trees: Trees.
        street_lights: Street lights.
        main_street_lights: Street lights of wide roads; `None` means the usual ones.
        street_trees: Rows of trees along the roads.
        enclosures: Hedges and fences.
        furniture: Spacing of what stands on sidewalks.
        terrain: Terrain.
        props: Assets and variants of the other kinds of props, by kind, e.g. ``bench``.
        wear: Use and weather of the surfaces.
        yard: What stands on the free ground of plots.
        gardens: Gardens.
        blocks: Land inside of blocks and behind the outermost streets.
        squares: Town squares.
        actors: Parked vehicles and standing people; `None` means empty streets.
        source: Path of the environment's file, for messages.
    """

    country: str
    area: str
    description: Mapping[str, str]
    ground_materials: Mapping[str, str]
    road: RoadLook
    plots: PlotRules
    buildings: BuildingRules
    trees: TreeRules
    street_lights: StreetLightRules
    street_trees: StreetTreeRules
    enclosures: EnclosureRules
    furniture: FurnitureRules
    terrain: TerrainRules
    props: Mapping[str, PropRules] = field(default_factory=dict)
    wear: WearRules = WearRules()
    yard: YardRules = YardRules()
    gardens: GardenRules = GardenRules()
    blocks: BlockRules = field(default_factory=BlockRules)
    squares: SquareRules = field(default_factory=SquareRules)
    actors: ActorRules | None = None
    main_street_lights: MainStreetLightRules | None = None
    source: str = ""
