"""Extracts of OpenStreetMap for tests, written from metres about a place in Munich."""

import numpy as np

LAT, LON = 48.0, 11.0
_METRE = 1.0 / 111_177.0
"""Degrees of latitude of a metre at 48 degrees north."""


def degrees(x, y):
    """Latitude and longitude of a place east and north of the middle, metres."""
    return LAT + y * _METRE, LON + x * _METRE / np.cos(np.radians(LAT)) * 0.9979


class Extract:
    """An extract in the making."""

    def __init__(self):
        self.nodes, self.items, self._at = [], [], {}

    def node(self, x, y, **tags):
        """Id of the node at a place; nodes at one place are one."""
        if (x, y) not in self._at:
            self._at[x, y] = len(self._at) + 1
            self.nodes.append([self._at[x, y], degrees(x, y), {}])
        number = self._at[x, y]
        self.nodes[number - 1][2].update(tags)
        return number

    def way(self, *places, **tags):
        """Adds a way through places."""
        refs = "".join(f'<nd ref="{self.node(*place)}"/>' for place in places)
        self.items.append(f'<way id="{len(self.items) + 1000}">{refs}{_tags(tags)}</way>')
        return len(self.items) + 999

    def relation(self, members, **tags):
        """Adds a relation of (type, id, role)."""
        inner = "".join(f'<member type="{t}" ref="{r}" role="{role}"/>' for t, r, role in members)
        self.items.append(
            f'<relation id="{len(self.items) + 1000}">{inner}{_tags(tags)}</relation>'
        )

    def text(self):
        """The file."""
        nodes = "".join(
            f'<node id="{n}" lat="{lat:.8f}" lon="{lon:.8f}">{_tags(tags)}</node>'
            for n, (lat, lon), tags in self.nodes
        )
        return f'<osm version="0.6">{nodes}{"".join(self.items)}</osm>'

    def write(self, path):
        """Writes the file and returns its path."""
        path.write_text(self.text())
        return path


def _tags(tags):
    return "".join(f'<tag k="{k.replace("__", ":")}" v="{v}"/>' for k, v in tags.items())


def crossing(reach=100.0, **tags):
    """Four streets that meet at a right angle."""
    extract = Extract()
    tags = {"highway": "residential", "sidewalk": "both", **tags}
    extract.way((-reach, 0.0), (0.0, 0.0), (reach, 0.0), **tags)
    extract.way((0.0, -reach), (0.0, 0.0), (0.0, reach), **tags)
    return extract
