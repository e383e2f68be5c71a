"""Low beams of moving vehicles: a lamp before the front that lights the road."""

from pxr import Gf, Sdf, Vt

from envgen_usd.assets.prim_authoring import add_prim, apply_schemas, set_attribute
from envgen_usd.models.actor_looks import MovingLook
from envgen_usd.models.atmosphere import STAGE_UNIT

LIT = frozenset({"car", "van", "truck", "bus", "motorcycle"})
"""Kinds of actors with a low beam."""
_INTENSITY = 3.0
"""kcd of both headlamps within the beam. A larger value lights the road farther ahead. Beyond that
of street lights, it makes the renderer draw lamps on grey days, when they do not show."""
_HALF = 7.0
"""Half the angle of the beam, degrees."""
_DOWN = 6.5
"""Angle by which its axis points down, degrees: its upper edge is level with the lamps."""
_HIGH = 0.65
"""Height of the lamps, metres (UN Regulation 48: 0.5 to 1.2)."""
_BEFORE = 0.03
"""Metres before the front, so that the body does not hide the lamp."""
_RADIUS = 0.08
_KELVIN = 4300.0


def add_low_beam(prim: Sdf.PrimSpec, look: MovingLook) -> None:
    """Adds the lamp of a vehicle; other actors get none.

    The renderer's lamps are points with a beam, and the number of them is limited, so one stands
    for both headlamps.

    Args:
        prim: The actor.
        look: Its asset.
    """
    if look.kind not in LIT:
        return
    types = Sdf.ValueTypeNames
    lamp = add_prim(prim, "LowBeam", "DiskLight")
    apply_schemas(lamp, "ShapingAPI")
    set_attribute(lamp, "inputs:radius", types.Float, _RADIUS)
    set_attribute(lamp, "inputs:normalize", types.Bool, True)
    set_attribute(lamp, "inputs:intensity", types.Float, _INTENSITY / STAGE_UNIT)
    set_attribute(lamp, "inputs:enableColorTemperature", types.Bool, True)
    set_attribute(lamp, "inputs:colorTemperature", types.Float, _KELVIN)
    set_attribute(lamp, "inputs:shaping:cone:angle", types.Float, _HALF)
    front = (look.box[1, 0] + _BEFORE) / look.scale
    middle = look.box[:, 1].mean() / look.scale
    set_attribute(lamp, "xformOp:translate", types.Double3, Gf.Vec3d(front, middle, _HIGH))
    # A disk light shines along -z.
    set_attribute(lamp, "xformOp:rotateY", types.Float, _DOWN - 90.0)
    order = ["xformOp:translate", "xformOp:rotateY"]
    set_attribute(lamp, "xformOpOrder", types.TokenArray, Vt.TokenArray(order), uniform=True)
