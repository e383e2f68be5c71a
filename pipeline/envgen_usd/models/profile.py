"""What an environment (country, area type) looks like: ranges and distributions.

A range is (low, high), drawn uniformly. Weights are relative and need not add up to one.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeAlias

from envgen_usd.models.landuse import LanduseClass

Range: TypeAlias = tuple[float, float]
Weights: TypeAlias = Mapping[str, float]


@dataclass(frozen=True)
class RoadLook:
    """How roads look.

    Attributes:
        marking_colour: What colour ``standard`` marks have: ``white`` or ``yellow``.
        marking_width: Metres, of a standard mark whose width the file does not give.
        dash_length: Metres, of a broken mark whose lines the file does not give.
        dash_gap: Metres.
        material: Material of driving lanes.
        sidewalk_material: Material of sidewalks.
    """

    marking_colour: str
    marking_width: float
    dash_length: float
    dash_gap: float
    material: str
    sidewalk_material: str


@dataclass(frozen=True)
class PlotRules:
    """How plots lie along the road.

    Attributes:
        frontage: Width along the street, metres.
        depth: Depth away from the street, metres.
        verge: Width of the strip between road and plot, metres.
        gap: Free land between groups of plots, metres.
        group: Plots in a row without a gap.
        occupancy: Share of groups that are there at all, 0 to 1.
        rows: Rows of plots behind one another.
        landuse: Ground of a plot.
        wood: Share of the free land under trees, 0 to 1.
    """

    frontage: Range
    depth: Range
    verge: Range
    gap: Range
    group: Range
    occupancy: float
    rows: int
    landuse: LanduseClass
    wood: float


@dataclass(frozen=True)
class OpeningRules:
    """Windows or doors of a facade.

    Attributes:
        width: Metres.
        height: Metres.
        sill: Height of the lower edge above the storey's floor, metres.
        spacing: Metres of facade for each opening of a storey; few windows: a large number.
        assets: Weights of the assets of the library.
        variants: For each variant set of the asset, the weights of its variants.
    """

    width: Range
    height: Range
    sill: Range
    spacing: Range
    assets: Weights
    variants: Mapping[str, Weights]


@dataclass(frozen=True)
class BuildingDetails:
    """What houses have besides walls, windows and a roof; shares are probabilities, 0 to 1.

    Attributes:
        footprints: Weights of ``rectangle``, ``l``, ``t``, ``u``; all but the first need depth.
        front_gable: Share of L-shaped houses whose wing stands towards the street.
        bays: Share of houses with a bay at the street.
        dormers: Share of pitched roofs with dormers.
        roof_windows: Share of pitched roofs without dormers that have roof windows.
        balconies: Share of houses with balconies.
        porches: Share of houses with a roof over the door.
        garages: Share of houses with a garage beside them, where the plot is wide enough.
        embrasure: How far windows and doors lie behind the wall, metres.
    """

    footprints: Weights
    front_gable: float
    bays: float
    dormers: float
    roof_windows: float
    balconies: float
    porches: float
    garages: float
    embrasure: Range


@dataclass(frozen=True)
class BuildingRules:
    """Buildings of the environment.

    Attributes:
        style: ``detached``, ``row`` (party walls along the street) or ``hall``.
        function: ``residential`` or ``industrial``.
        width: Along the street, metres; clipped to the plot.
        depth: Away from the street, metres; clipped to the plot.
        setback: From the plot's street side, metres.
        side_setback: From the plot's other sides, metres; 0 for rows.
        storeys: Whole numbers, both ends included.
        storey_height: Metres.
        roofs: Weights of ``flat``, ``shed``, ``gabled``, ``hipped``, ``pyramidal``, ``mansard``,
            ``barrel``, ``sawtooth``.
        roof_pitch: Degrees.
        overhang: Metres.
        chimney: Probability.
        materials: Weights of facade materials.
        roof_materials: Weights of materials of pitched roofs.
        flat_roof_materials: Weights of materials of flat roofs.
        windows: Window rules.
        doors: Door rules (warehouses: gates).
        details: What houses have besides.
    """

    style: str
    function: str
    width: Range
    depth: Range
    setback: Range
    side_setback: Range
    storeys: Range
    storey_height: Range
    roofs: Weights
    roof_pitch: Range
    overhang: Range
    chimney: float
    materials: Weights
    roof_materials: Weights
    flat_roof_materials: Weights
    windows: OpeningRules
    doors: OpeningRules
    details: BuildingDetails


@dataclass(frozen=True)
class TreeRules:
    """Trees of the environment.

    Attributes:
        density: Trees in a hectare of free land.
        wood_density: Trees in a hectare of wood.
        plot_density: Trees in a hectare of a plot's free ground.
        spacing: Least distance between two trunks, metres.
        clearance: Least distance of a trunk from roads and buildings, metres.
        height: Metres.
        crown: Diameter of the crown as a share of the height.
        assets: Weights of the assets of the library.
        variants: For each variant set, the weights of its variants.
    """

    density: float
    wood_density: float
    plot_density: float
    spacing: float
    clearance: float
    height: Range
    crown: Range
    assets: Weights
    variants: Mapping[str, Weights]


@dataclass(frozen=True)
class StreetLightRules:
    """Street lights of the environment.

    Attributes:
        spacing: Metres along one side of the road.
        jitter: Share of the spacing by which a light may be moved, 0 to 0.5.
        offset: From the road's outer border, metres.
        sides: ``one``, ``both`` or ``alternating``.
        height: Metres.
        assets: Weights of the assets of the library.
        variants: For each variant set, the weights of its variants.
    """

    spacing: Range
    jitter: float
    offset: Range
    sides: str
    height: Range
    assets: Weights
    variants: Mapping[str, Weights]


@dataclass(frozen=True)
class EnclosureRules:
    """What stands along the borders of plots.

    Attributes:
        kinds: Weights of ``none``, ``hedge``, ``fence``, ``wall`` for each plot.
        height: Metres.
        gate: Width of the gap in front of the door, metres.
        materials: Material of each kind.
    """

    kinds: Weights
    height: Range
    gate: float
    materials: Mapping[str, str]


@dataclass(frozen=True)
class FurnitureRules:
    """Street furniture along roads with a sidewalk: metres of road for each, 0 for none.

    Attributes:
        bench: Benches.
        bin: Bins.
        bollard: Groups of bollards at the kerb.
        hydrant: Hydrants.
    """

    bench: float
    bin: float
    bollard: float
    hydrant: float


@dataclass(frozen=True)
class TerrainRules:
    """Ground beside the road.

    Attributes:
        relief: Amplitude of seeded hills away from the road, metres; 0 for flat country.
        relief_wavelength: Metres.
        bank_slope: Steepest slope beside the road, metres a metre.
    """

    relief: float
    relief_wavelength: float
    bank_slope: float


@dataclass(frozen=True)
class Profile:
    """An environment: one country and area type (Table A1 of the article, with figures).

    Attributes:
        country: Name of its folder, without ``country_``.
        area: Name of its file, without the ending.
        description: The row of Table A1: property to words.
        ground_materials: Material of each landuse class, by the class's lower-case name.
        road: Roads.
        plots: Plots.
        buildings: Buildings.
        trees: Trees.
        street_lights: Street lights.
        enclosures: Hedges and fences.
        furniture: Benches and the like.
        terrain: Terrain.
        source: File that all of this was read from, for messages.
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
    enclosures: EnclosureRules
    furniture: FurnitureRules
    terrain: TerrainRules
    source: str = ""
