"""Which class and which object a prim belongs to (UsdSemantics, taxonomy ``class``)."""

from pxr import Kind, Sdf, Usd, UsdSemantics  # type: ignore[attr-defined] # newer than types-usd

from envgen_usd.errors import Issue, Severity
from envgen_usd.labels import label, labels
from envgen_usd.render.scene import Thing

TAXONOMY = "class"
"""Taxonomy whose tokens are the names of `envgen_usd.labels`."""
PART_OF = "userProperties:part_of"
"""Attribute with the relative path from a component to the object that it is a part of."""


class Semantics:
    """Reads labels and numbers the objects of each class in the order in which they are met."""

    def __init__(self, time: Usd.TimeCode) -> None:
        """Starts with the sky and with void; labels are read at `time`."""
        self.things: list[Thing] = [Thing("sky"), Thing("void")]
        self._query = UsdSemantics.LabelsQuery(TAXONOMY, time)
        self._order = [entry.name for entry in labels()]
        self._indices = {("sky", ""): 0, ("void", ""): 1}
        self._counts: dict[str, int] = {}
        self._unknown: dict[str, str] = {}

    def direct_label(self, prim: Usd.Prim) -> str | None:
        """Class that a prim itself names: ``void`` for an unknown token, none if it names none.

        Labels accumulate down the hierarchy, so the nearest prim's is the most specific one.
        """
        if not prim.HasAPI(UsdSemantics.LabelsAPI, TAXONOMY):
            return None
        tokens = [str(token) for token in self._query.ComputeUniqueDirectLabels(prim)]
        known = [token for token in self._order if token in tokens]
        for token in set(tokens).difference(known):
            self._unknown.setdefault(token, str(prim.GetPath()))
        if known:
            return known[0]
        return "void" if tokens else None

    def thing(self, name: str, path: str) -> int:
        """Index in `things` of an object of a class; classes without instances have one thing."""
        key = (name, path if label(name).has_instances else "")
        if key not in self._indices:
            number = 0
            if key[1]:
                number = self._counts[name] = self._counts.get(name, 0) + 1
            self._indices[key] = len(self.things)
            self.things.append(Thing(*key, number))
        return self._indices[key]

    def issues(self) -> list[Issue]:
        """Tokens that are in no class; what carries them is void."""
        return [
            Issue("label.unknown", Severity.WARNING, where, f"class {token!r} is unknown", "void")
            for token, where in sorted(self._unknown.items())
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
