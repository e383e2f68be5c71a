"""A comparison that tells where two cities differ, and the official schema."""

import dataclasses
from collections.abc import Mapping
from itertools import zip_longest

import numpy as np
import pytest
from lxml import etree


def _leaves(model, where):
    """Every value of a model with its place."""
    if isinstance(model, np.ndarray):
        yield where, (model.dtype, model.shape, model.tolist())
    elif dataclasses.is_dataclass(model):
        for field in dataclasses.fields(model):
            yield from _leaves(getattr(model, field.name), f"{where}.{field.name}")
    elif isinstance(model, Mapping):
        yield where, sorted(model)
        for key in sorted(model):
            yield from _leaves(model[key], f"{where}[{key}]")
    elif isinstance(model, tuple):
        yield where, len(model)
        for index, item in enumerate(model):
            yield from _leaves(item, f"{where}[{index}]")
    else:
        yield where, (type(model), repr(model))


def _difference(one, two):
    pairs = zip_longest(_leaves(one, "city"), _leaves(two, "city"))
    return next(((a, b) for a, b in pairs if a != b), None)


@pytest.fixture(scope="session")
def difference():
    """Function of two cities: where they differ first, or none."""
    return _difference


@pytest.fixture(scope="session")
def xsd(citygml_schemas):
    """The official schema of CityGML 3.0."""
    return etree.XMLSchema(etree.parse(str(citygml_schemas / "citygml-3.0.xsd")))


@pytest.fixture(scope="session")
def old_xsd(citygml_schemas):
    """The official schema of CityGML 2.0."""
    return etree.XMLSchema(etree.parse(str(citygml_schemas / "citygml-2.0.xsd")))
