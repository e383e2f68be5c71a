"""Which class, part and object a prim belongs to (UsdSemantics, ``class`` and ``part``)."""

from pxr import Kind, Sdf, Usd, UsdSemantics  # type: ignore[attr-defined] # newer than types-usd

from envgen_usd.errors import Issue, Severity
from envgen_usd.labels import label, labels, parts
from envgen_usd.render.scene import Thing

TAXONOMY = "class"
"""Taxonomy whose tokens are the names of `envgen_usd.labels`."""
PARTS = "part"
"""Taxonomy whose tokens are the names of `envgen_usd.labels.parts`."""
PART_OF = "userProperties:part_of"
"""Attribute with the relative path from a component to the object that it is a part of."""


class Semantics:
    """Reads labels and numbers the objects of each class in the order in which they are met."""

    def __init__(self, time: Usd.TimeCode) -> None:
        """Starts with the sky and with void; labels are read at `time`."""
        self.things: list[Thing] = [Thing("sky"), Thing("void")]
        self._classes = UsdSemantics.LabelsQuery(TAXONOMY, time)
        self._parts = UsdSemantics.LabelsQuery(PARTS, time)
        self._order = [entry.name for entry in labels()]
        self._known_parts = set(parts())
        self._indices = {("sky", "", ""): 0, ("void", "", ""): 1}
        self._counts: dict[str, int] = {}
        self._numbers: dict[tuple[str, str], int] = {}
        self._unknown: dict[tuple[str, str], str] = {}

    def direct_label(self, prim: Usd.Prim) -> str | None:
        """Class that a prim itself names: ``void`` for an unknown token, none if it names none.

        Labels accumulate down the hierarchy, so the nearest prim's is the most specific one.
        """
        if not prim.HasAPI(UsdSemantics.LabelsAPI, TAXONOMY):
            return None
        tokens = [str(token) for token in self._classes.ComputeUniqueDirectLabels(prim)]
        known = [token for token in self._order if token in tokens]
        for token in set(tokens).difference(known):
            self._unknown.setdefault((TAXONOMY, token), str(prim.GetPath()))
        if known:
            return known[0]
        return "void" if tokens else None

    def direct_part(self, prim: Usd.Prim) -> str | None:
        """Part that a prim itself names: empty for an unknown token, none if it names none."""
        if not prim.HasAPI(UsdSemantics.LabelsAPI, PARTS):
            return None
        tokens = sorted(str(token) for token in self._parts.ComputeUniqueDirectLabels(prim))
        known = [token for token in tokens if token in self._known_parts]
        for token in set(tokens).difference(known):
            self._unknown.setdefault((PARTS, token), str(prim.GetPath()))
        if known:
            return known[0]
        return "" if tokens else None

    def thing(self, name: str, path: str, part: str = "") -> int:
        """Index in `things` of a part of an object; of a whole class where it has no instances."""
        key = (name, path if label(name).has_instances else "", part)
        if key not in self._indices:
            self._indices[key] = len(self.things)
            self.things.append(Thing(name, key[1], self._number(name, key[1]), part))
        return self._indices[key]

    def _number(self, name: str, path: str) -> int:
        if not path:
            return 0
        if (name, path) not in self._numbers:
            self._numbers[name, path] = self._counts[name] = self._counts.get(name, 0) + 1
        return self._numbers[name, path]

    def issues(self) -> list[Issue]:
        """Tokens that the tables do not know; what carries them is void, or has no part."""
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
    """True if a prim is an object of its own (a building, a tree): its kind is a component."""
    kind = Usd.ModelAPI(prim).GetKind()
    return bool(kind) and Kind.Registry.IsA(kind, Kind.Tokens.component)


def owner_of(component: Usd.Prim) -> str:
    """Path of the object that a component is, or is a part of.

    A window or door stands on the stage as a component of its own, so that it can be exchanged;
    its ``userProperties:part_of`` is the path from it to its building.
    """
    path = component.GetPath()
    attribute = component.GetAttribute(PART_OF)
    relative = str(attribute.Get() or "") if attribute else ""
    if relative and Sdf.Path.IsValidPathString(relative):
        path = Sdf.Path(relative).MakeAbsolutePath(path)
    return str(path)
