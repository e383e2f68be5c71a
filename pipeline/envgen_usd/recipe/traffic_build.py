"""The table of contents of traffic: from a trace to a layer of moving actors on a stage."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from envgen_usd.assets.asset_catalogue import Catalogue, read_catalogue
from envgen_usd.build_manifest import NAME, Manifest, finished_manifest, hash_files, write_manifest
from envgen_usd.environment_files import read_profile
from envgen_usd.errors import EnvgenError, Issue, Severity, refuse_issues
from envgen_usd.exchange.build_road import check_road
from envgen_usd.folder_lock import locked
from envgen_usd.layers.actor_choice import ActorChoice, size_issues
from envgen_usd.layers.embedded_library import asset_files, embed_library
from envgen_usd.layers.stage_surface import StageSurface
from envgen_usd.layers.traffic_layer import write_traffic
from envgen_usd.layers.traffic_sublayer import (
    SUBLAYER,
    add_sublayer,
    layer_facts,
    remove_sublayer,
)
from envgen_usd.models.actor_looks import MovingLook
from envgen_usd.models.actors import Motion, Trace
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.environment_profile import PropRules
from envgen_usd.output_folder import STAGE_FILE
from envgen_usd.recipe.build_options import BuildOptions
from envgen_usd.recipe.map_land import read_road
from envgen_usd.step_clock import Clock, Progress
from envgen_usd.traffic.motion.actor_motion import Ridden, ride
from envgen_usd.traffic.motion.conflicts import actor_conflicts, boxes_of, object_conflicts
from envgen_usd.traffic.motion.sidesteps import sidestepped
from envgen_usd.traffic.motion.surface_contact import ContactSurface
from envgen_usd.traffic.open_scenario.scenario_file import ScenarioFile
from envgen_usd.traffic.open_scenario.scenario_play import play
from envgen_usd.traffic.traces.sumo_run import FleetBody, SumoOptions, simulate
from envgen_usd.whole_files import remove_abandoned

BESIDE = ".."
"""Path from the folder of layers to the embedded library."""


@dataclass(frozen=True)
class TrafficResult:
    """Products and statistics of a run.

    Attributes:
        layer: The written layer.
        actors: Number of actors by kind.
        seconds: Time from the first to the last frame.
        rate: Frames a second.
        issues: What was left out, guessed or is in the way.
    """

    layer: Path
    actors: dict[str, int]
    seconds: float
    rate: float
    issues: tuple[Issue, ...]


def add_traffic(  # noqa: PLR0913 - the options of the command
    out: Path,
    read: Callable[[], Trace],
    seed: int = 0,
    library: Path | None = None,
    progress: Progress = lambda *_: None,
    *,
    strict: bool = False,
) -> TrafficResult:
    """Puts the actors of a trace onto the stage of a build; they replace those of earlier runs.

    Args:
        out: Output folder of a build.
        read: Reads the trace.
        seed: Random seed of the looks.
        library: Asset library; `None` means that of the build.
        progress: Told of the steps.
        strict: Refuse traces with issues.

    Raises:
        EnvgenError: The folder holds no build, or the trace cannot be used. The stage is unchanged.
    """
    clock = Clock(progress)
    manifest = check_build(out)
    with locked(out):
        folder = out.absolute()
        remove_abandoned(folder)
        catalogue = _catalogue(manifest, library)
        with clock.step("trace"):
            trace = read()
        with clock.step("surface"):
            weights, unknown = _weights(manifest, library)
            looks, ridden, issues = _placed(folder, trace, catalogue, seed, weights)
        with clock.step("objects"):
            conflicts = _conflicts(folder, ridden.motions, looks, trace)
            issues = (*trace.issues, *unknown, *issues, *conflicts)
        if strict:
            refuse_issues(issues)
        with clock.step("layer"):
            frames, files = _write(folder, ridden, looks, catalogue, seed)
            _record(manifest, folder, files)
    kinds = sorted({look.kind for look in looks})
    counts = {kind: sum(look.kind == kind for look in looks) for kind in kinds}
    return TrafficResult(folder / SUBLAYER, counts, frames / ridden.rate, ridden.rate, issues)


def simulated(out: Path, road: Path, options: SumoOptions, library: Path | None = None) -> Trace:
    """Drives vehicles of the library and people on the road of a build.

    They go around objects of the stage where there is room.

    Raises:
        EnvgenError: The road is not that of the build, or SUMO is missing or cannot use it.
    """
    manifest = check_build(out)
    check_road(out, road)
    weights, _ = _weights(manifest, library)
    bodies = ActorChoice(_catalogue(manifest, library), options.seed, weights).bodies()
    fleet = [
        FleetBody(kind, name, (*size.tolist(),), weight) for kind, name, size, weight in bodies
    ]
    trace = simulate(road.absolute(), fleet, options)
    near = np.concatenate([each.positions[:, :2] for each in trace.actors])
    obstacles = StageSurface(out / STAGE_FILE).obstacles(near)
    return sidestepped(trace, obstacles)


def played(out: Path, scenario: Path, road: Path | None, tolerance: float, seconds: float) -> Trace:
    """Plays a scenario on the road of a build.

    Args:
        out: Output folder of the build.
        scenario: OpenSCENARIO file.
        road: OpenDRIVE file; `None` means that which the scenario names.
        tolerance: Chord error of the lanes, metres.
        seconds: Time after which the scenario ends, unless it ends before.

    Raises:
        EnvgenError: The road is not that of the build, or the scenario cannot be used.
    """
    file = ScenarioFile(scenario)
    source = road or file.road
    if source is None:
        raise EnvgenError(f"{scenario}: names no road file; give it as --road FILE")
    check_road(out, source)
    _, surface = read_road(source, tolerance)
    return play(file, surface.lanes, surface.roads, seconds)


def remove_traffic(out: Path) -> bool:
    """Takes the moving actors from the stage of a build; False if there are none.

    Raises:
        EnvgenError: The folder holds no build.
    """
    manifest = check_build(out)
    with locked(out):
        folder = out.absolute()
        remove_abandoned(folder)
        there = remove_sublayer(folder)
        _record(manifest, folder, ())
    return there


def _record(manifest: Manifest, folder: Path, files: Iterable[str]) -> None:
    """Writes the hashes of new files, of the stage and of the layer into the manifest."""
    known = {name: value for name, value in manifest.products.items() if name != SUBLAYER}
    names = {*files, STAGE_FILE, *([SUBLAYER] if (folder / SUBLAYER).exists() else [])}
    new = hash_files([folder / name for name in names], folder)
    write_manifest(replace(manifest, products=dict(sorted({**known, **new}.items()))), folder)


def check_build(out: Path) -> Manifest:
    """Returns the manifest of a build.

    Raises:
        EnvgenError: The folder holds no finished build.
    """
    manifest = finished_manifest(out)
    if not (out / STAGE_FILE).is_file():
        raise EnvgenError(f"{out}: holds no {STAGE_FILE}; run envgen-usd build again")
    return manifest


def _catalogue(manifest: Manifest, library: Path | None) -> Catalogue:
    """The library of the build."""
    stated = manifest.inputs.get("library") or ""
    folder = library or (Path(stated) if stated else None)
    return read_catalogue(folder, embed=bool(manifest.inputs.get("embed_assets", True)))


def _weights(
    manifest: Manifest, library: Path | None
) -> tuple[Mapping[str, PropRules], tuple[Issue, ...]]:
    """Weights of assets and variants in the environment of the build."""
    inputs = manifest.inputs
    places = (inputs.get("environments"), library or inputs.get("library"))
    own, shared = (Path(place) if place else None for place in places)
    options = BuildOptions(
        Path(), inputs["country"], inputs["area"], Path(), library=shared, environments=own
    )
    try:
        profile = read_profile(options.country, options.area, options.environments_folder())
    except EnvgenError as error:
        issue = Issue(
            "traffic.environment", Severity.INFO, NAME, str(error), "all looks are equally likely"
        )
        return {}, (issue,)
    return profile.props, ()


def _placed(
    folder: Path,
    trace: Trace,
    catalogue: Catalogue,
    seed: int,
    props: Mapping[str, PropRules],
) -> tuple[list[MovingLook], Ridden, tuple[Issue, ...]]:
    """Looks and motions of the actors that are on the map."""
    choice = ActorChoice(catalogue, seed, props)
    looks = {actor.id: choice.look(actor) for actor in trace.actors}
    stage = StageSurface(folder / STAGE_FILE)

    def surface(points: FloatArray) -> ContactSurface:
        return ContactSurface(stage.triangles("Roads", points), stage.triangles("Terrain", points))

    ridden = ride(trace, surface, lambda actor: looks[actor.id].contacts())
    actors = [motion.actor for motion in ridden.motions]
    shown = [looks[actor.id] for actor in actors]
    return shown, ridden, (*ridden.issues, *size_issues(actors, shown, trace.source))


def _conflicts(
    folder: Path, motions: Sequence[Motion], looks: Sequence[MovingLook], trace: Trace
) -> list[Issue]:
    """Actors that overlap one another or the objects of the stage."""
    boxes = boxes_of(motions, [look.size for look in looks])
    ids = [motion.actor.id for motion in motions]
    near = np.concatenate([motion.places[:, :2] for motion in motions])
    obstacles = StageSurface(folder / STAGE_FILE).obstacles(near)
    found = object_conflicts(boxes, ids, obstacles, trace.source)
    return [*actor_conflicts(boxes, ids, trace.source), *found]


def _write(
    folder: Path, ridden: Ridden, looks: Sequence[MovingLook], catalogue: Catalogue, seed: int
) -> tuple[int, frozenset[str]]:
    """Writes assets, layer and stage; returns the frames after the first, and the assets' files."""
    files: frozenset[str] = frozenset()
    used = sorted({look.path for look in looks if look.asset})
    embedded = catalogue.prefix != catalogue.folder.as_posix()
    if embedded:
        files = asset_files(catalogue, used)
        embed_library(catalogue, folder, files)
    library = BESIDE if embedded else catalogue.folder.as_posix()
    source = ridden.source
    facts = layer_facts(folder, source, seed)
    first, last = write_traffic(
        ridden.motions, looks, ridden.rate, source, library, folder / SUBLAYER, facts
    )
    add_sublayer(folder, ridden.rate, first, last)
    return last - first, files
