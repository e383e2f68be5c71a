"""Authors sun and sky."""

import numpy as np
from pxr import Gf, Sdf

from envgen_usd.assets.prim_authoring import add_prim, set_attribute, set_pose

SUN_ELEVATION = 42.0
"""Elevation of the sun above the horizon, degrees; a larger value shortens shadows."""
SUN_AZIMUTH = 215.0
"""Azimuth of the sun, degrees clockwise from north (+y)."""


def add_environment(world: Sdf.PrimSpec) -> None:
    """Adds ``Environment/Sun`` (DistantLight) and ``Environment/Sky`` (DomeLight)."""
    scope = add_prim(world, "Environment", "Scope")
    types = Sdf.ValueTypeNames
    sun = add_prim(scope, "Sun", "DistantLight")
    set_attribute(sun, "inputs:angle", types.Float, 0.53)
    set_attribute(sun, "inputs:color", types.Color3f, Gf.Vec3f(1.0, 0.94, 0.86))
    set_attribute(sun, "inputs:intensity", types.Float, 5.0)
    # The light shines along its local -z: tilt that away from straight down, then turn to the
    # north.
    tilt = np.array([90.0 - SUN_ELEVATION, 0.0, 180.0 - SUN_AZIMUTH])
    set_pose(sun, rotate=tilt)
    sky = add_prim(scope, "Sky", "DomeLight")
    set_attribute(sky, "inputs:color", types.Color3f, Gf.Vec3f(0.62, 0.78, 1.0))
    set_attribute(sky, "inputs:intensity", types.Float, 1.0)
