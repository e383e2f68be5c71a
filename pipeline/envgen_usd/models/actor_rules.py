"""Rules of an environment's parked vehicles and standing people."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Literal, TypeAlias

from msgspec import Meta

from envgen_usd.models.distribution import RangeOf
from envgen_usd.models.figure_types import Share, Weight

Vehicle: TypeAlias = Literal["car", "truck", "bus", "motorcycle"]
"""Kind of asset of a vehicle that parks."""
Vehicles: TypeAlias = Annotated[Mapping[Vehicle, Weight], Meta(min_length=1)]
ParkingAngle: TypeAlias = Literal["parallel", "angled", "perpendicular"]
GroupSize: TypeAlias = Literal["1", "2", "3", "4", "5", "6"]
_OccupiedShare: TypeAlias = RangeOf[Annotated[float, Meta(ge=0.0, le=1.0)]]
_Number: TypeAlias = RangeOf[Annotated[float, Meta(ge=0.0, le=20.0)]]


@dataclass(frozen=True)
class KerbRules:
    """Vehicles along kerbs, on streets without parking lanes.

    Where the carriageway is too narrow for vehicles at the kerb, they stand half on the sidewalk,
    or not at all.

    Attributes:
        streets: Share of the streets that are parked at.
        both: Share of these with rows at both kerbs.
        raised: Share of the stretches of too narrow streets where vehicles stand half on the
            sidewalk.
        occupancy: Share of the places that are taken; each row draws.
        gap: Metres between two places.
        offset: Metres from the kerb to the vehicle; each row draws.
        reversed: Share of the vehicles that stand against the direction of travel.
        vehicles: Weights of the kinds of vehicles.
    """

    streets: Share
    both: Share
    raised: Share
    occupancy: _OccupiedShare
    gap: RangeOf[Annotated[float, Meta(ge=0.2, le=50.0)]]
    offset: RangeOf[Annotated[float, Meta(ge=0.0, le=0.6)]]
    vehicles: Vehicles
    reversed: Share = 0.0


@dataclass(frozen=True)
class BayRules:
    """Vehicles in parking lanes and on parking spaces of the road file.

    Attributes:
        occupancy: Share of the places that are taken; each row draws.
        wide: Weights of the angles in parking lanes wide enough for all of them. In narrower lanes,
            vehicles stand parallel to the road.
        nose_in: Share of the vehicles at an angle with their front away from the road.
        vehicles: Weights of the kinds of vehicles.
    """

    occupancy: _OccupiedShare
    wide: Annotated[Mapping[ParkingAngle, Weight], Meta(min_length=1)]
    vehicles: Vehicles
    nose_in: Share = 0.7


@dataclass(frozen=True)
class LotRules:
    """Vehicles beside the road.

    Attributes:
        car_parks: Share of the places of car parks that are taken; each car park draws.
        driveways: Share of the driveways before garages with a vehicle.
        yards: Number on a hectare of the yards of industrial plots.
        vehicles: Weights of the kinds of vehicles on car parks and driveways.
        yard_vehicles: Weights of the kinds of vehicles on yards.
    """

    car_parks: _OccupiedShare
    driveways: Share
    vehicles: Vehicles
    yards: Annotated[float, Meta(ge=0.0, le=100.0)] = 0.0
    yard_vehicles: Vehicles = field(default_factory=lambda: {"truck": 1.0})


@dataclass(frozen=True)
class PeopleRules:
    """People on sidewalks.

    Attributes:
        density: People for each 100 m of a sidewalk; each sidewalk draws. It is their flow in
            people an hour, divided by 100 times their speed in metres an hour (Fruin 1971,
            "Pedestrian Planning and Design": flow = density × speed).
        groups: Weights of the sizes of groups; 1 is a single person. James 1953 ("The distribution
            of free-forming small group size") gives a Poisson number above zero.
        walking: Share of the groups that walk; the others stand together.
        crossing: People who wait at each end of a crossing.
        stop: People who wait at a bus stop.
    """

    density: RangeOf[Annotated[float, Meta(ge=0.0, le=100.0)]]
    groups: Annotated[Mapping[GroupSize, Weight], Meta(min_length=1)]
    walking: Share
    crossing: _Number = (0.0, 0.0)
    stop: _Number = (0.0, 0.0)


@dataclass(frozen=True)
class KerbObjectRules:
    """Bicycles and wheeled bins.

    Attributes:
        bicycles: Bicycles beside each bicycle rack.
        bins: Metres of sidewalk for each group of wheeled bins; 0 without bins.
        bin_group: Number of wheeled bins in a group.
    """

    bicycles: _Number = (0.0, 0.0)
    bins: Annotated[float, Meta(ge=0.0, le=10000.0)] = 0.0
    bin_group: RangeOf[Annotated[float, Meta(ge=1.0, le=6.0)]] = (1.0, 3.0)


@dataclass(frozen=True)
class ActorRules:
    """Actors that stand still: parked vehicles, people, bicycles, wheeled bins.

    Attributes:
        kerbs: Vehicles at kerbs.
        bays: Vehicles in parking lanes and on parking spaces.
        lots: Vehicles beside the road.
        people: People on sidewalks.
        kerbside: Bicycles and wheeled bins.
    """

    kerbs: KerbRules
    bays: BayRules
    lots: LotRules
    people: PeopleRules
    kerbside: KerbObjectRules = KerbObjectRules()
