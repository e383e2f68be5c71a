"""Figures of the buildings that are no houses: on whole plots with a use, and behind houses."""

from dataclasses import replace

from envgen_usd.models.building_rules import BuildingDetails, BuildingRules
from envgen_usd.models.landuse import LanduseClass

AT_BACK = frozenset((LanduseClass.SHOP, LanduseClass.GARAGES))
"""Uses whose building stands at the back of its plot, behind a car park or a court."""
UNFENCED = AT_BACK
"""Uses whose plots open onto the street along their whole front."""


def rules_of(rules: BuildingRules, landuse: LanduseClass) -> BuildingRules:
    """The rules of the building on a plot, in the materials of the environment.

    Args:
        rules: Rules of the environment's houses or halls.
        landuse: Class of the plot's ground.
    """
    if landuse == LanduseClass.SCHOOL:
        return _school(rules)
    if landuse == LanduseClass.SHOP:
        return _shop(rules)
    if landuse == LanduseClass.GARAGES:
        return _garages(rules)
    return rules


def rules_behind(rules: BuildingRules) -> BuildingRules:
    """The rules of a building behind a house: a workshop or a small house of the same materials.

    Args:
        rules: Rules of the environment's houses.
    """
    return replace(
        rules,
        width=(6.0, 11.0),
        depth=(5.0, 8.0),
        storeys=(1.0, 2.0),
        roofs={"flat": 1.0, "shed": 1.0, "gabled": 1.5},
        chimney=rules.chimney / 3.0,
        details=_plain(rules.details),
        correlation=None,
    )


def barn_rules(rules: BuildingRules) -> BuildingRules:
    """The rules of a barn: gates, hardly any windows, one large roof over a single storey.

    Args:
        rules: Rules of the environment; `BuildingRules.barns` gives sizes and materials.
    """
    barns = rules.barns
    return replace(
        rules,
        style="hall",
        function="barn",
        width=barns.width,
        depth=barns.depth,
        storeys=(1.0, 1.0),
        storey_height=barns.height,
        roofs={"gabled": 5.0, "shed": 1.0},
        roof_pitch=barns.roof_pitch,
        overhang=(0.3, 0.6),
        chimney=0.0,
        materials=barns.materials,
        roof_materials=barns.roof_materials,
        windows=replace(
            rules.windows, width=(0.8, 1.1), height=(0.5, 0.7), sill=(1.9, 2.3), spacing=(7.0, 14.0)
        ),
        doors=replace(
            rules.doors, width=(3.3, 4.4), height=(3.0, 3.8), sill=(0.0, 0.0), spacing=(8.0, 14.0)
        ),
        details=_plain(rules.details),
        correlation=None,
    )


def _school(rules: BuildingRules) -> BuildingRules:
    """Two or three storeys of classrooms behind a yard, in one wing or more."""
    return replace(
        rules,
        style="detached",
        function="school",
        width=(24.0, 44.0),
        depth=(11.0, 18.0),
        setback=(6.0, 11.0),
        side_setback=(2.0, 5.0),
        storeys=(2.0, 3.0),
        storey_height=(3.3, 3.6),
        roofs={"flat": 2.0, "gabled": 1.0, "hipped": 1.0},
        chimney=0.0,
        windows=replace(rules.windows, width=(1.5, 2.1), height=(1.5, 1.9), spacing=(2.6, 3.2)),
        details=replace(
            _plain(rules.details), footprints={"rectangle": 2.0, "l": 2.0, "u": 1.0}, porches=0.6
        ),
        correlation=None,
    )


def _shop(rules: BuildingRules) -> BuildingRules:
    """A wide shop of a storey with display windows, behind its car park."""
    return replace(
        rules,
        style="detached",
        function="shop",
        width=(16.0, 34.0),
        depth=(11.0, 18.0),
        setback=(12.0, 12.0),
        side_setback=(1.0, 3.0),
        storeys=(1.0, 1.0),
        storey_height=(3.8, 4.4),
        roofs={"flat": 3.0, "gabled": 1.0},
        roof_pitch=(18.0, 24.0),
        chimney=0.0,
        details=replace(_plain(rules.details), shops=1.0, awnings=0.5),
        correlation=None,
    )


def _garages(rules: BuildingRules) -> BuildingRules:
    """A row of garages under a common flat roof, with a door each and no windows."""
    return replace(
        rules,
        style="detached",
        function="garages",
        width=(14.0, 42.0),
        depth=(6.0, 6.0),
        setback=(6.0, 6.0),
        side_setback=(0.4, 0.8),
        storeys=(1.0, 1.0),
        storey_height=(2.6, 2.6),
        roofs={"flat": 1.0},
        overhang=(0.0, 0.0),
        chimney=0.0,
        # Lower than any window that is built.
        windows=replace(rules.windows, height=(0.2, 0.2)),
        doors=replace(
            rules.doors, width=(2.4, 2.4), height=(2.1, 2.1), sill=(0.0, 0.0), spacing=(2.8, 2.8)
        ),
        details=_plain(rules.details),
        correlation=None,
    )


def _plain(details: BuildingDetails) -> BuildingDetails:
    """A rectangle without parts besides gutters."""
    return BuildingDetails(
        footprints={"rectangle": 1.0},
        front_gable=0.0,
        bays=0.0,
        dormers=0.0,
        roof_windows=0.0,
        balconies=0.0,
        porches=0.0,
        garages=0.0,
        embrasure=details.embrasure,
        gutters=details.gutters,
    )
