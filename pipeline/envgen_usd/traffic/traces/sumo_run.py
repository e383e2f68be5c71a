"""Runs SUMO on the road of a build: its programs come with the wheel `eclipse-sumo`.

1. `netconvert` makes a network of the OpenDRIVE file, with its sidewalks.
2. `randomTrips.py` draws ways for vehicles and people; each vehicle passes several places, so that
   it stays on the map. Where it cannot, others follow.
3. `sumo` drives them. The time until all have departed is not shown.

netconvert drives on the right whatever the file says. So it gets the mirror image of a road with
traffic on the left, and the trace is mirrored back. It knows German signs only, so it gets their
numbers for those of the United States that say who waits.
"""

import importlib.util
import math
import os
import subprocess
import sys
import tempfile
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np
from lxml import etree

from envgen_usd.compressed_files import read_content
from envgen_usd.errors import EnvgenError, Issue, Severity, one_line
from envgen_usd.geometry.mirrored_opendrive import mirror_document, mirrored_points
from envgen_usd.models.actors import Actor, Trace
from envgen_usd.traffic.traces.actor_kinds import SIZES, Size
from envgen_usd.traffic.traces.sumo_fcd import read_fcd
from envgen_usd.xml_events import safe_parser

_STEP = 0.1
"""Seconds of a step of the simulation, and of the trace."""
_COARSE = 0.5
"""Seconds of a step where vehicles are only counted; a larger value counts faster."""
_DEPARTURE = 30.0
"""Seconds in which all actors depart; a larger value spreads them."""
_LEAD = 90.0
"""Seconds before the trace begins, so that traffic has found its queues.

Much more of them lock the crossings of a busy map without signals (Town01 after 180 s).
"""
_PLACES = 12
"""Places that each vehicle passes; a larger value keeps vehicles on the map for longer."""
_LONGEST_WALK = 400.0
"""Metres between begin and end of a walk; a larger value finds fewer ways on small maps."""
_CROWDS = 3
"""Crowds that are drawn until one has the right size; a larger value takes longer."""
_CHANGE = 3.0
"""Seconds of a lane change; 0 lets vehicles jump."""
_TYPE_MAPS = ("opendriveNetconvert.typ.xml", "opendriveNetconvertPedestrians.typ.xml")
"""Who may use which type of lane; without them, cars drive on sidewalks."""
_GERMAN = {"r1-1": "206", "r1-2": "205"}
"""German number of signs of the United States: netconvert 1.28 gives edges that end at sign 205 the
priority 0, at 301 the priority 2, and at signs of other countries 1."""
_CLASSES = {
    "car": "passenger",
    "van": "delivery",
    "truck": "truck",
    "bus": "bus",
    "motorcycle": "motorcycle",
    "bicycle": "bicycle",
}
SHARES = {"car": 0.56, "van": 0.13, "truck": 0.05, "bus": 0.03, "motorcycle": 0.03, "bicycle": 0.2}
"""Shares of the kinds of vehicles in a street of a town.

Vans drive 15 to 16 % of the motor vehicle kilometres on urban roads (Department for Transport, Road
Traffic Estimates 2019, Great Britain). In German towns 11 to 15 % of the ways are ridden and 38 to
43 % driven, in times that are about as long (Mobilität in Deutschland 2017); with goods traffic, a
fifth of the vehicles in a street at a time are bicycles.
"""
VEHICLES_A_KM = 28.0 / (1.0 - SHARES["bicycle"])
"""Vehicles on a kilometre of a lane: motor vehicles at capacity, the upper end of level of service
E of the Highway Capacity Manual (45 cars a mile and lane are 28 a kilometre), as in a town at a
busy hour; and bicycles beside them."""
PEOPLE_A_KM = 40.0
"""People on a kilometre of a sidewalk: 190 an hour at 1.3 m/s, as in a busy street of a town."""
_NOT_DRIVEN = {"parking", "shoulder", "stop", "border"}
"""Types of lanes on which nobody drives along."""
_STANDS = 0.5
"""Metres within which a vehicle stays that stands; a larger value names slow queues, too."""
_TIMEOUT = 600.0
"""Seconds after which a program of SUMO is ended."""


@dataclass(frozen=True)
class FleetBody:
    """A body of vehicles.

    Attributes:
        kind: Kind of actor.
        model: Name by which its asset is found again.
        size: Length, width and height, metres.
        weight: Among the bodies of its kind.
    """

    kind: str
    model: str
    size: Size
    weight: float = 1.0


@dataclass(frozen=True)
class SumoOptions:
    """Options of a run.

    Attributes:
        seconds: Length of the trace.
        vehicles: Number of vehicles; None follows from the length of the lanes.
        pedestrians: Number of people; None follows from the length of the sidewalks.
        seed: Random seed.
    """

    seconds: float = 60.0
    vehicles: int | None = None
    pedestrians: int | None = None
    seed: int = 0


def simulate(road: Path, fleet: Sequence[FleetBody], options: SumoOptions) -> Trace:
    """Drives vehicles and people on a road.

    Args:
        road: OpenDRIVE file.
        fleet: Bodies of vehicles; kinds without any have usual sizes.
        options: How many, and for how long.

    Raises:
        EnvgenError: SUMO is not installed, or cannot use the road.
    """
    home = sumo_home()
    if (options.vehicles == 0 and options.pedestrians == 0) or options.seconds <= 0.0:
        raise EnvgenError("traffic --sumo: give at least one vehicle or pedestrian, and a time")
    with tempfile.TemporaryDirectory(prefix="envgen-usd-sumo.") as name:
        run = _Run(home, Path(name), options.seed)
        image, is_mirrored = _for_netconvert(road, run.folder)
        issues = run.convert(image or road)
        wanted = run.wanted(options)
        routes, lost = run.draw(_types(fleet), wanted, _LEAD + options.seconds)
        run.drive(routes, _LEAD + options.seconds)
        if not run.has_actors():
            raise EnvgenError(
                "traffic --sumo: nobody is on the road in this time; give another seed, or a road "
                "with junctions"
            )
        trace = read_fcd(run.trace, run.net, [run.types])
    lost += turnout_issues(trace.actors, wanted)
    actors = tuple(replace(actor, times=actor.times - _LEAD) for actor in trace.actors)
    if is_mirrored:
        actors = tuple(map(_mirrored, actors))
    return replace(trace, actors=actors, source="SUMO", issues=(*issues, *lost, *trace.issues))


def turnout_issues(actors: Sequence[Actor], wanted: Mapping[str, int]) -> list[Issue]:
    """Names a trace with fewer actors than wanted, and one in which every vehicle stands.

    Args:
        actors: Those of the trace.
        wanted: Number of each of ``vehicle`` and ``person``.
    """
    vehicles = [actor for actor in actors if actor.kind != "pedestrian"]
    there = {"vehicle": len(vehicles), "person": len(actors) - len(vehicles)}
    issues = []
    for tag, count in wanted.items():
        if there[tag] < count:
            grave = Severity.WARNING if 2 * there[tag] < count else Severity.INFO
            text = f"{there[tag]} of {count} {tag}s are on the road in the time of the trace"
            action = "the others have arrived, or wait for room: give the map fewer"
            issues.append(Issue("traffic.fewer", grave, "SUMO", text, action))
    longest = max(
        (float(np.ptp(each.positions[:, :2], axis=0).max()) for each in vehicles), default=1.0
    )
    if longest < _STANDS:
        text = "all vehicles stand: they block one another"
        action = "the trace shows them so: give another seed, or fewer vehicles"
        issues.append(Issue("traffic.standing", Severity.WARNING, "SUMO", text, action))
    return issues


def _for_netconvert(road: Path, folder: Path) -> tuple[Path | None, bool]:
    """A file that says the same to netconvert, where the road's own does not.

    Returns:
        The file, or `None` where the road's own will do; and whether it is the mirror image.

    Raises:
        EnvgenError: The file cannot be read.
    """
    content = read_content(road)
    if b"LHT" not in content and b"r1-" not in content.lower():
        return None, False
    try:
        root = etree.fromstring(content, safe_parser())
        rules = {each.get("rule", "RHT") for each in root.iterfind("{*}road")}
        if rules == {"LHT"}:
            mirror_document(root)
    except (etree.XMLSyntaxError, ValueError, KeyError) as error:
        raise EnvgenError(f"{road}: cannot be changed for SUMO: {one_line(error)}") from error
    for signal in root.iterfind("{*}road/{*}signals/{*}signal"):
        code = _GERMAN.get(signal.get("type", "").lower())
        if code and signal.get("country", "").lower() in {"us", "usa"}:
            signal.set("type", code)
    image = folder / "image.xodr"
    image.write_bytes(etree.tostring(root, xml_declaration=True, encoding="UTF-8"))
    return image, rules == {"LHT"}


def _mirrored(actor: Actor) -> Actor:
    """An actor with east and west swapped."""
    turned = (2.0 * np.pi - actor.headings) % (2.0 * np.pi) - np.pi
    return replace(actor, positions=mirrored_points(actor.positions), headings=turned)


def sumo_home() -> Path:
    """Returns the folder of SUMO's programs and tools.

    Raises:
        EnvgenError: SUMO is not installed.
    """
    spec = importlib.util.find_spec("sumo")
    places = [Path(each) for each in (spec.submodule_search_locations or [])] if spec else []
    places += [Path(os.environ["SUMO_HOME"])] if "SUMO_HOME" in os.environ else []
    for home in places:
        if (home / "tools" / "randomTrips.py").is_file():
            return home
    raise EnvgenError(
        "traffic --sumo: needs SUMO; install the extra: pip install 'envgen-usd[traffic]'"
    )


def _default(asked: int | None, density: float, net: Path, user: str) -> int:
    """What is asked for, or else what a density on the lanes of a class of users gives."""
    if asked is not None:
        return asked
    length = 0.0
    for edge in etree.parse(net).iterfind("edge"):
        if edge.get("function", "normal") != "normal":
            continue
        for lane in edge.iterfind("lane"):
            allowed = lane.get("allow", "all").split()
            if user == "pedestrian":
                # Lanes for all are carriageways, beside which people walk.
                is_open = allowed == ["pedestrian"]
            else:
                forbidden = {"all", user} & set(lane.get("disallow", "").split())
                is_open = bool({"all", user} & set(allowed)) and not forbidden
            # Parking lanes are open to cars, which do not drive along them.
            if is_open and lane.get("type") not in _NOT_DRIVEN:
                length += float(lane.get("length", 0.0))
    return math.ceil(density * length / 1000.0)


def _types(fleet: Sequence[FleetBody]) -> str:
    """A distribution of vehicle types, as an additional file of SUMO."""
    missing = [
        FleetBody(kind, kind, SIZES[kind])
        for kind in SHARES
        if kind not in {each.kind for each in fleet}
    ]
    bodies = [each for each in (*fleet, *missing) if each.kind in SHARES]
    sums: dict[str, float] = defaultdict(float)
    for each in bodies:
        sums[each.kind] += each.weight
    lines = []
    for body in bodies:
        length, width, height = body.size
        lines.append(
            f'<vType id={quoteattr(body.model)} vClass="{_CLASSES[body.kind]}" '
            f'length="{length:.3f}" width="{width:.3f}" height="{height:.3f}" '
            f'probability="{SHARES[body.kind] * body.weight / sums[body.kind]:.8f}"/>'
        )
    inside = "\n".join(lines)
    return (
        f'<additional><vTypeDistribution id="fleet">\n{inside}\n</vTypeDistribution></additional>'
    )


@dataclass(frozen=True)
class _Run:
    """A folder with the files of a run.

    Attributes:
        home: Folder of SUMO.
        folder: Temporary folder.
        seed: Random seed.
    """

    home: Path
    folder: Path
    seed: int

    @property
    def net(self) -> Path:
        return self.folder / "road.net.xml"

    @property
    def types(self) -> Path:
        return self.folder / "types.add.xml"

    @property
    def trace(self) -> Path:
        return self.folder / "fcd.xml"

    def convert(self, road: Path) -> list[Issue]:
        """Makes the network; returns how many warnings there were."""
        maps = [self.home / "data" / "typemap" / name for name in _TYPE_MAPS]
        options = ["--opendrive.import-all-lanes", "--walkingareas", "--crossings.guess"]
        options += ["--type-files", ",".join(str(each) for each in maps if each.is_file())]
        said = self._call(
            [self._program("netconvert"), "--opendrive", road, "-o", self.net, *options],
            f"netconvert cannot use {road}",
        )
        warnings = [line for line in said.splitlines() if line.startswith("Warning")]
        if not self.net.is_file():
            raise EnvgenError(f"traffic --sumo: netconvert makes no network of {road}")
        if not warnings:
            return []
        text = f"netconvert warns {len(warnings)} times: {warnings[0].removeprefix('Warning: ')}"
        return [Issue("traffic.network", Severity.INFO, road.name, text, "used as it is")]

    def wanted(self, options: SumoOptions) -> dict[str, int]:
        """Number of vehicles and of people."""
        return {
            "vehicle": _default(options.vehicles, VEHICLES_A_KM, self.net, "passenger"),
            "person": _default(options.pedestrians, PEOPLE_A_KM, self.net, "pedestrian"),
        }

    def draw(
        self, types: str, wanted: Mapping[str, int], end: float
    ) -> tuple[list[Path], list[Issue]]:
        """Draws the ways until an end, seconds; returns files of routes, and what got none."""
        self.types.write_text(types, encoding="utf-8")
        more = {
            "vehicle": ["--additional-files", self.types, "--trip-attributes", 'type="fleet"',
                        "--fringe-factor", 5],
            "person": ["--pedestrians", "--max-distance", _LONGEST_WALK],
        }  # fmt: skip
        routes, issues = [], []
        for tag, count in wanted.items():
            if count <= 0:
                continue
            file = self.folder / f"{tag}.rou.xml"
            if tag == "vehicle":
                found = self._vehicle_ways(file, count, end, more[tag])
            else:
                found = self._trips(tag, file, count, _DEPARTURE, more[tag])
            if found:
                routes.append(file)
            if found < count:
                text = f"only {found} of {count} {tag}s have a way on this road"
                issues.append(Issue("traffic.no_way", Severity.WARNING, "SUMO", text, "left out"))
        if not routes:
            raise EnvgenError("traffic --sumo: the road has no way for vehicles or people")
        return routes, issues

    def _vehicle_ways(self, file: Path, count: int, end: float, more: Sequence[object]) -> int:
        """Writes ways of so many vehicles at a time; returns how many of these have one."""
        # Roads around a single junction have no way through further places, nor has a ring whose
        # two directions do not meet.
        found = self._trips("vehicle", file, count, _DEPARTURE, [*more, "--intermediate", _PLACES])
        if found < count:
            found = self._trips("vehicle", file, count, _DEPARTURE, more)
        # On a small map most arrive before the trace begins: others depart all the time.
        there, seconds = self._turnout(file) if found else (count, 0.0)
        crowd = math.ceil(count * end / max(seconds, 1.0)) if 2 * there < count else 0
        for _ in range(_CROWDS if crowd else 0):
            self._trips("vehicle", file, crowd, end, more)
            there, _ = self._turnout(file)
            if there <= 1.2 * count:  # where there is no room for more, a larger crowd only waits
                break
            crowd = math.ceil(crowd * count / there)
        return found

    def _turnout(self, routes: Path) -> tuple[int, float]:
        """Vehicles on the road when the trace begins, and the mean time of finished ways."""
        times = self.folder / "times.xml"
        options = ["--tripinfo-output", times, "--tripinfo-output.write-unfinished"]
        self._sumo([routes], _LEAD, options, _COARSE)
        ways = [each.attrib for each in etree.parse(times).iter("tripinfo")]
        arrived = [float(way["duration"]) for way in ways if float(way["arrival"]) >= 0.0]
        return len(ways) - len(arrived), sum(arrived) / max(len(arrived), 1)

    def _trips(self, tag: str, file: Path, count: int, end: float, more: Sequence[object]) -> int:
        """Writes ways of so many who depart until an end; returns how many have one."""
        tool = self.home / "tools" / "randomTrips.py"
        try:
            self._call(
                [sys.executable, tool, "-n", self.net, "-o", self.folder / f"{tag}.trips.xml",
                 "-r", file, "--prefix", f"{tag}_", "-b", 0, "-e", end, "-p", end / count,
                 "--seed", self.seed, "--validate", *more],
                "",
            )  # fmt: skip
        except EnvgenError:
            # A network without sidewalks, or with a single edge: reported as without a way.
            file.unlink(missing_ok=True)
        return file.read_text("utf-8").count(f"<{tag} ") if file.is_file() else 0

    def drive(self, routes: Sequence[Path], end: float) -> None:
        """Runs the simulation."""
        trace = ["--fcd-output", self.trace, "--device.fcd.begin", _LEAD]
        self._sumo(routes, end, trace)

    def has_actors(self) -> bool:
        """True if somebody is on the road in the time of the trace."""
        with self.trace.open("rb") as lines:
            return any(b"<vehicle " in line or b"<person " in line for line in lines)

    def _sumo(
        self, routes: Sequence[Path], end: float, output: Sequence[object], step: float = _STEP
    ) -> None:
        self._call(
            [self._program("sumo"), "-n", self.net, "-r", ",".join(map(str, routes)),
             "--step-length", step, "-e", end, *output, "--seed", self.seed,
             "--lanechange.duration", _CHANGE, "--time-to-teleport", -1, "--no-step-log",
             "--no-warnings"],
            "sumo cannot drive on this road",
        )  # fmt: skip

    def _program(self, name: str) -> Path:
        found = [path for path in (self.home / "bin").glob(f"{name}*") if path.stem == name]
        if not found:
            raise EnvgenError(f"{self.home}: lacks the program {name}; install eclipse-sumo again")
        return found[0]

    def _call(self, command: Sequence[object], failure: str) -> str:
        """Runs a program; returns what it said.

        Raises:
            EnvgenError: It failed; the message is its first error.
        """
        environment = {**os.environ, "SUMO_HOME": str(self.home)}
        paths = [str(self.home / "tools"), str(self.home.parent), environment.get("PYTHONPATH", "")]
        environment["PYTHONPATH"] = os.pathsep.join(filter(None, paths))
        words = [str(word) for word in command]
        try:
            done = subprocess.run(
                words, capture_output=True, text=True, check=False, env=environment,
                cwd=self.folder, timeout=_TIMEOUT,
            )  # fmt: skip
        except (OSError, subprocess.TimeoutExpired) as error:
            raise EnvgenError(f"traffic --sumo: {words[0]}: {error}") from error
        if done.returncode:
            lines = (done.stderr + done.stdout).splitlines()
            reason = next((line for line in lines if line.startswith("Error")), "")
            raise EnvgenError(f"traffic --sumo: {failure}: {reason or done.returncode}")
        return done.stderr
