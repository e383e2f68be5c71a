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
from envgen_usd.models.city_model import City
from envgen_usd.models.ground import GroundMesh
from envgen_usd.models.parked_actors import ActorLook
from envgen_usd.opendrive.features.road_features import road_features
from envgen_usd.opendrive.reader import read
from envgen_usd.opendrive.surface import build_surface
from envgen_usd.traffic.standing_actors import Candidates
from envgen_usd.traffic.street_facts import StreetFacts
from envgen_usd.traffic.street_life import NEAR, Street, place_actors

CHUNK = Chunk(0, 0)
Y = 100.0
"""Reference line of the street, in the middle of the chunk."""
CAR, VAN, TRUCK = (4.2, 2.14, 1.5), (5.0, 2.24, 2.0), (7.0, 2.8, 3.0)
NOBODY = PeopleRules((0.0, 0.0), (1.0,), 0.5)
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
