"""Facts of many objects as a table of columns, which is much shorter than a list of records."""

from typing import Any

from envgen_usd.exchange.stage_objects import StageObject


def object_table(objects: list[StageObject]) -> dict[str, Any]:
    """Facts of objects: ``common`` to all, and ``each`` as lists by name, in the given order.

    A dotted name such as ``attributes.country`` is a path; `None` stands for an object without the
    fact.
    """
    rows = [_flat(each.facts()) for each in objects]
    names = dict.fromkeys(name for row in rows for name in row)
    common, columns = {}, {}
    for name in names:
        values = [row.get(name) for row in rows]
        if all(value == values[0] for value in values):
            common[name] = values[0]
        else:
            columns[name] = values
    return {"count": len(rows), "common": common, "each": columns}


def _flat(facts: dict[str, Any]) -> dict[str, Any]:
    flat: dict[str, Any] = {}
    for name, value in facts.items():
        if isinstance(value, dict):
            flat |= {f"{name}.{inner}": each for inner, each in value.items()}
        else:
            flat[name] = value
    return flat
