"""The schemas of `schemas/schema.usda`: their names, and their plug-in for OpenUSD.

A stage opens without the plug-in, too: the attributes are then custom ones.
"""

from importlib import resources

from pxr import Plug

ACTOR = "EnvgenActorAPI"
ANCHOR = "EnvgenAnchorAPI"
BUILDING = "EnvgenBuildingAPI"
CHUNK = "EnvgenChunkAPI"
LANE = "EnvgenLaneAPI"
PROP = "EnvgenPropAPI"
ROAD = "EnvgenRoadAPI"


def register_schemas() -> None:
    """Tells OpenUSD of the schemas; later calls change nothing.

    OpenUSD reads schemas when it opens its first stage. `envgen_usd` names the plug-in before, or
    calls this function if somebody else has imported `pxr`.
    """
    Plug.Registry().RegisterPlugins(str(resources.files("envgen_usd.schemas")))
