"""Edits of TOML files change a value and nothing else."""

import tomllib

import pytest

from envgen_usd.errors import EnvgenError
from envgen_usd.toml_edits import Edit, edited

TEXT = """# A street.
[props.bin]  # what is emptied
variants.colour = { black = 4.0, green = 1.0 }  # seen in the north
"a key" = 1

[furniture]
bin = 70.0

[a.b]
list = [
    1, 2,
]
"""


@pytest.mark.parametrize(
    ("edit", "line"),
    [
        (Edit("furniture", "bin", 95.0), "bin = 95.0"),
        (Edit("furniture", "bench", 12.5, "from x"), "bench = 12.5  # learned from x"),
        (Edit("a.b", "range", [1.0, 2.5]), "range = [1.0, 2.5]"),
        (Edit("new", "x.y", {"a b": 1.0}), 'x.y = { "a b" = 1.0 }'),
        (
            Edit("props.bin", "variants.colour", {"red": 1 / 3}, "from x"),
            "variants.colour = { red = 0.3333 }  # seen in the north",
        ),
    ],
)
def test_a_value_is_replaced_or_added_and_the_rest_stays(edit, line):
    after = edited(TEXT, [edit], "street.toml")
    assert line in after.splitlines()
    gone = set(TEXT.splitlines()) - set(after.splitlines())
    assert len(gone) <= 1
    inner = tomllib.loads(after)
    for name in [*edit.table.split("."), *edit.key.split(".")]:
        inner = inner[name]
    if isinstance(edit.value, dict):
        assert inner == {name: round(value, 4) for name, value in edit.value.items()}
    else:
        assert inner == edit.value


def test_a_learned_comment_is_replaced():
    once = edited(TEXT, [Edit("furniture", "bin", 95.0, "from a")], "street.toml")
    twice = edited(once, [Edit("furniture", "bin", 96.0, "from b")], "street.toml")
    assert "bin = 96.0  # learned from b" in twice.splitlines()
    assert "from a" not in twice


def test_a_value_that_is_not_learned_says_why_until_it_is():
    edit = Edit("furniture", "bin", 95.0, "there is none", is_learned=False)
    once = edited(TEXT, [edit], "street.toml")
    assert "bin = 95.0  # not learned: there is none" in once.splitlines()
    twice = edited(once, [Edit("furniture", "bin", 96.0, "from b")], "street.toml")
    assert "bin = 96.0  # learned from b" in twice.splitlines()


@pytest.mark.parametrize("edit", [Edit("a.b", "list", [3.0]), Edit("a", "b.list", [3.0])])
def test_a_value_may_be_written_in_another_way(edit):
    assert tomllib.loads(edited(TEXT, [edit], "street.toml"))["a"] == {"b": {"list": [3.0]}}


@pytest.mark.parametrize("edit", [Edit("a", "b", 1.0), Edit("furniture.bin", "x", 1.0)])
def test_tables_and_values_do_not_replace_each_other(edit):
    with pytest.raises(EnvgenError) as error:
        edited(TEXT, [edit], "street.toml")
    assert edit.line() in str(error.value)
    assert "street.toml" in str(error.value)
