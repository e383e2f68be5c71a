"""Rules of an environment's land: plots, blocks, terrain."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Literal, TypeAlias

from msgspec import Meta

from envgen_usd.models.distribution import RangeOf
from envgen_usd.models.figure_types import Share, Weight
from envgen_usd.models.landuse import LanduseClass


@dataclass(frozen=True)
class PlotRules:
    """Layout of plots along the road.

    Attributes:
        frontage: Width along the street, metres.
        depth: Depth away from the street, metres.
        verge: Width of the strip between road and plot, metres.
        gap: Metres of free land between groups of plots.
        group: Number of adjoining plots.
        occupancy: Share of groups that exist, 0 to 1.
        rows: Rows of plots behind each other.
        infill: Share of the gaps in street fronts, corners included, that become plots, 0 to 1;
            above 0, plots also get the land inside of their block.
        landuse: Landuse class of a plot's ground.
        wood: Share of the free land under trees, 0 to 1.
    """

    frontage: RangeOf[Annotated[float, Meta(ge=2.0, le=500.0)]]
    depth: RangeOf[Annotated[float, Meta(ge=2.0, le=500.0)]]
    verge: RangeOf[Annotated[float, Meta(ge=0.0, le=50.0)]]
    gap: RangeOf[Annotated[float, Meta(ge=0.0, le=1000.0)]]
    group: RangeOf[Annotated[float, Meta(ge=1.0, le=100.0)]]
    occupancy: Share
    rows: Annotated[int, Meta(ge=1, le=10)]
    infill: Share
    landuse: LanduseClass
    wood: Share


Use: TypeAlias = Literal["park", "parking", "allotment", "school", "shop", "garages"]
"""Use of a whole plot without a house, by the name of its landuse class in lower case."""

Crop: TypeAlias = Literal["field", "crop", "orchard", "grass", "water", "quay"]
"""What a field holds, by the name of its landuse class in lower case; ``grass`` is mown. Basins of
``water`` and yards (``quay``) make a harbour."""

Border: TypeAlias = Literal["wood", "quay"]
"""What lies between fields: hedges, or the paved walls of basins."""


Apart: TypeAlias = Annotated[float, Meta(ge=0.0, le=100.0)]
"""Distance between objects of a kind, metres; 0 without objects."""
LEAST_APART = 1.0
"""Least distance between objects of a kind, metres; a smaller value would leave no way between."""


@dataclass(frozen=True)
class BlockRules:
    """Land inside of blocks, and land behind the outermost streets.

    Without this table, land behind the plots at the street stays free.

    Attributes:
        inner: Share of the rows of plots inside of blocks that hold houses, at lanes of their own;
            the other rows are whole plots with a use.
        uses: Weights of the uses of whole plots: inside of blocks, and of gaps in the street front
            that `PlotRules.infill` leaves. Empty: such land stays free.
        falloff: Share by which `PlotRules.infill` and `inner` are smaller at the outermost street
            than in the middle of the map.
        outer_rows: Rows of plots behind each other outside of the outermost streets.
        ends: Share of the ends of roads behind which a street goes on between houses, up to a
            street across with houses behind it. Behind the others a paved way goes on alone.
        fields: Share of the land behind the outermost plots that is tilled, in fields with hedges.
        crops: Weights of what the fields hold. Empty: all are ``field``.
        borders: What lies between them.
        field_width: Width of that land, metres; 0 without fields.
        field_edge: Distance of that land from roads, metres.
        forest: Width of the forest around all, which ends the view, metres; 0 without forest.
    """

    inner: Share = 0.0
    uses: Mapping[Use, Weight] = field(default_factory=dict)
    falloff: Share = 0.0
    outer_rows: Annotated[int, Meta(ge=1, le=3)] = 1
    ends: Share = 0.0
    fields: Share = 0.0
    crops: Mapping[Crop, Weight] = field(default_factory=dict)
    borders: Border = "wood"
    field_width: Annotated[float, Meta(ge=0.0, le=100.0)] = 0.0
    field_edge: Annotated[float, Meta(ge=0.0, le=100.0)] = 8.0
    forest: Annotated[float, Meta(ge=0.0, le=100.0)] = 0.0


Centre: TypeAlias = Literal["none", "fountain", "monument"]
"""What stands in the middle of a square, by its kind of asset."""


@dataclass(frozen=True)
class SquareRules:
    """Town squares: paved land in the place of plots at the street.

    Attributes:
        share: Share of the plots at streets that give way to squares.
        width: Width along the street, metres; a square is as deep as the plots beside it.
        centres: Weights of what stands in the middle.
        trees: Distance of the trees around it, metres; 0 without trees.
        lamps: Distance of the lamps around it, metres; 0 without lamps.
        benches: Distance of the benches around it, metres; 0 without benches.
        planters: Distance of the planters at the street, metres; 0 without planters.
        bollards: Distance of the bollards at the street, metres; 0 without bollards.
    """

    share: Share = 0.0
    width: RangeOf[Annotated[float, Meta(ge=10.0, le=200.0)]] = (28.0, 44.0)
    centres: Mapping[Centre, Weight] = field(default_factory=dict)
    trees: Apart = 9.0
    lamps: Apart = 16.0
    benches: Apart = 9.0
    planters: Apart = 0.0
    bollards: Apart = 0.0

    def __post_init__(self) -> None:
        """Refuses a distance below `LEAST_APART`."""
        for name in ("trees", "lamps", "benches", "planters", "bollards"):
            apart = getattr(self, name)
            if 0.0 < apart < LEAST_APART:
                raise ValueError(f"{name}: expected 0 or at least {LEAST_APART:g}, not {apart:g}")


@dataclass(frozen=True)
class TerrainRules:
    """Ground beside the road.

    Attributes:
        relief: Amplitude of seeded hills away from the road, metres; 0 for flat country.
        relief_wavelength: Metres from hill to hill; a larger value gives gentler hills.
        bank_slope: Steepest slope of embankments and cuttings, metres per metre.
        bank_height: Height of natural banks above the water, metres.
        quay_height: Height of quays above the water, metres.
    """

    relief: Annotated[float, Meta(ge=0.0, le=300.0)]
    relief_wavelength: Annotated[float, Meta(ge=20.0, le=10000.0)]
    bank_slope: Annotated[float, Meta(ge=0.05, le=5.0)]
    bank_height: Annotated[float, Meta(ge=0.0, le=5.0)] = 0.5
    quay_height: Annotated[float, Meta(ge=0.0, le=10.0)] = 2.0
