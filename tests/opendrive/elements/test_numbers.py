import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from envgen_usd.opendrive.document.number_attributes import LARGEST, read, write


@given(st.floats(min_value=-LARGEST, max_value=LARGEST))
def test_what_is_written_reads_back_as_the_same_number(value):
    assert read(write(value)) == value


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("0.000000+0", 0.0),
        ("1.25-2", 0.0125),
        ("1.5D+3", 1500.0),
        (" 7 ", 7.0),
        ("3,5", 3.5),
        ("3.5m", 3.5),
        ("-.5", -0.5),
        ("nan", None),
        ("-inf", None),
        ("1e400", None),
        ("", None),
        ("abc", None),
    ],
)
def test_malformed_numbers(text, value):
    """Trap 2."""
    assert read(text) == value


@given(st.text(max_size=30))
def test_any_text_gives_a_finite_number_or_none(text):
    value = read(text)
    assert value is None or (math.isfinite(value) and abs(value) <= LARGEST)
