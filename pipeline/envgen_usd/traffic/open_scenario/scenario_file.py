"""Reads OpenSCENARIO files: parameters, expressions and catalogues are put in their places."""

import ast
import math
import operator
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import cast

from lxml import etree

from envgen_usd.compressed_files import LARGEST_WHOLE, open_content
from envgen_usd.errors import EnvgenError, Issue, Severity, one_line
from envgen_usd.xml_events import refuse_entities, safe_parser

_OPERATORS: Mapping[type, Callable[..., float]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Mod: operator.mod,
    ast.USub: operator.neg,
    ast.UAdd: operator.pos,
}
_FUNCTIONS: Mapping[str, Callable[..., float]] = {
    "round": lambda value: float(round(value)),
    "floor": math.floor,
    "ceil": math.ceil,
    "sqrt": math.sqrt,
    "pow": pow,
    "abs": abs,
    "min": min,
    "max": max,
}


@dataclass
class Skipped:
    """What a scenario asks for and is not played, each kind once.

    Attributes:
        source: Name of the file.
        issues: Issues by what is skipped.
    """

    source: str
    issues: dict[str, Issue] = field(default_factory=dict)

    def add(self, element: etree._Element, what: str, done: str = "left out") -> None:
        """Notes what is skipped, with the line of its first place."""
        line = cast("int", element.sourceline or 0)
        text = f"{what} is not supported"
        issue = Issue("scenario.skipped", Severity.WARNING, self.source, text, done, line)
        self.issues.setdefault(what, issue)


class ScenarioFile:
    """The elements of a scenario."""

    def __init__(self, path: Path) -> None:
        """Reads a file.

        Raises:
            EnvgenError: It cannot be read or is no OpenSCENARIO file.
        """
        self.path = path
        self.root = _parsed(path)
        if self.root.tag != "OpenSCENARIO":
            raise EnvgenError(f"{path}: root element is {self.root.tag}, expected OpenSCENARIO")
        if self.root.find("Storyboard") is None:
            raise EnvgenError(f"{path}: has no Storyboard; give a scenario, not a catalogue")
        self.skipped = Skipped(path.name)
        _resolve(self.root, {}, path)

    @property
    def road(self) -> Path | None:
        """The road file that the scenario names, or `None`."""
        logic = self.root.find("RoadNetwork/LogicFile")
        name = logic.get("filepath", "") if logic is not None else ""
        return self.path.parent / name if name else None

    def catalogue_entry(self, reference: etree._Element) -> etree._Element:
        """Returns the entry of a catalogue that a CatalogReference names.

        Raises:
            EnvgenError: No catalogue of the scenario has it.
        """
        catalogue, entry = reference.get("catalogName", ""), reference.get("entryName", "")
        folders = [
            self.path.parent / directory.get("path", "")
            for directory in self.root.iterfind("CatalogLocations/*/Directory")
        ]
        for file in sorted({file for folder in folders for file in _files(folder)}):
            root = _parsed(file)
            for found in root.iterfind("Catalog"):
                if found.get("name") != catalogue:
                    continue
                for item in found:
                    if item.get("name") == entry:
                        given = {
                            each.get("parameterRef", "").removeprefix("$"): each.get("value", "")
                            for each in reference.iterfind(
                                "ParameterAssignments/ParameterAssignment"
                            )
                        }
                        _assign(item, given)
                        _resolve(item, {}, file)
                        return item
        searched = ", ".join(str(folder) for folder in folders) or "no folder"
        raise EnvgenError(
            f"{self.path}: line {reference.sourceline}: no catalogue {catalogue} with an entry "
            f"{entry}; searched {searched}"
        )


def _files(folder: Path) -> list[Path]:
    return [folder] if folder.is_file() else list(folder.glob("*.xosc"))


def _parsed(path: Path) -> etree._Element:
    try:
        with open_content(path, LARGEST_WHOLE) as file:
            tree = etree.parse(file, safe_parser())
    except (OSError, etree.XMLSyntaxError) as error:
        raise EnvgenError(f"{path}: cannot be read: {one_line(error)}") from error
    refuse_entities(tree, path)
    return tree.getroot()


def _declared(element: etree._Element, outer: Mapping[str, str]) -> dict[str, str]:
    """Parameters that an element declares, and those around it."""
    found = dict(outer)
    for each in element.iterfind("ParameterDeclarations/ParameterDeclaration"):
        found[each.get("name", "").removeprefix("$")] = each.get("value", "")
    return found


def _assign(item: etree._Element, given: Mapping[str, str]) -> None:
    """Gives declared parameters of a catalogue's entry other values."""
    for each in item.iterfind("ParameterDeclarations/ParameterDeclaration"):
        name = each.get("name", "").removeprefix("$")
        each.set("value", given.get(name, each.get("value", "")))


def _resolve(element: etree._Element, outer: Mapping[str, str], path: Path) -> None:
    """Replaces parameters and expressions in all attributes of an element and below it."""
    known = _declared(element, outer)
    for name, value in element.attrib.items():
        if "$" in value:
            try:
                element.set(name, _value(str(value), known, f"{path}: line {element.sourceline}"))
            except EnvgenError:
                # Expressions of texts have no standard; a name need not be known.
                if name != "name":
                    raise
    for child in element.iterchildren("*"):
        if child.tag not in {"ParameterDeclarations", "ParameterAssignments"}:
            _resolve(child, known, path)


def _value(text: str, known: Mapping[str, str], where: str) -> str:
    if text.startswith("${") and text.endswith("}"):
        filled = text[2:-1]
        for name in sorted(known, key=len, reverse=True):
            filled = filled.replace(f"${name}", known[name])
        try:
            return repr(_computed(ast.parse(filled.strip(), mode="eval").body))
        except (ValueError, SyntaxError, TypeError, ZeroDivisionError, OverflowError) as error:
            raise EnvgenError(f"{where}: cannot compute {text}: {error}") from error
    name = text.removeprefix("$")
    if name not in known:
        raise EnvgenError(f"{where}: parameter {text} is not declared")
    value = known[name]
    return _value(value, known, where) if value.startswith("$") and value != text else value


def _computed(node: ast.expr) -> float:
    """Value of an arithmetic expression."""
    if isinstance(node, ast.Constant) and isinstance(node.value, int | float):
        return float(node.value)
    if isinstance(node, ast.BinOp) and type(node.op) in _OPERATORS:
        return _OPERATORS[type(node.op)](_computed(node.left), _computed(node.right))
    if isinstance(node, ast.UnaryOp) and type(node.op) in _OPERATORS:
        return _OPERATORS[type(node.op)](_computed(node.operand))
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
        function = _FUNCTIONS.get(node.func.id)
        if function:
            return function(*map(_computed, node.args))
    raise ValueError(f"unknown term {ast.unparse(node)}")


def number(element: etree._Element, name: str, default: float | None = None) -> float:
    """Returns an attribute as a number.

    Raises:
        EnvgenError: It is no number, or missing without a default.
    """
    text = element.get(name)
    if text is None and default is not None:
        return default
    try:
        value = float(text or "")
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise EnvgenError(
            f"line {element.sourceline}: {element.tag}: {name} must be a number, got {text}"
        )
    return value


def only_child(element: etree._Element | None) -> etree._Element | None:
    """Returns the first child, e.g. which of several positions is given; `None` without any."""
    return next(iter(element.iterchildren("*")), None) if element is not None else None
