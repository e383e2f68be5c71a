"""Ground without generated hills: input and training data of the networks of heights.

The landuse layer, which holds the networks, does not import the terrain layer; it receives this
function.
"""

from dataclasses import replace

from envgen_usd.models.ground import Heights
from envgen_usd.models.land_rules import TerrainRules
from envgen_usd.models.road_surface import RoadSurface
from envgen_usd.terrain.terrain_field import fit_terrain


def plain_terrain(surface: RoadSurface, rules: TerrainRules, land: Heights | None) -> Heights:
    """Lays a road into land with banks; without land, interpolates the ground from the road."""
    return fit_terrain(surface, replace(rules, relief=0.0), 0, land)
