"""Reads CityGML 1.0, 2.0 and 3.0 that other programs wrote."""

from collections.abc import Iterator, Mapping
from copy import deepcopy
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from lxml import etree

from envgen_usd.chunks import snap
from envgen_usd.citygml.crs import Frame, frame_of
from envgen_usd.citygml.feature_read import FeatureReader
from envgen_usd.citygml.geometry_read import GeometryReader, local_name
from envgen_usd.citygml.links import inline, name_of, references
from envgen_usd.citygml.orientation import face_outwards
from envgen_usd.citygml.semantics import classify
from envgen_usd.citygml.templates import place_templates
from envgen_usd.citygml.tidy import tidy
from envgen_usd.citygml.upgrade import upgrade
from envgen_usd.errors import EnvgenError, Issue, Severity
from envgen_usd.models.arrays import FloatArray
from envgen_usd.models.city import City, CityObject

_TITLE = "{http://www.w3.org/1999/xlink}title"
_GROUPS = ("CityObjectGroup", "Appearance")


@dataclass
class _Survey:
    """What is to be known of a file before its features are read.

    Attributes:
        version: Of CityGML, e.g. ``2.0``.
        srs_name: Of the envelope, or the first one named.
        corner: Any place in the file, 3, or none where it holds no coordinates.
        wanted: Ids of geometry that features refer to and do not hold themselves.
    """

    version: str = ""
    srs_name: str = ""
    corner: FloatArray | None = None
    wanted: set[str] = field(default_factory=set)


class _FramedReader(GeometryReader):
    """Coordinates of any CRS."""

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
    path: Path, crs: str = "", offset: tuple[float, float, float] | None = None
) -> City:
    """Reads a CityGML file of any version that another program wrote.

    What older versions call otherwise gets the names of 3.0; geometry that is referred to stands
    where it is used; polygons of buildings without a class get one; solids that are inside out are
    turned; coordinates are in metres, easting first. A feature that cannot be read is left out.

    Args:
        path: The file.
        crs: CRS that the city is to have; empty for that of the file or, if that is not metric, for
            the zone of UTM.
        offset: Offset that the city is to have; none for one that leaves small numbers.

    Raises:
        EnvgenError: The file is no CityGML, or the CRS is none.
        ValueError: No feature can be read.
    """
    survey = _survey(path)
    corner = np.zeros(3) if survey.corner is None else survey.corner
    frame = frame_of(survey.srs_name, corner, crs, offset)
    others = _elements(path, survey.wanted)
    reader = FeatureReader(_FramedReader(frame))
    objects: list[CityObject] = []
    issues: list[Issue] = []
    for feature in _features(path):
        where = f"{local_name(feature)}[{name_of(feature)}]"
        line = feature.sourceline
        try:
            read, found = _object(feature, survey.version, others, reader)
        except (LookupError, ValueError) as error:
            issues.append(_left_out(where, error, line if isinstance(line, int) else 0))
        else:
            objects.append(read)
            issues += found
    if issues and not objects:
        raise ValueError(issues[0].message)
    x, y, z = frame.offset.tolist()
    return City(tuple(objects), frame.crs, (x, y, z), tuple(issues))


def _left_out(where: str, error: Exception, line: int = 0) -> Issue:
    """Returns the issue of a feature that cannot be read."""
    return Issue("city.feature", Severity.ERROR, where, str(error), "left out", line)


def find_frame(path: Path) -> Frame:
    """Returns how coordinates of a file become metres, easting first.

    Args:
        path: CityGML of any version.

    Raises:
        EnvgenError: The file is no CityGML.
    """
    survey = _Survey()
    for element in _members(path, "Envelope", "metaDataProperty"):
        _note_place(element, survey)
        if survey.corner is not None:
            break
    corner = np.zeros(3) if survey.corner is None else survey.corner
    return frame_of(survey.srs_name, corner)


def shared_geometry(path: Path) -> dict[str, etree._Element]:
    """Returns by their id the elements that features refer to and do not hold themselves.

    Args:
        path: CityGML of any version.

    Raises:
        EnvgenError: The file is no CityGML.
    """
    return _elements(path, _survey(path).wanted)


def _object(
    feature: etree._Element,
    version: str,
    others: Mapping[str, etree._Element],
    reader: FeatureReader,
) -> tuple[CityObject, tuple[Issue, ...]]:
    if version != "3.0":
        upgrade(feature)
    tidy(feature)
    inline(feature, others)
    place_templates(feature)
    faced, issues = face_outwards(_without_gaps(reader.feature(feature)))
    return classify(faced), issues


def _without_gaps(feature: CityObject) -> CityObject:
    """A feature without properties whose references led nowhere."""
    lods = {surface.lod for surface in feature.surfaces}
    return replace(
        feature,
        solid_lod=feature.solid_lod if feature.solid_lod in lods else -1,
        geometry={name: shape for name, shape in feature.geometry.items() if len(shape)},
        children=tuple(map(_without_gaps, feature.children)),
    )


def _survey(path: Path) -> _Survey:
    survey = _Survey()
    for element in _members(path, "Envelope", "metaDataProperty"):
        if not survey.version:
            root = element.getroottree().getroot()
            survey.version = str(etree.QName(root).namespace).rpartition("/")[2]
        _note_place(element, survey)
        survey.wanted |= references(element)
    return survey


def _note_place(element: etree._Element, survey: _Survey) -> None:
    """Notes the first CRS and the first place that are named, unless they are known."""
    if survey.srs_name and survey.corner is not None:
        return
    if element.get(_TITLE) == "crs":
        # CityGML has no srsName for a CRS that no registry knows; ours stands in the header.
        survey.srs_name = "".join(map(str, element.itertext())).strip()
    for inner in element.iter(etree.Element):
        survey.srs_name = survey.srs_name or inner.get("srsName", "")
        if survey.corner is None:
            survey.corner = _place(inner)


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
        for member in _members(path)
        for element in member.iter(etree.Element)
        if name_of(element) in names
    }


def _features(path: Path) -> Iterator[etree._Element]:
    for member in _members(path):
        for feature in member.iterchildren(etree.Element):
            if local_name(feature) not in _GROUPS:
                yield feature


def _members(path: Path, *more: str) -> Iterator[etree._Element]:
    """Members of the model, and other elements by name, one after the other."""
    wanted = ("cityObjectMember", "featureMember", "appearanceMember", *more)
    with path.open("rb") as file:
        events = etree.iterparse(
            file,
            tag=tuple(f"{{*}}{name}" for name in wanted),
            remove_comments=True,
            remove_pis=True,
            resolve_entities=False,
            no_network=True,
        )
        for _, element in events:
            parent = element.getparent()
            if parent is None or (_is_member(element) and local_name(parent) != "CityModel"):
                continue
            yield element
            if _is_member(element):
                element.clear()
                while element.getprevious() is not None:
                    del parent[0]
        if events.root is None or local_name(events.root) != "CityModel":
            raise EnvgenError(f"{path}: is no CityGML: its root is not CityModel")


def _is_member(element: etree._Element) -> bool:
    return local_name(element).endswith("Member")
