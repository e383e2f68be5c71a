"""Reads CityGML 1.0, 2.0 and 3.0 of other programs."""

from collections.abc import Iterator, Mapping
from copy import deepcopy
from dataclasses import dataclass, field, replace
from itertools import islice
from pathlib import Path

import numpy as np
from lxml import etree

from envgen_usd.chunks import snap
from envgen_usd.citygml.axis_clues import facing
from envgen_usd.citygml.coordinate_texts import tidy
from envgen_usd.citygml.feature_read import FeatureReader
from envgen_usd.citygml.gml_geometry_read import GeometryReader
from envgen_usd.citygml.implicit_templates import place_templates
from envgen_usd.citygml.solid_orientation import face_outwards
from envgen_usd.citygml.surface_semantics import classify
from envgen_usd.citygml.version_upgrade import upgrade
from envgen_usd.citygml.xlinks import inline, name_of, references
from envgen_usd.citygml.xml_stream import stream_members
from envgen_usd.errors import EnvgenError, Issue, Severity
from envgen_usd.geometry.city_frame import Clues, Frame, frame_of, has_two_orders
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.city_model import City, CityObject
from envgen_usd.xml_events import local_name, namespace_of

_TITLE = "{http://www.w3.org/1999/xlink}title"
_MOST_CLUES = 500
"""Elements whose geometry tells the axis order; a larger value takes longer."""
_GROUPS = ("CityObjectGroup", "Appearance")


@dataclass
class _Survey:
    """Properties of a file that the reader needs before its features.

    Attributes:
        version: CityGML version, e.g. ``2.0``.
        srs_name: srsName of the envelope, or the first srsName.
        places: A point of each of the first features, 3 each.
        facing: Solids and roofs that face outwards with easting first, less the others.
        wanted: Ids of geometry that a feature references outside itself.
    """

    version: str = ""
    srs_name: str = ""
    places: list[FloatArray] = field(default_factory=list)
    facing: int = 0
    wanted: set[str] = field(default_factory=set)


class _FramedReader(GeometryReader):
    """Reads coordinates of any CRS."""

    def __init__(self, frame: Frame) -> None:
        super().__init__(np.zeros(3))
        self._frame = frame

    def points(self, numbers: list[float]) -> FloatArray:
        points = np.array(numbers, dtype=np.float64).reshape(-1, 3)
        if not len(points):
            return points
        placed = snap(self._frame.place(points))
        if not np.isfinite(placed).all():
            raise ValueError(f"coordinates like {numbers[:3]} lie outside their CRS")
        return placed


def read_foreign(
    path: Path,
    crs: str = "",
    offset: tuple[float, float, float] | None = None,
    road: FloatArray | None = None,
) -> City:
    """Reads a CityGML file of any version from another program.

    Names of older versions become those of 3.0. Referenced geometry is copied to its place of use.
    Unclassified polygons of buildings get a class. Solids with inward faces are reoriented.
    Coordinates are in metres, easting first. Unreadable features are left out.

    Args:
        path: The file.
        crs: Target CRS; empty for that of the file, or for the zone of UTM if that is not metric.
        offset: Target offset, 3, metres; `None` chooses an offset that gives small coordinates.
        road: 2 x 3, lowest and highest corner of the road in the target CRS; tells the axis order.

    Raises:
        EnvgenError: The file is not CityGML, or its CRS or the target CRS is unknown.
        ValueError: No feature is readable.
    """
    survey = _survey(path)
    try:
        frame = frame_of(survey.srs_name, _places(survey), crs, offset, Clues(survey.facing, road))
    except EnvgenError as error:
        raise EnvgenError(f"{path}: {error}") from error
    others = _elements(path, survey.wanted)
    reader = FeatureReader(_FramedReader(frame))
    objects: list[CityObject] = []
    issues: list[Issue] = [*frame.issues]
    for feature in _features(path):
        where = f"{local_name(feature)}[{name_of(feature)}]"
        line = feature.sourceline
        try:
            read, issues_of_feature = _object(feature, survey.version, others, reader)
        except (LookupError, ValueError) as error:
            issues.append(_left_out(where, error, line if isinstance(line, int) else 0))
        else:
            objects.append(read)
            issues += issues_of_feature
    if len(issues) > len(frame.issues) and not objects:
        raise ValueError(issues[len(frame.issues)].message)
    x, y, z = frame.offset.tolist()
    return City(tuple(objects), frame.crs, (x, y, z), tuple(issues))


def _left_out(where: str, error: Exception, line: int = 0) -> Issue:
    """Returns the issue of an unreadable feature."""
    return Issue("city.feature", Severity.ERROR, where, str(error), "left out", line)


def find_frame(path: Path) -> Frame:
    """Returns the transformation of a file's coordinates to metres, easting first.

    Args:
        path: CityGML of any version.

    Raises:
        EnvgenError: The file is not CityGML.
    """
    survey = _survey(path, whole=False)
    return frame_of(survey.srs_name, _places(survey), clues=Clues(survey.facing))


def _places(survey: _Survey) -> FloatArray:
    return np.array(survey.places or [np.zeros(3)])


def shared_geometry(path: Path) -> dict[str, etree._Element]:
    """Returns elements by id that features reference outside themselves.

    Args:
        path: CityGML of any version.

    Raises:
        EnvgenError: The file is not CityGML.
    """
    return _elements(path, _survey(path).wanted)


def _object(
    feature: etree._Element,
    version: str,
    others: Mapping[str, etree._Element],
    reader: FeatureReader,
) -> tuple[CityObject, tuple[Issue, ...]]:
    removed = upgrade(feature) if version != "3.0" else []
    tidy(feature)
    inline(feature, others)
    place_templates(feature)
    reader.faults.clear()
    faced, issues = face_outwards(_without_gaps(reader.feature(feature)))
    where = f"{faced.kind}[{faced.id}]"
    texts = (
        Issue("city.attribute", Severity.WARNING, where, fault, "kept as text")
        for fault in reader.faults
    )
    levels = (Issue("city.level", Severity.WARNING, where, name, "left out") for name in removed)
    return classify(faced), (*levels, *texts, *issues)


def _without_gaps(feature: CityObject) -> CityObject:
    """A feature without the properties whose references dangle."""
    lods = {surface.lod for surface in feature.surfaces}
    return replace(
        feature,
        solid_lod=feature.solid_lod if feature.solid_lod in lods else -1,
        geometry={name: shape for name, shape in feature.geometry.items() if len(shape)},
        children=tuple(map(_without_gaps, feature.children)),
    )


def _survey(path: Path, *, whole: bool = True) -> _Survey:
    """What the reader needs before the features; in part, what tells the place of the file."""
    survey = _Survey()
    for number, element in enumerate(stream_members(path, "Envelope", "metaDataProperty")):
        if not survey.version:
            root = element.getroottree().getroot()
            survey.version = namespace_of(root).rpartition("/")[2]
        _note_name(element, survey)
        if number < _MOST_CLUES:
            _note_place(element, survey)
            survey.facing += facing(element) if has_two_orders(survey.srs_name) else 0
        elif not whole:
            break
        survey.wanted |= references(element)
    return survey


def _note_name(element: etree._Element, survey: _Survey) -> None:
    """Records the first srsName, unless it is known."""
    if element.get(_TITLE) == "crs":
        # CityGML has no srsName for an unregistered CRS; our files name it in the header.
        survey.srs_name = "".join(map(str, element.itertext())).strip()
    for inner in element.iter(etree.Element) if not survey.srs_name else ():
        survey.srs_name = survey.srs_name or inner.get("srsName", "")


def _note_place(element: etree._Element, survey: _Survey) -> None:
    """Records the first point of an element."""
    places = (_place(inner) for inner in element.iter(etree.Element))
    survey.places += islice((place for place in places if place is not None), 1)


def _place(element: etree._Element) -> FloatArray | None:
    if local_name(element) not in ("lowerCorner", "pos", "posList", "coordinates"):
        return None
    try:
        numbers = [float(n) for n in (element.text or "").replace(",", " ").split()[:3]]
    except ValueError:
        return None
    return np.array([*numbers, 0.0, 0.0, 0.0][:3]) if len(numbers) > 1 else None


def _elements(path: Path, names: set[str]) -> dict[str, etree._Element]:
    """Copies of elements by their id."""
    if not names:
        return {}
    return {
        name_of(element): deepcopy(element)
        for member in stream_members(path)
        for element in member.iter(etree.Element)
        if name_of(element) in names
    }


def _features(path: Path) -> Iterator[etree._Element]:
    for member in stream_members(path):
        for feature in member.iterchildren(etree.Element):
            if local_name(feature) not in _GROUPS:
                yield feature
