"""Tells prims that are composed of the same: what one of them holds need not be read again."""

from collections.abc import Collection, Iterator
from typing import Any

from pxr import Pcp, Sdf, Usd

from envgen_usd.render.stage.prim_semantics import PART_OF

_PLACED = ("xformOp", "visibility")
_UNSEEN = ("customData", "documentation", "comment", "displayName", "assetInfo")
"""Fields of prims that nothing drawn follows from."""


def composed_of(prim: Usd.Prim, moved: Collection[Sdf.Path]) -> object | None:
    """A key that is equal for prims with equal content, apart from what moves.

    It holds the arcs of the prim and all local opinions at and below it. The transformations and
    visibilities of what moves are left out, since they are asked for each frame.

    Args:
        prim: The prim.
        moved: Paths of moving prims at and below it.

    Returns:
        The key; `None` if ancestors bring content of the prim, which the key does not hold.
    """
    arcs: list[tuple[str, str, str]] = []
    if not _note_arcs(prim.GetPrimIndex().rootNode, arcs):
        return None
    root = prim.GetPath()
    layers = enumerate(prim.GetStage().GetLayerStack())
    specs = ((place, layer, layer.GetPrimAtPath(root)) for place, layer in layers)
    opinions = [
        (place, layer.identifier, *_opinions(each, root, moved))
        for place, layer, spec in specs
        if spec is not None
        for each in _below(spec)
    ]
    return tuple(arcs), tuple(opinions), tuple(sorted(str(p.MakeRelativePath(root)) for p in moved))


def _note_arcs(node: Any, arcs: list[tuple[str, str, str]]) -> bool:  # noqa: ANN401 - Pcp has no types
    """Notes the arcs to other files; False if an ancestor's arc brings content."""
    if node.hasSpecs and node.arcType != Pcp.ArcTypeRoot:
        if node.IsDueToAncestor():
            return False
        layer = node.layerStack.identifier.rootLayer.identifier
        arcs.append((str(node.arcType), layer, str(node.path)))
    return all(_note_arcs(child, arcs) for child in node.children)


def _below(spec: Sdf.PrimSpec) -> Iterator[Sdf.PrimSpec]:
    yield spec
    for child in spec.nameChildren:
        yield from _below(child)


def _opinions(spec: Sdf.PrimSpec, root: Sdf.Path, moved: Collection[Sdf.Path]) -> Iterator[str]:
    """Fields and properties of a spec as text."""
    path = spec.path
    yield str(path.MakeRelativePath(root))
    for key in spec.ListInfoKeys():
        if key not in _UNSEEN:
            yield f"{key}={spec.GetInfo(key)}"
    for each in spec.properties:
        name = each.name
        if name.startswith("userProperties:") and name != PART_OF:
            continue
        if path in moved and name.startswith(_PLACED):
            continue
        values = each.default if isinstance(each, Sdf.AttributeSpec) else each.targetPathList
        samples = each.layer.ListTimeSamplesForPath(each.path)
        yield f"{name}={values};{[each.layer.QueryTimeSample(each.path, t) for t in samples[:1]]}"
