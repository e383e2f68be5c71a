"""What ASAM's published schemas demand of OpenMATERIAL 3D 1.1 files, as tables of rules.

Written after `asset_schema`, `mapping_schema`, `material_schema` and `material_brdf_schema` of
asam-ev/OpenMATERIAL-3D; parts that our files do not use (vehicles, people, lights) are left out. A
key that no schema knows is a fault here, too, although the schemas allow it: it may be a slip.
"""

import math
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

Rule = Callable[[Any, str], Iterator[str]]
"""Yields the faults of a value at a path."""


def text(pattern: str = "") -> Rule:
    def check(value: Any, path: str) -> Iterator[str]:
        if not isinstance(value, str):
            yield f"{path}: no text: {value!r}"
        elif not re.search(pattern, value):
            yield f"{path}: {value!r} does not match {pattern}"

    return check


def one_of(*values: str) -> Rule:
    return text("^(" + "|".join(values) + ")$")


def number(low: float = -math.inf, high: float = math.inf, *, whole: bool = False) -> Rule:
    def check(value: Any, path: str) -> Iterator[str]:
        kind = int if whole else int | float
        if isinstance(value, bool) or not isinstance(value, kind):
            yield f"{path}: no number: {value!r}"
        elif not low <= value <= high:
            yield f"{path}: {value!r} is not between {low} and {high}"

    return check


def boolean(value: Any, path: str) -> Iterator[str]:
    if not isinstance(value, bool):
        yield f"{path}: neither true nor false: {value!r}"


def anything(value: Any, path: str) -> Iterator[str]:
    if not isinstance(value, dict):
        yield f"{path}: no object: {value!r}"


def each(rule: Rule, least: int = 0, *, unique: bool = False) -> Rule:
    def check(value: Any, path: str) -> Iterator[str]:
        if not isinstance(value, list) or len(value) < least:
            yield f"{path}: no list of at least {least}: {value!r}"
            return
        if unique and len({repr(item) for item in value}) < len(value):
            yield f"{path}: entries repeat"
        for row, item in enumerate(value):
            yield from rule(item, f"{path}[{row}]")

    return check


def row(*rules: Rule) -> Rule:
    """A list with an entry for each rule."""

    def check(value: Any, path: str) -> Iterator[str]:
        if not isinstance(value, list) or len(value) != len(rules):
            yield f"{path}: no list of {len(rules)}: {value!r}"
            return
        for rule, item in zip(rules, value, strict=True):
            yield from rule(item, path)

    return check


@dataclass(frozen=True)
class Keys:
    """An object with required and optional keys."""

    required: Mapping[str, Rule]
    optional: Mapping[str, Rule]

    def __call__(self, value: Any, path: str) -> Iterator[str]:
        if not isinstance(value, dict):
            yield f"{path}: no object: {value!r}"
            return
        known = {**self.required, **self.optional}
        yield from (f"{path}: {key} is missing" for key in sorted(self.required - value.keys()))
        yield from (f"{path}: unknown key {key}" for key in sorted(value.keys() - known))
        for key in value.keys() & known:
            yield from known[key](value[key], f"{path}.{key}")


_VERSION = text(r"^\d+\.\d+\.\d+$")
_UUID = text(r"\b[0-9a-fA-F]{8}(-[0-9a-fA-F]{4}){3}-[0-9a-fA-F]{12}\b$")
_WAVELENGTH = number(1e-9, 17.16e-3)
_ZENITH, _AZIMUTH = number(0.0, 1.570796), number(0.0, 6.283185)
_SCHEMA = {"$schema": text(r"/v1\.1\.0/schemas/\w+\.json$")}


def _head(version: str, required: Mapping[str, Rule], optional: Mapping[str, Rule]) -> Keys:
    return Keys(
        {
            "name": text(),
            "uuid": _UUID,
            version: _VERSION,
            "openMaterial3dVersion": _VERSION,
            "copyrights": each(text(), 1),
            "license": text(),
            "authors": each(text(), 1),
            **required,
        },
        {"description": text(), "creationDate": text(r"^\d{8}T\d{6}Z$"), **optional},
    )


ASSET = Keys(
    {
        "metadata": _head(
            "assetVersion",
            {
                "objectClass": one_of("vehicle", "human", "environment", "other"),
                "animated": boolean,
                "pbrMaterialWorkflow": one_of("metallic", "specular", "none"),
                "triangleCount": number(1, whole=True),
                "meshCount": number(1, whole=True),
                "textureResolutions": each(one_of("1K", "2K", "4K", ""), 1, unique=True),
                "normalMapFormat": one_of("DirectX", "OpenGL", "none"),
                "boundingBox": Keys(dict.fromkeys("xyz", row(number(), number())), {}),
            },
            {
                "modelCreationTool": text(),
                "modelingMethod": text(),
                "validationDescription": text(),
                "assetType": one_of("object", "scene"),
            },
        )
    },
    {"materialMappingUri": text(r".*\.xomm$"), "customProperties": anything, **_SCHEMA},
)
MAPPING = Keys(
    {
        "metadata": _head("mappingVersion", {}, {}),
        "materialMapping": each(row(text(), text(r"^(\./|/)?([a-zA-Z0-9_\-./]+)\.xomp$"), text())),
    },
    _SCHEMA,
)
MATERIAL = Keys(
    {
        "metadata": _head("materialVersion", {}, {}),
        "materialProperties": Keys(
            {},
            {
                "emissivityData": Keys(
                    {
                        "emissivityCoefficient": number(0, 1),
                        "temperature": number(0),
                        "sources": text(),
                    },
                    {},
                ),
                "brdfUris": each(text(r".*_brdf\.xompt$")),
                "customProperties": anything,
            },
        ),
    },
    _SCHEMA,
)
BRDF = Keys(
    {
        "metadata": _head(
            "materialVersion", {"sources": text()}, {"typicalSensorTechnology": text()}
        ),
        "brdf": Keys(
            {
                "wavelengths": each(_WAVELENGTH),
                "lookupTable": each(row(_WAVELENGTH, _ZENITH, _ZENITH, _AZIMUTH, number(0))),
            },
            {},
        ),
    },
    _SCHEMA,
)
OF_SUFFIX: Mapping[str, Keys] = {
    ".xoma": ASSET,
    ".xomm": MAPPING,
    ".xomp": MATERIAL,
    ".xompt": BRDF,
}
"""Rules of a file by the suffix of its name."""
