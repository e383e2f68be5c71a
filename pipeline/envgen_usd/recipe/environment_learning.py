"""Learns an environment from a real place.

Two steps: the place's figures become the environment's distributions (`places.environment_fit`);
then towns on the place's own streets, one after the other, show how far from their streets they
stand, corners and crossing streets included, and the setbacks are corrected by that much (indirect
inference: Gouriéroux, Monfort and Renault 1993).
"""

import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import shapely

from envgen_usd.errors import EnvgenError
from envgen_usd.models.distribution import Correlation, Quantiles, quantiles_of
from envgen_usd.models.environment_profile import Profile
from envgen_usd.models.place import Place
from envgen_usd.output_folder import check_writable
from envgen_usd.places.building_figures import BuildingFigures, measure
from envgen_usd.places.environment_fit import (
    BOUNDS,
    LEAST_SAMPLES,
    Learnt,
    LearntValue,
    learnt_values,
)
from envgen_usd.places.street_figures import measure_streets
from envgen_usd.recipe.environment_edits import read_environment
from envgen_usd.recipe.generated_town import generated_town
from envgen_usd.step_clock import Progress
from envgen_usd.toml_edits import Edit, Value, edited

TOWN = 1000.0
"""Side of the densest square of a place in which towns are compared, metres."""
ROUNDS = 3
"""Number of towns by which setbacks are corrected; more bring them nearer, and take time."""


def learnt_environment(
    place: Place,
    base: Profile,
    landuse: str = "",
    rounds: int = ROUNDS,
    progress: Progress = lambda *_: None,
) -> Learnt:
    """Fits an environment to a place.

    Args:
        place: The place.
        base: Environment whose values stay where there are too few samples.
        landuse: ``residential`` or ``industrial`` learns from these buildings; empty from all.
        rounds: Number of towns by which setbacks are corrected.
        progress: Called at each step.

    Raises:
        EnvgenError: No building is large enough, or is of the landuse.
    """
    figures, streets = measure(place, landuse), measure_streets(place)
    if not len(figures.area):
        kind = f"{landuse} " if landuse else ""
        raise EnvgenError(
            f"{place.source}: holds no {kind}main building to learn from; choose another --landuse"
        )
    values = learnt_values(figures, streets, base)
    fitted = _fitted(values, base, place.source)
    quarter = densest(place, TOWN)
    if not len(quarter.streets) or np.sum(figures.at_street) < LEAST_SAMPLES:
        return Learnt(*fitted, values, figures, streets, None)
    for number in range(rounds):
        progress("town", number, rounds + 1)
        town = measure(generated_town(quarter.streets, fitted[0], number))
        values = tuple(_corrected(value, figures, town) for value in values)
        fitted = _fitted(values, base, place.source)
    progress("town", rounds, rounds + 1)
    town = measure(generated_town(quarter.streets, fitted[0], rounds))
    return Learnt(*fitted, values, figures, streets, town)


def check_new_environment(file: Path) -> None:
    """Checks that the file of a new environment can be written and will be found.

    Raises:
        EnvgenError: It exists, or is not named ``country_<name>/<area>.toml``.
    """
    folder = file.resolve().parent.name
    if file.suffix != ".toml" or not folder.removeprefix("country_") or folder[:8] != "country_":
        raise EnvgenError(f"{file}: expected --out FOLDER/country_<name>/<area>.toml")
    if file.exists():
        raise EnvgenError(f"{file}: exists already; remove it, or choose another --out")
    check_writable(file.parent)


def densest(place: Place, side: float) -> Place:
    """The square with the most buildings; the whole place where it is smaller."""
    west, south, east, north = place.bounds()
    middles = shapely.get_coordinates(shapely.centroid(place.houses.footprints))
    half = side / 2.0
    x, y = (
        np.arange(low + half, max(high - half, low + half) + 1.0, side / 6.0)
        for low, high in ((west, east), (south, north))
    )
    centres = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 1, 2)
    counts = (np.abs(middles - centres).max(axis=2) <= half).sum(axis=1)
    best = centres[int(np.argmax(counts)), 0]
    return place.within((*(best - half).tolist(), *(best + half).tolist()))


def _corrected(value: LearntValue, real: BuildingFigures, town: BuildingFigures) -> LearntValue:
    """The setback, moved by what a town of it lacks, quantile by quantile; others as they are."""
    before = value.value
    wanted, found = (figures.setback[figures.at_street] for figures in (real, town))
    few = min(len(wanted), len(found)) < LEAST_SAMPLES
    if (value.table, value.key) != ("buildings", "setback") or few:
        return value
    if not isinstance(before, Quantiles):
        return value
    count = len(before.quantiles)
    wanted, found = (np.array(quantiles_of(s, count, 0.0).quantiles) for s in (wanted, found))
    moved = np.clip(np.array(before.quantiles) + wanted - found, *BOUNDS["setback"])
    return replace(
        value, value=replace(before, quantiles=tuple(np.sort(np.round(moved, 3)).tolist()))
    )


def _fitted(values: Sequence[LearntValue], base: Profile, source: str) -> tuple[Profile, str]:
    """The environment with values, and its file's content."""
    text = Path(base.source).read_text(encoding="utf-8")
    text = edited(text, edits_of(values, base, source), base.source)
    if base.blocks.uses:
        # The figures are those of houses at streets; the base's inner rows are not this place's.
        text = edited(text, _AT_STREETS, base.source)
    if any((value.table, value.key) == ("buildings", "style") and value.value for value in values):
        text = edited(text, _ALONG_STREETS, base.source)
    if text.startswith("#"):
        # The base's title would name another place.
        title = f"# Learned from {source}; other values of country {base.country}, {base.area}."
        text = f"{title}\n{text.partition(chr(10))[2]}"
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / f"country_{base.country}" / f"{base.area}.toml"
        file.parent.mkdir()
        file.write_text(text, encoding="utf-8")
        return replace(read_environment(file), source=base.source), text


_ALONG_STREETS = (
    Edit("plots", "occupancy", 1.0, "gaps beside houses hold the open front", is_learned=False),
    Edit("plots", "infill", 0.85),
)
_AT_STREETS = (
    Edit("blocks", "inner", 0.0, "houses stand at streets alone", is_learned=False),
    Edit("blocks", "uses", {}),
    Edit("blocks", "falloff", 0.0),
    Edit("blocks", "outer_rows", 1),
    Edit("blocks", "ends", 0.0),
)


def edits_of(values: Sequence[LearntValue], base: Profile, source: str) -> tuple[Edit, ...]:
    """Edits that write values into the file of an environment, with their samples as comments."""
    edits: list[Edit] = []
    for value in values:
        if isinstance(value.value, Correlation):
            edits += _correlation(value.value, source)
        elif value.value is not None:
            note = f"from {source}: {value.samples} samples"
            edits.append(Edit(value.table, value.key, _plain(value.value), note))
        elif (kept := _kept(base, value)) is not None:
            note = f"nothing from {source}: {value.samples} samples, {LEAST_SAMPLES} are needed"
            edits.append(Edit(value.table, value.key, kept, note))
    return tuple(edits)


def _correlation(found: Correlation, source: str) -> list[Edit]:
    table = "buildings.correlation"
    known = {name: _plain(quantiles) for name, quantiles in found.known.items()}
    return [
        Edit(table, "figures", found.figures, f"from {source}: {found.samples} samples"),
        Edit(table, "matrix", found.matrix),
        Edit(table, "known", known),
        Edit(table, "samples", found.samples),
    ]


def _kept(base: Profile, value: LearntValue) -> Value | None:
    """Value of an environment that stays; `None` where it has none."""
    kept: object = base
    for name in (*value.table.split("."), value.key):
        kept = getattr(kept, name)
    return None if kept is None else _plain(kept)


def _plain(value: object) -> Value:
    """A value of an environment as it stands in a file."""
    if isinstance(value, Quantiles):
        return {"quantiles": value.quantiles, "samples": value.samples}
    if isinstance(value, str | float | int | tuple | Mapping):
        return value
    raise TypeError(f"{value!r} stands in no environment")
