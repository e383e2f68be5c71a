"""Class, part and object of a prim (UsdSemantics, taxonomies ``class`` and ``part``)."""

from collections.abc import Sequence
from functools import cache
from sys import intern

from pxr import Kind, Sdf, Usd, UsdSemantics  # type: ignore[attr-defined] # newer than types-usd

from envgen_usd.errors import Issue, Severity
from envgen_usd.label_taxonomy import labels, parts
from envgen_usd.render.render_scene import SceneObject

LABELS = "semantics:labels:"
"""Prefix of the attributes of labels."""
TAXONOMY = "class"
"""Taxonomy whose tokens are the names of `envgen_usd.label_taxonomy`."""
PARTS = "part"
"""Taxonomy whose tokens are the names of `envgen_usd.label_taxonomy.parts`."""
PART_OF = "userProperties:part_of"
"""Attribute with the relative path from a component to the object that contains it."""


class Semantics:
    """Reads labels, and numbers the objects of each class in traversal order."""

    def __init__(self, time: Usd.TimeCode) -> None:
        """Starts with the sky and with void; labels are read at `time`."""
        self.scene_objects: list[SceneObject] = [SceneObject("sky"), SceneObject("void")]
        self._time = time
        self.forget_prims()
        self._order = [entry.name for entry in labels()]
        self._known_parts = set(parts())
        self._indices = {("sky", "", ""): 0, ("void", "", ""): 1}
        self._counts: dict[str, int] = {}
        self._numbers: dict[tuple[str, str], int] = {}
        self._unknown: dict[tuple[str, str], str] = {}
        self._has_instances = {entry.name: entry.has_instances for entry in labels()}

    def go_on(self, scene_objects: Sequence[SceneObject]) -> None:
        """Numbers further objects after those of an earlier traversal."""
        self.scene_objects = list(scene_objects)
        for index, each in enumerate(scene_objects):
            self._indices[each.label, each.path, each.part] = index
            if each.path:
                self._numbers[each.label, each.path] = each.number
                self._counts[each.label] = max(self._counts.get(each.label, 0), each.number)

    def forget_prims(self) -> None:
        """Lets go of the prims that were asked for: OpenUSD's queries hold each of them."""
        self._classes = UsdSemantics.LabelsQuery(TAXONOMY, self._time)
        self._parts = UsdSemantics.LabelsQuery(PARTS, self._time)

    def direct_label(self, prim: Usd.Prim) -> str | None:
        """Class label on a prim: ``void`` for an unknown token, `None` without a label.

        Labels accumulate down the hierarchy, so the nearest prim has the most specific label.
        """
        if not prim.HasAPI(UsdSemantics.LabelsAPI, TAXONOMY):
            return None
        tokens = [str(token) for token in self._classes.ComputeUniqueDirectLabels(prim)]
        if len(tokens) == 1 and tokens[0] in self._has_instances:
            return tokens[0]
        known = [token for token in self._order if token in tokens]
        for token in set(tokens).difference(known):
            self._unknown.setdefault((TAXONOMY, token), str(prim.GetPath()))
        if known:
            return known[0]
        return "void" if tokens else None

    def direct_part(self, prim: Usd.Prim) -> str | None:
        """Part label on a prim: empty for an unknown token, `None` without a label."""
        if not prim.HasAPI(UsdSemantics.LabelsAPI, PARTS):
            return None
        tokens = sorted(str(token) for token in self._parts.ComputeUniqueDirectLabels(prim))
        known = [token for token in tokens if token in self._known_parts]
        for token in set(tokens).difference(known):
            self._unknown.setdefault((PARTS, token), str(prim.GetPath()))
        if known:
            return known[0]
        return "" if tokens else None

    def scene_object(self, name: str, path: str, part: str = "") -> int:
        """Index in `scene_objects` of an object's part, or of a class without instances."""
        key = (name, path if self._has_instances[name] else "", part)
        index = self._indices.get(key)
        if index is None:
            index = self._indices[key] = len(self.scene_objects)
            number = self._number(name, key[1])
            self.scene_objects.append(SceneObject(intern(name), key[1], number, intern(part)))
        return index

    def _number(self, name: str, path: str) -> int:
        if not path:
            return 0
        if (name, path) not in self._numbers:
            self._numbers[name, path] = self._counts[name] = self._counts.get(name, 0) + 1
        return self._numbers[name, path]

    def issues(self) -> list[Issue]:
        """Issues of unknown tokens; their prims become void, or have no part."""
        return [
            Issue(
                "label.unknown",
                Severity.WARNING,
                where,
                f"{taxonomy} {token!r} is unknown",
                "void" if taxonomy == TAXONOMY else "no part",
            )
            for (taxonomy, token), where in sorted(self._unknown.items())
        ]


def is_component(prim: Usd.Prim) -> bool:
    """True if a prim is a separate object (a building, a tree): its kind is component."""
    kind = prim.GetKind()
    return bool(kind) and _is_component(kind)


@cache
def _is_component(kind: str) -> bool:
    return bool(Kind.Registry.IsA(kind, Kind.Tokens.component))


def owner_of(component: Usd.Prim) -> str:
    """Path of the object that a component is, or belongs to.

    A component that does not lie below the object that it belongs to names that object in
    ``userProperties:part_of``.
    """
    path = component.GetPath()
    attribute = component.GetAttribute(PART_OF)
    relative = str(attribute.Get() or "") if attribute else ""
    if relative and Sdf.Path.IsValidPathString(relative):
        path = Sdf.Path(relative).MakeAbsolutePath(path)
    return str(path)
