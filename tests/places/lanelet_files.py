"""Small Lanelet2 maps that tests write: nodes in metres, bounds, lanelets, regulatory elements."""

from dataclasses import dataclass, field
from xml.sax.saxutils import quoteattr

import numpy as np
from pyproj import Transformer

UTM = Transformer.from_crs(32632, 4326, always_xy=True)


@dataclass
class LaneletWriter:
    """Collects elements of a map; coordinates are `local_x`, `local_y` and `ele`.

    Attributes:
        local: False writes latitudes and longitudes of UTM zone 32 instead.
        bounds: Id of each way to its points, N x 3.
    """

    local: bool = True
    bounds: dict = field(default_factory=dict)
    _nodes: dict = field(default_factory=dict)
    _text: list = field(default_factory=list)
    _next: int = 100

    def _id(self):
        self._next += 1
        return self._next

    def node(self, x, y, z=0.0):
        key = (round(x, 3), round(y, 3), round(z, 3))
        if key not in self._nodes:
            self._nodes[key] = self._id()
        return self._nodes[key]

    def way(self, points, kind="line_thin", subtype="solid", **tags):
        points = np.array(points, float)
        if points.shape[1] == 2:
            points = np.column_stack([points, np.zeros(len(points))])
        number = self._id()
        self.bounds[number] = points
        refs = "".join(f'<nd ref="{self.node(*p)}"/>' for p in points)
        self._text.append(
            f'<way id="{number}">{refs}{_tags(type=kind, subtype=subtype, **tags)}</way>'
        )
        return number

    def lanelet(self, left, right, rules=(), **tags):
        number = self._id()
        members = f'<member type="way" ref="{left}" role="left"/>'
        members += f'<member type="way" ref="{right}" role="right"/>'
        for rule in rules:
            members += f'<member type="relation" ref="{rule}" role="regulatory_element"/>'
        tags = {"type": "lanelet", "subtype": "road", **tags}
        self._text.append(f'<relation id="{number}">{members}{_tags(**tags)}</relation>')
        return number

    def rule(self, subtype, refers=(), stops=(), **tags):
        number = self._id()
        members = "".join(f'<member type="way" ref="{n}" role="refers"/>' for n in refers)
        members += "".join(f'<member type="way" ref="{n}" role="ref_line"/>' for n in stops)
        tags = {"type": "regulatory_element", "subtype": subtype, **tags}
        self._text.append(f'<relation id="{number}">{members}{_tags(**tags)}</relation>')
        return number

    def raw(self, text):
        self._text.append(text)

    def write(self, path):
        nodes = "".join(self._node(number, key) for key, number in self._nodes.items())
        path.write_text(
            f'<?xml version="1.0"?><osm version="0.6">{nodes}{"".join(self._text)}</osm>'
        )
        return path

    def _node(self, number, key):
        x, y, z = key
        if self.local:
            tags = _tags(local_x=x, local_y=y, ele=z)
            return f'<node id="{number}" lat="" lon="">{tags}</node>'
        lon, lat = UTM.transform(x + 455_000.0, y + 5_428_000.0)
        return f'<node id="{number}" lat="{lat:.12f}" lon="{lon:.12f}">{_tags(ele=z)}</node>'


def _tags(**tags):
    return "".join(f"<tag k={quoteattr(k)} v={quoteattr(str(v))}/>" for k, v in tags.items())


def two_lanes(**options):
    """A straight road of 60 m with a lane each way, a kerb and a sidewalk on its right."""
    file = LaneletWriter(**options)
    x = np.linspace(0.0, 60.0, 7)

    def line(y, *kind):
        return file.way(np.column_stack([x, np.full(7, y)]), *kind)

    left, middle = line(3.5, "road_border", ""), line(0.0, "line_thin", "dashed")
    kerb, outer = line(-3.5, "curbstone", "high"), line(-5.5, "virtual", "")
    file.lanelet(middle, kerb, speed_limit="30 km/h")
    file.lanelet(middle, left)
    file.lanelet(kerb, outer, subtype="walkway")
    return file


def bend(radius=30.0, step=0.07, climb=0.0):
    """Two lanes in a quarter of a circle to the left, whose width grows from 3 to 4 m."""
    file = LaneletWriter()
    angle = np.append(np.arange(0.0, np.pi / 2, step), np.pi / 2)

    def line(offset, *kind):
        r = radius + offset * (3.0 + angle / (np.pi / 2))
        z = climb * angle
        return file.way(np.column_stack([r * np.sin(angle), -r * np.cos(angle), z]), *kind)

    left, middle = line(-1.0, "line_thick", "solid"), line(0.0, "line_thin", "dashed")
    right = line(1.0, "line_thick", "solid")
    file.lanelet(left, middle)
    file.lanelet(middle, right)
    return file


def crossing(skew=0.0):
    """Four arms of two lanes each with all straight ways and right turns, and a light.

    Args:
        skew: Metres by which the ends of the arms are slanted.
    """
    file = LaneletWriter()
    near, far, wide = 10.0, 60.0, 3.5

    def turned(points, quarter):
        angle = quarter * np.pi / 2
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        return np.array(points) @ turn.T

    ends = {}
    for q in range(4):
        # The arm leads away to the east before it is turned.
        at = {y: near + skew * y / wide for y in (-wide, 0.0, wide)}
        arm = {}
        for y, kind in ((-wide, "road_border"), (0.0, "line_thin"), (wide, "road_border")):
            points = turned([[at[y], y], [0.5 * (near + far), y], [far, y]], q)
            arm[y] = file.way(points, kind, "solid")
        stop = file.way(
            turned([[at[0.0] + 1, 0.1], [at[wide] + 1, wide - 0.1]], q), "stop_line", ""
        )
        light = turned([[at[wide] + 1, wide + 0.8], [at[wide] + 1, wide + 1.2]], q)
        light = np.column_stack([light, [3.5, 3.5]])
        lamp = file.way(light, "traffic_light", "red_yellow_green")
        rule = file.rule("traffic_light", [lamp], [stop])
        file.lanelet(arm[0.0], arm[-wide])
        file.lanelet(arm[0.0], arm[wide], rules=[rule])
        ends[q] = {y: turned([[at[y], y]], q)[0] for y in at}
    for q in range(4):
        _connect(file, ends[q], ends[(q + 2) % 4], wide, 0.0)
        _connect(file, ends[q], ends[(q + 1) % 4], wide, 0.55)
    return file


def _connect(file, first, last, wide, bulge):
    """A lanelet from the entering lane of an arm to the leaving lane of another."""
    bounds = []
    # Entering traffic runs against the arm: its left bound is the middle of the road.
    for a, b in ((first[0.0], last[0.0]), (first[wide], last[-wide])):
        share = np.linspace(0.0, 1.0, 9)[:, None]
        corner = (1 - bulge) * (a + b) / 2
        points = (1 - share) ** 2 * a + 2 * share * (1 - share) * corner + share**2 * b
        bounds.append(file.way(points, "virtual", ""))
    file.lanelet(*bounds)


def roundabout(radius=8.0):
    """A ring of four quarters with entries to the first three and exits before the last two."""
    file = LaneletWriter()
    radii = radius - 2.0, radius + 2.0

    def quarter(r, q):
        angle = np.pi / 2 * (q + np.linspace(0.0, 1.0, 13))
        return np.column_stack([r * np.cos(angle), r * np.sin(angle)])

    def straight(q, way, near, far):
        # Along the tangent at the begin of a quarter, between two distances from it.
        angle = np.pi / 2 * q
        middle, tangent = (np.cos(angle), np.sin(angle)), (-np.sin(angle), np.cos(angle))
        away = way * np.linspace(near, far, 4)
        file.lanelet(*(file.way(r * np.array(middle) + np.outer(away, tangent)) for r in radii))

    for q in range(4):
        file.lanelet(*(file.way(quarter(r, q)) for r in radii))
    for q, way in ((0, -1.0), (1, -1.0), (2, -1.0), (2, 1.0), (3, 1.0)):
        straight(q, way, 0.0, 15.0)
        straight(q, way, 15.0, 30.0)
    return file
