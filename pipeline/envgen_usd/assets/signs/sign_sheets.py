"""Reads the sheets of sign faces of a library, ``signs/<sheet>.toml``.

A sheet is an asset ``traffic_sign_<sheet>`` with a variant ``face`` for each of its faces.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal, TypeAlias

from envgen_usd.errors import EnvgenError
from envgen_usd.toml_files import read_toml

PlateShape: TypeAlias = Literal[
    "round", "triangle", "inverted_triangle", "octagon", "diamond", "square", "rectangle", "cross",
    "pentagon", "arrow_left", "arrow_right",
]  # fmt: skip
DRAWING_FILES = ("lettering", "symbols", "colours")
"""Files of the folder that hold what the faces are drawn with."""


@dataclass(frozen=True)
class FaceRow:
    """A face, or a family of faces that differ in a number or a word.

    Attributes:
        name: Name of the variant; those of a family end in the number or the word.
        drawing: Lines of operations, see `sign_drawing.draw`.
        codes: Types of signals that have the face, e.g. ``274`` or ``r1-1``. A code of a country
            that has no sheet begins with the country: ``se:c31``.
        names: Names of signals without a code, in lower case and letters only: ``speedlimit``.
        values: Numbers of a family; they replace ``{value}`` in the drawing.
        words: Words of a family; they replace ``{words}`` in the drawing.
        plate: Shape of the plate; `None` for the default of the sheet, as 0 for the next two.
        width: Metres.
        height: Metres.
        base: Drawing of the sheet's table ``bases`` that comes first.
        forbids_parking: True for signs against stopping or parking: where vehicles park at a
            kerb, no generated sign has such a face.
    """

    name: str
    drawing: str
    codes: tuple[str, ...] = ()
    names: tuple[str, ...] = ()
    values: tuple[int, ...] = ()
    words: tuple[str, ...] = ()
    plate: PlateShape | None = None
    width: float = 0.0
    height: float = 0.0
    base: str = ""
    forbids_parking: bool = False

    def variants(self) -> tuple[str, ...]:
        """Names of the variants: one, or those of a family."""
        endings = (*map(str, self.values), *self.words) or ("",)
        return tuple(variant_name(self, ending) for ending in endings)


@dataclass(frozen=True)
class Defaults:
    """What the faces of a sheet share, as in `FaceRow`."""

    plate: PlateShape
    width: float
    height: float
    base: str


@dataclass(frozen=True)
class SignSheet:
    """A file of faces.

    Attributes:
        name: Stem of the file.
        countries: Countries of its codes in lower case; an empty text for signals without one.
        bases: Drawings that faces begin with, by name.
        defaults: What faces leave out.
        face: The faces.
        value_of_subtype: Number on the face by subtype, for signals without a value.
    """

    name: str
    countries: tuple[str, ...]
    bases: Mapping[str, str]
    defaults: Defaults
    face: tuple[FaceRow, ...]
    value_of_subtype: Mapping[str, int] = field(default_factory=dict)

    @property
    def asset(self) -> str:
        """Name of the asset that has the faces."""
        return f"traffic_sign_{self.name}"


@dataclass(frozen=True)
class SignFace:
    """A single face: the name of its variant, its plate (metres) and its drawing."""

    name: str
    plate: PlateShape
    width: float
    height: float
    drawing: str


def faces(sheet: SignSheet) -> Iterator[SignFace]:
    """Returns each face of a sheet; a family gives one for each number or word."""
    for row in sheet.face:
        base = sheet.bases[row.base or sheet.defaults.base]
        for ending in (*map(str, row.values), *row.words) or ("",):
            drawing = row.drawing.replace("{value}", ending).replace("{words}", ending)
            yield SignFace(
                variant_name(row, ending),
                row.plate or sheet.defaults.plate,
                row.width or sheet.defaults.width,
                row.height or sheet.defaults.height,
                f"{base}\n{drawing}",
            )


def variant_name(row: FaceRow, ending: str) -> str:
    """Name of the variant of a face with a number or a word; without one the row's name."""
    return f"{row.name}_{ending.lower()}" if ending else row.name


def read_sign_sheets(library: Path) -> tuple[SignSheet, ...]:
    """Reads all sheets of a library, by name; a library without the folder has none.

    Raises:
        EnvgenError: A file does not match, or names a base that it lacks.
    """
    paths = sorted((library / "signs").glob("*.toml"))
    sheets = tuple(
        read_toml(path, SignSheet, name=path.stem)
        for path in paths
        if path.stem not in DRAWING_FILES
    )
    for sheet in sheets:
        for base in (sheet.defaults.base, *(row.base for row in sheet.face if row.base)):
            if base not in sheet.bases:
                path = library / "signs" / f"{sheet.name}.toml"
                raise EnvgenError(f"{path}: unknown base '{base}'; known: {', '.join(sheet.bases)}")
    return sheets


def read_shop_names(library: Path) -> SignSheet:
    """Reads the signs of shops of a library.

    Raises:
        EnvgenError: The file is missing or does not match.
    """
    return read_toml(library / "shops" / "shops.toml", SignSheet, name="shops")


def read_prints(library: Path) -> SignSheet:
    """Reads what is printed on the street furniture of a library.

    Raises:
        EnvgenError: The file is missing or does not match.
    """
    return read_toml(library / "prints" / "prints.toml", SignSheet, name="prints")


def read_displays(library: Path) -> SignSheet:
    """Reads the displays of buses and trams of a library.

    Raises:
        EnvgenError: The file is missing or does not match.
    """
    return read_toml(library / "prints" / "displays.toml", SignSheet, name="displays")
