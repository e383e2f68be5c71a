"""Ranges and weights of an environment's buildings."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Literal, TypeAlias

from msgspec import Meta

from envgen_usd.models.distribution import Correlation, RangeOf
from envgen_usd.models.figure_types import Share, Weight, Weights

Style: TypeAlias = Literal["detached", "row", "hall"]
Function: TypeAlias = Literal["residential", "industrial", "school", "shop", "garages", "barn"]
Roof: TypeAlias = Literal[
    "flat", "shed", "gabled", "hipped", "pyramidal", "mansard", "barrel", "sawtooth"
]
Footprint: TypeAlias = Literal["rectangle", "l", "t", "u"]


PLOT_FIGURES = ("plot_width",)
"""Figures of a plot that a building's may depend on, of its largest rectangle, metres.

Its depth is none of them: it follows from the block rather than from the building.
"""
CORRELATED = ("width", "depth", "storeys", "setback", "side_setback")
"""Figures of a building that may depend on one another."""


@dataclass(frozen=True)
class OpeningRules:
    """Windows or doors of a facade.

    Attributes:
        width: Metres.
        height: Metres.
        sill: Height of the lower edge above the storey's floor, metres.
        spacing: Metres of facade for each opening of a storey; a larger value gives fewer openings.
        assets: Weights of the assets of the library.
        variants: Weights of the variants in each variant set of the asset.
    """

    width: RangeOf[Annotated[float, Meta(ge=0.2, le=20.0)]]
    height: RangeOf[Annotated[float, Meta(ge=0.2, le=20.0)]]
    sill: RangeOf[Annotated[float, Meta(ge=0.0, le=20.0)]]
    spacing: RangeOf[Annotated[float, Meta(ge=0.5, le=1000.0)]]
    assets: Weights
    variants: Mapping[str, Weights]


@dataclass(frozen=True)
class BuildingDetails:
    """Parts of houses besides walls, windows and roof; shares are probabilities, 0 to 1.

    Attributes:
        footprints: Weights of ``rectangle``, ``l``, ``t``, ``u``; all but the first need depth.
        front_gable: Share of L-shaped houses whose wing stands towards the street.
        bays: Share of houses with a bay at the street.
        dormers: Share of pitched roofs with dormers.
        roof_windows: Share of pitched roofs without dormers that have roof windows.
        balconies: Share of houses with balconies.
        porches: Share of houses with a canopy over the door.
        garages: Share of houses with a garage, where the plot is wide enough.
        embrasure: Metres between the wall's outer face and its windows and doors.
        shops: Share of houses with a shop front on the ground floor, where the wall is long enough.
        awnings: Share of shop fronts with an awning.
        gutters: Share of houses with gutters and rainwater pipes.
        courses: Share of houses with a course of stone between the two lowest storeys.
        cornices: Share of houses with a cornice below the roof.
        dishes: Share of houses with a satellite dish on the street wall.
        aerials: Share of houses with a television aerial.
        street_balconies: Share of houses of several storeys with balconies over the street, where
            the front garden is deep enough.
        back_buildings: Share of houses with another building behind them, at the back of the plot,
            where it is deep enough.
        gable_windows: Share of the side walls of row houses, where no house stands beside them,
            that have windows.
    """

    footprints: Annotated[Mapping[Footprint, Weight], Meta(min_length=1)]
    front_gable: Share
    bays: Share
    dormers: Share
    roof_windows: Share
    balconies: Share
    porches: Share
    garages: Share
    embrasure: RangeOf[Annotated[float, Meta(ge=0.0, le=0.5)]]
    shops: Share = 0.0
    awnings: Share = 0.0
    gutters: Share = 0.0
    courses: Share = 0.0
    cornices: Share = 0.0
    dishes: Share = 0.0
    aerials: Share = 0.0
    street_balconies: Share = 0.0
    back_buildings: Share = 0.0
    gable_windows: Share = 0.0


def _barn_walls() -> Weights:
    return {"wood": 4.0, "sheet_metal": 1.0, "sheet_metal_green": 1.0}


def _barn_roofs() -> Weights:
    return {"sheet_metal_roof": 2.0, "roof_tiles_weathered": 1.0}


@dataclass(frozen=True)
class BarnRules:
    """Barns, stables and sheds: behind houses, and those of maps.

    Attributes:
        share: Share of the buildings behind houses that are barns.
        width: Metres along the street.
        depth: Metres away from the street.
        height: Height of the walls, metres.
        roof_pitch: Degrees.
        materials: Weights of the materials of walls.
        roof_materials: Weights of the materials of roofs.
    """

    share: Share = 0.0
    width: RangeOf[Annotated[float, Meta(ge=2.0, le=200.0)]] = (14.0, 26.0)
    depth: RangeOf[Annotated[float, Meta(ge=2.0, le=200.0)]] = (9.0, 14.0)
    height: RangeOf[Annotated[float, Meta(ge=2.0, le=20.0)]] = (3.8, 5.2)
    roof_pitch: RangeOf[Annotated[float, Meta(ge=1.0, le=75.0)]] = (17.0, 27.0)
    materials: Weights = field(default_factory=_barn_walls)
    roof_materials: Weights = field(default_factory=_barn_roofs)


@dataclass(frozen=True)
class BuildingRules:
    """Buildings of the environment.

    Attributes:
        style: ``detached``, ``row`` (party walls along the street) or ``hall``.
        function: ``residential`` or ``industrial``; ``school``, ``shop`` and ``garages`` are those
            of whole plots with that use, and ``barn`` that of `barns`.
        width: Metres along the street; clipped to the plot.
        depth: Metres away from the street; clipped to the plot.
        setback: Metres from the plot's street side.
        side_setback: Metres from the plot's other sides; 0 for rows.
        storeys: Whole numbers, both ends included.
        storey_height: Metres.
        roofs: Weights of ``flat``, ``shed``, ``gabled``, ``hipped``, ``pyramidal``, ``mansard``,
            ``barrel``, ``sawtooth``.
        roof_pitch: Degrees; shed roofs have at most 14.
        overhang: Metres of eaves.
        chimney: Probability of a chimney.
        materials: Weights of facade materials.
        roof_materials: Weights of materials of pitched roofs.
        flat_roof_materials: Weights of materials of flat roofs.
        windows: Rules for windows.
        doors: Rules for doors; for warehouses, gates.
        details: Parts besides walls, windows and roof.
        correlation: Dependence of `CORRELATED` on one another, given `PLOT_FIGURES`; `None` draws
            them independently.
        barns: Barns, stables and sheds.
    """

    style: Style
    function: Function
    width: RangeOf[Annotated[float, Meta(ge=2.0, le=200.0)]]
    depth: RangeOf[Annotated[float, Meta(ge=2.0, le=200.0)]]
    setback: RangeOf[Annotated[float, Meta(ge=0.0, le=100.0)]]
    side_setback: RangeOf[Annotated[float, Meta(ge=0.0, le=100.0)]]
    storeys: RangeOf[Annotated[float, Meta(ge=1.0, le=60.0)]]
    storey_height: RangeOf[Annotated[float, Meta(ge=2.0, le=20.0)]]
    roofs: Annotated[Mapping[Roof, Weight], Meta(min_length=1)]
    roof_pitch: RangeOf[Annotated[float, Meta(ge=1.0, le=75.0)]]
    overhang: RangeOf[Annotated[float, Meta(ge=0.0, le=3.0)]]
    chimney: Share
    materials: Weights
    roof_materials: Weights
    flat_roof_materials: Weights
    windows: OpeningRules
    doors: OpeningRules
    details: BuildingDetails
    correlation: Correlation | None = None
    barns: BarnRules = field(default_factory=BarnRules)

    def __post_init__(self) -> None:
        """Refuses correlations of figures that do not depend on one another."""
        if self.correlation is None:
            return
        free = self.correlation.figures[len(PLOT_FIGURES) :]
        if tuple(self.correlation.known) != PLOT_FIGURES or not set(free) <= set(CORRELATED):
            raise ValueError(
                f"correlation: expected the known figure {', '.join(PLOT_FIGURES)}, and of "
                f"{', '.join(CORRELATED)}; not {', '.join(self.correlation.figures)}"
            )
