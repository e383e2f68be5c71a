"""Traffic signs of a map (wiki.openstreetmap.org/wiki/Key:traffic_sign)."""

import re
from collections.abc import Mapping

_NAMED: Mapping[str, str] = {
    "city_limit": "DE:310",
    "maxspeed": "DE:274",
    "stop": "DE:206",
    "give_way": "DE:205",
    "yield": "DE:205",
    "overtaking": "DE:276",
    "no_overtaking": "DE:276",
    "maxweight": "DE:262",
    "maxheight": "DE:265",
    "maxwidth": "DE:264",
    "hazard": "DE:101",
    "priority_road": "DE:306",
    "roundabout": "DE:215",
}
"""Human-readable values with the German sign of the same meaning."""
_CODE = re.compile(r"(?:([A-Za-z]{2}):)?([0-9][\w.\-]*)(?:[\[:]([0-9.]+)\]?)?$")
_PANELS = re.compile(r"1[0-9]{3}(?:-|$)")
"""Numbers of panels below a sign (VzKat 1000 to 1063), which are no signs."""


def sign_codes(tags: Mapping[str, str]) -> list[str]:
    """Codes of the signs at a node, e.g. ``DE:274-50``; of a sign with panels, without these."""
    codes = []
    for said in re.split(r"[;,]", tags.get("traffic_sign", "")):
        value = said.strip()
        named = _NAMED.get(value, value)
        found = _CODE.match(named)
        if not found or _PANELS.match(found[2]):
            continue
        number = found[3] or (tags.get("maxspeed", "") if value == "maxspeed" else "")
        own = f"-{number}" if number.isdigit() else ""
        codes.append(f"{(found[1] or 'DE').upper()}:{found[2]}{own}")
    return codes
