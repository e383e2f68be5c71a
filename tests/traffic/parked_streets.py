"""Streets of the tests: OpenDRIVE text ─► what parks and stands there, without a build."""

from collections import Counter
from dataclasses import replace

import numpy as np

from envgen_usd.chunks import Chunk
from envgen_usd.city.roads.road_index import RoadIndex
from envgen_usd.models.actor_rules import (
    ActorRules,
    BayRules,
    KerbObjectRules,
    KerbRules,
    LotRules,
    PeopleRules,
)
from envgen_usd.models.city_model import City, CityObject, Placement, ThematicSurface
from envgen_usd.models.ground import GroundMesh
from envgen_usd.models.landuse import LanduseClass, Plot
from envgen_usd.models.parked_actors import ActorLook
from envgen_usd.models.polygon_arrays import Polygons
from envgen_usd.opendrive.features.road_features import road_features
from envgen_usd.opendrive.reader import read
from envgen_usd.opendrive.surface import build_surface
from envgen_usd.traffic.standing.standing_actors import Candidates
from envgen_usd.traffic.standing.street_facts import StreetFacts
from envgen_usd.traffic.standing.street_life import NEAR, Street, place_actors

CHUNK = Chunk(0, 0)
Y = 100.0
"""Reference line of the street, in the middle of the chunk."""
CAR, VAN, TRUCK = (4.2, 2.14, 1.5), (5.0, 2.24, 2.0), (7.0, 2.8, 3.0)
NOBODY = PeopleRules((0.0, 0.0), {"1": 1.0}, 0.5)
LOOKS = {
    "car": (
        ActorLook("car", "car", {"body": "small"}, 2.0, np.array(CAR)),
        ActorLook("car", "car", {"body": "van"}, 1.0, np.array(VAN)),
    ),
    "pedestrian": tuple(
        ActorLook("pedestrian", "man", {"pose": pose}, 1.0, np.array([0.5, 0.6, 1.8]))
        for pose in ("standing", "sitting", "walk_0", "walk_4")
    ),
    "bicycle": (ActorLook("bicycle", "bicycle", {}, 1.0, np.array([1.8, 0.5, 1.1])),),
    "wheelie_bin": (ActorLook("wheelie_bin", "bin", {}, 1.0, np.array([0.73, 0.58, 1.07])),),
}


def full_kerbs(**changes) -> ActorRules:
    """Rules that take every place, and nothing else."""
    kerbs = {
        "streets": 1.0,
        "both": 1.0,
        "raised": 0.0,
        "occupancy": (1.0, 1.0),
        "gap": (0.6, 0.6),
        "offset": (0.2, 0.2),
        "vehicles": {"car": 1.0},
        **changes,
    }
    return rules(kerbs=KerbRules(**kerbs))


def rules(**changes) -> ActorRules:
    """Rules without actors, but for the changed tables."""
    empty = KerbRules(0.0, 0.0, 0.0, (0.0, 0.0), (1.0, 1.0), (0.2, 0.2), {"car": 1.0})
    tables = {
        "kerbs": empty,
        "bays": BayRules((0.0, 0.0), {"parallel": 1.0}, {"car": 1.0}),
        "lots": LotRules((0.0, 0.0), 0.0, {"car": 1.0}),
        "people": NOBODY,
        "kerbside": KerbObjectRules(),
        **changes,
    }
    return ActorRules(**tables)


def lane(number, kind, width, height=0.0, more=""):
    raised = f'<height sOffset="0" inner="{height}" outer="{height}"/>' if height else ""
    return (
        f'<lane id="{number}" type="{kind}"><width sOffset="0" a="{width}" b="0" c="0" d="0"/>'
        f'<roadMark sOffset="0" type="none"/>{raised}{more}</lane>'
    )


def road_text(
    left,
    right,
    *,
    rest="",
    mark="broken",
    speed=50,
    kind="town",
    rise=0.0,
    bank=0.0,
    rule="RHT",
):
    """A straight road of 160 m along +x through the chunk; lanes from the middle outwards."""
    lefts = "".join(lane(n, *each) for n, each in reversed(list(enumerate(left, 1))))
    rights = "".join(lane(-n, *each) for n, each in enumerate(right, 1))
    return f"""<OpenDRIVE><header revMajor="1" revMinor="7"/>
    <road id="1" name="" length="160" junction="-1" rule="{rule}"><link/>
    <type s="0" type="{kind}"><speed max="{speed}" unit="km/h"/></type>
    <planView><geometry s="0" x="20" y="{Y}" hdg="0" length="160"><line/></geometry></planView>
    <elevationProfile><elevation s="0" a="5" b="{rise}" c="0" d="0"/></elevationProfile>
    <lateralProfile><superelevation s="0" a="{bank}" b="0" c="0" d="0"/></lateralProfile>
    <lanes><laneSection s="0">{f"<left>{lefts}</left>" if left else ""}
    <center><lane id="0" type="none"><roadMark sOffset="0" type="{mark}" width="0.12"/></lane>
    </center>{f"<right>{rights}</right>" if right else ""}</laneSection></lanes>{rest}
    </road></OpenDRIVE>"""


EMPTY = City(())
WIDE = (("driving", 6.0), ("sidewalk", 3.0, 0.12))
"""Room for a vehicle at the kerb."""
NARROW = (("driving", 3.5), ("sidewalk", 3.0, 0.12))
"""Room only for vehicles half on the sidewalk."""


def street_of(folder, text, *, city=EMPTY, plots=(), obstacles=(), looks=LOOKS, seed=0):
    """The street of a road text in the chunk; the ground is level at 5 m."""
    path = folder / "road.xodr"
    path.write_text(text, encoding="utf-8")
    network = read(path).network
    surface = replace(build_surface(network), features=road_features(network))
    roads = RoadIndex(surface)
    corners = np.array([[0, 0, 5.0], [200, 0, 5.0], [200, 200, 5.0], [0, 200, 5.0]])
    ground = GroundMesh(CHUNK, corners, np.array([4]), np.arange(4), np.zeros(1, dtype=np.int64))
    return Street(
        CHUNK,
        StreetFacts.of(surface, network),
        roads.pieces.lanes_near(CHUNK.bounds, NEAR),
        roads.corners_near(CHUNK.bounds, NEAR),
        ground,
        city,
        obstacles,
        plots,
        looks,
        seed,
    )


def actors_of(folder, text, some_rules, **more):
    """The actors of a road text."""
    return place_actors(street_of(folder, text, **more), some_rules)[0]


def plans(actors):
    """Rectangles of actors in plan, N x 4 x 2."""
    return Candidates(
        [a.id for a in actors],
        [a.look for a in actors],
        np.array([a.position for a in actors]).reshape(-1, 3),
        np.array([a.heading for a in actors]),
        "",
    ).rectangles()


def places(actors):
    return Counter(actor.place for actor in actors)


def every_place(folder):
    """Streets, plots and furniture on which each figure of the rules decides about something."""
    park = np.array([[30.0, 112.0], [80.0, 112.0], [80.0, 160.0], [30.0, 160.0]])
    plots = tuple(
        Plot(f"p{n}", np.add(park, [70.0 * n, 0.0]), use, np.add(park[:2], [70.0 * n, 0.0]))
        for n, use in enumerate((LanduseClass.PARKING, LanduseClass.RUBBLE))
    )
    feet = {"bus_stop": (60.0, 5.6), "bicycle_rack": (120.0, 5.0)}
    furniture = [
        CityObject(
            kind,
            "CityFurniture",
            placement=Placement(np.array([x, Y - y, 5.12]), np.pi / 2, np.zeros(3), kind),
        )
        for kind, (x, y) in feet.items()
    ]
    ring = np.array([[0, 0, 0], [2.6, 0, 0], [2.6, 0, 2.2], [0, 0, 2.2]], dtype=float)
    doors = tuple(
        ThematicSurface(
            f"d{n}",
            "DoorSurface",
            Polygons.of_rings([np.add(ring, [24.0 + 6.0 * n, 171.0, 5.0])]),
            3,
        )
        for n in range(20)
    )
    wall = ThematicSurface("w", "WallSurface", doors[0].polygons, 3, openings=doors)
    city = City((*furniture, CityObject("house", "Building", surfaces=(wall,))))
    space = """<objects><object id="7" type="parkingSpace" s="50" t="-15" zOffset="0" length="30"
      width="2.5" height="0.01" hdg="0" orientation="none"/><object id="1" type="crosswalk" s="90"
      t="0" zOffset="0" length="4" width="7" height="0.01" hdg="0" orientation="none"/></objects>"""
    bays = (("driving", 3.5), ("parking", 5.2), ("sidewalk", 2.0, 0.12))
    texts = (
        road_text(NARROW, NARROW, rest=space),
        road_text(WIDE, WIDE),
        road_text(bays, bays),
    )
    kinds = {"truck": TRUCK, "bus": (12.0, 2.9, 3.1), "motorcycle": (2.0, 0.8, 1.2)}
    looks = LOOKS | {
        kind: (ActorLook(kind, kind, {}, 1.0, np.array(size)),) for kind, size in kinds.items()
    }
    streets = []
    for number, text in enumerate(texts):
        sub = folder / str(number)
        sub.mkdir(exist_ok=True)
        first = number == 0
        more = {"city": city, "plots": plots} if first else {}
        streets.append(street_of(sub, text, looks=looks, **more))
    return [replace(street, seed=seed) for street in streets for seed in range(4)]


EVERY_FIGURE = ActorRules(
    KerbRules(
        streets=0.7,
        both=0.6,
        raised=0.5,
        occupancy=(0.4, 0.6),
        gap=(0.5, 1.5),
        offset=(0.1, 0.3),
        vehicles={"car": 3.0, "truck": 2.0, "bus": 2.0, "motorcycle": 2.0},
        reversed=0.3,
    ),
    BayRules(
        occupancy=(0.4, 0.6),
        wide={"parallel": 1.0, "angled": 1.0, "perpendicular": 1.0},
        vehicles={"car": 2.0, "motorcycle": 2.0},
        nose_in=0.6,
    ),
    LotRules(
        car_parks=(0.4, 0.6),
        driveways=0.6,
        vehicles={"car": 2.0, "motorcycle": 2.0},
        yards=40.0,
        yard_vehicles={"truck": 2.0, "car": 2.0},
    ),
    PeopleRules(
        density=(4.0, 8.0),
        groups={"1": 2.0, "2": 2.0, "3": 1.0},
        walking=0.6,
        crossing=(2.0, 5.0),
        stop=(2.0, 5.0),
    ),
    KerbObjectRules(bicycles=(2.0, 5.0), bins=25.0, bin_group=(1.6, 3.4)),
)
"""Rules in which each figure decides about something in `every_place`."""
