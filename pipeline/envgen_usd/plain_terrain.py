"""Ground without hills of its own: what networks of heights learn from and start at.

The landuse layer, which holds the networks, does not import the terrain's; it is handed this.
"""

from dataclasses import replace

from envgen_usd.models.ground import Heights
from envgen_usd.models.profile import TerrainRules
from envgen_usd.models.surface import RoadSurface
from envgen_usd.terrain.field import fit_terrain


def plain_terrain(surface: RoadSurface, rules: TerrainRules, land: Heights | None) -> Heights:
    """Lays a road into a land with banks, or, without a land, tells the ground from the road."""
    return fit_terrain(surface, replace(rules, relief=0.0), 0, land)
