"""The season of a stage: the variant that its class of plants selects."""

from pxr import Usd

from envgen_usd.assets.prim_authoring import SEASON, SEASON_CLASS


def stage_season(stage: Usd.Stage) -> str:
    """Returns the season of a stage; empty for a stage whose plants follow no class."""
    prim = stage.GetPrimAtPath(SEASON_CLASS)
    return str((prim.GetMetadata("variantSelection") or {}).get(SEASON, "")) if prim else ""


def set_season(stage: Usd.Stage, season: str) -> None:
    """Selects the season of all plants of a stage, as an opinion that no file keeps."""
    with Usd.EditContext(stage, stage.GetSessionLayer()):
        prim = stage.CreateClassPrim(SEASON_CLASS)
        prim.GetVariantSets().SetSelection(SEASON, season)
