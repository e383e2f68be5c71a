"""The command `traffic`."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from envgen_usd.commands.option_types import Library, Seed, Strict
from envgen_usd.errors import EnvgenError
from envgen_usd.idle_options import refuse_idle

if TYPE_CHECKING:
    from envgen_usd.models.actors import Trace
    from envgen_usd.traffic.traces.sumo_run import SumoOptions

_TOLERANCE = 0.02
"""Largest distance between lanes and their lines, metres; smaller values are slower."""
_SECONDS = 60.0
"""Length of a simulation; a larger value gives more traffic to look at, and a larger layer."""
BuildFolder = Annotated[Path, typer.Argument(metavar="OUT", help="Folder of a build.")]


def traffic(
    out: BuildFolder,
    *,
    fcd: Annotated[
        Path | None, typer.Option(help="Floating car data of SUMO, .xml or .xml.gz.")
    ] = None,
    csv: Annotated[
        Path | None, typer.Option(help="CSV file of esmini: --csv_logger or dat2csv.")
    ] = None,
    osi: Annotated[
        Path | None, typer.Option(help="Trace of ASAM OSI, .osi or .mcap (extra: osi).")
    ] = None,
    net: Annotated[
        Path | None, typer.Option(help="SUMO network of --fcd; gives its offset.")
    ] = None,
    types: Annotated[
        list[Path] | None,
        typer.Option(help="Route file of --fcd with the vehicle types; repeat for more."),
    ] = None,
    sumo: Annotated[
        bool, typer.Option("--sumo", help="Simulate with SUMO (extra: traffic); needs --road.")
    ] = False,
    road: Annotated[
        Path | None, typer.Option(help="OpenDRIVE file of the build, for --sumo and --scenario.")
    ] = None,
    scenario: Annotated[
        Path | None, typer.Option(help="OpenSCENARIO file, .xosc, to be played on the road.")
    ] = None,
    seconds: Annotated[
        float, typer.Option(min=0.1, help="Length of --sumo; longest time of --scenario, seconds.")
    ] = _SECONDS,
    vehicles: Annotated[
        int | None, typer.Option(min=0, help="Number of vehicles of --sumo; default: 35 a lane-km.")
    ] = None,
    pedestrians: Annotated[
        int | None,
        typer.Option(min=0, help="Number of people of --sumo; default: 40 a km of sidewalk."),
    ] = None,
    remove: Annotated[
        bool, typer.Option("--remove", help="Take the moving actors from the stage.")
    ] = False,
    seed: Seed = 0,
    library: Library = None,
    strict: Strict = False,
) -> None:
    """Puts moving vehicles and people onto the stage of a build.

    They come from a trace or a simulation, stand on the stage's roads, and replace those of an
    earlier run. The layer is OUT/layers/traffic.usdc.
    """
    from envgen_usd.commands.terminal_output import print_issues, shown_progress
    from envgen_usd.recipe.traffic_build import add_traffic, remove_traffic
    from envgen_usd.traffic.traces.sumo_run import SumoOptions

    if not sumo:
        counts = {"--vehicles": vehicles, "--pedestrians": pedestrians}
        refuse_idle({name: n is not None for name, n in counts.items()}, "without --sumo")
    if not sumo and scenario is None:
        of_roads = {"--road": road, "--seconds": seconds != _SECONDS}
        refuse_idle(of_roads, "without --sumo or --scenario FILE")
    if fcd is None:
        refuse_idle({"--net": net, "--types": types}, "without --fcd FILE")
    sources: dict[str, Callable[[], Trace] | None] = {
        "--sumo": _sumo(out, road, SumoOptions(seconds, vehicles, pedestrians, seed), library)
        if sumo
        else None,
        "--fcd": _fcd(fcd, net, types or []) if fcd else None,
        "--scenario": _scenario(out, scenario, road, seconds) if scenario else None,
        "--osi": _osi(osi) if osi else None,
        "--csv": _csv(csv) if csv else None,
        "--remove": (lambda: None) if remove else None,  # type: ignore[dict-item, return-value]
    }
    given = [name for name, source in sources.items() if source]
    if len(given) != 1:
        raise EnvgenError(
            f"traffic: give one of {', '.join(sources)}; got {', '.join(given) or 'none'}"
        )
    if remove:
        print(f"removed from {out}" if remove_traffic(out) else f"{out}: has no traffic")
        return
    source = sources[given[0]]
    assert source
    with shown_progress() as progress:
        result = add_traffic(out, source, seed, library, progress, strict=strict)
    print_issues(result.issues)
    actors = ", ".join(f"{count} {kind}" for kind, count in result.actors.items())
    print(f"traffic: {actors}; {result.seconds:.1f} s at {result.rate:g} frames a second")
    print(f"layer: {result.layer}")


def _sumo(
    out: Path, road: Path | None, options: "SumoOptions", library: Path | None
) -> "Callable[[], Trace]":
    from envgen_usd.recipe.traffic_build import simulated

    if road is None:
        raise EnvgenError("traffic --sumo: give the OpenDRIVE file of the build as --road FILE")
    return lambda: simulated(out, road, options, library)


def _scenario(out: Path, path: Path, road: Path | None, seconds: float) -> "Callable[[], Trace]":
    from envgen_usd.recipe.traffic_build import played

    return lambda: played(out, path, road, _TOLERANCE, seconds)


def _fcd(path: Path, net: Path | None, types: list[Path]) -> "Callable[[], Trace]":
    from envgen_usd.traffic.traces.sumo_fcd import read_fcd

    return lambda: read_fcd(path, net, types)


def _osi(path: Path) -> "Callable[[], Trace]":
    from envgen_usd.traffic.traces.osi_trace import read_osi

    return lambda: read_osi(path)


def _csv(path: Path) -> "Callable[[], Trace]":
    from envgen_usd.traffic.traces.esmini_csv import read_csv_trace

    return lambda: read_csv_trace(path)
