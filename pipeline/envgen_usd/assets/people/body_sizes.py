"""Sizes of people: shares of the stature, and the figures of the library.

Lengths of segments: R. Drillis and R. Contini 1966, "Body segment parameters", as shares of the
stature; breadths and girths are chosen about the 50th percentiles of DIN 33402-2 (adults 18 to 65:
stature 1.625 m of women, 1.75 m of men; measures as ISO 7250-1 defines them).
"""

from dataclasses import dataclass

ANKLE, THIGH, SHANK = 0.039, 0.245, 0.246
"""Height of the ankle; hip to knee; knee to ankle."""
HIP = ANKLE + THIGH + SHANK
"""Height of the hip joints."""
UPPER_ARM, FOREARM, HAND = 0.183, 0.146, 0.105
"""Shoulder to elbow; elbow to wrist; wrist to the tips of the fingers."""
SHOULDER, NECK, HEAD = 0.796, 0.852, 0.925
"""Heights of shoulder joints, root of the neck, and middle of the head."""
WAIST = 0.610
"""Height at which the trunk bends."""
FOOT = 0.152
"""Length of the bare foot."""
REFERENCE = 1.75
"""Stature for which girths are given, metres."""


@dataclass(frozen=True)
class Build:
    """The build of a person.

    Attributes:
        stature: Height without shoes, metres.
        breadth: Factor of the widths of the trunk.
        depth: Factor of the depths of the trunk.
        limbs: Factor of the girths of arms and legs.
        shoulders: Half the distance of the shoulder joints, metres for `REFERENCE`.
        hips: Half the breadth of the hips, metres for `REFERENCE`.
        waist: Half the breadth of the waist, metres for `REFERENCE`.
        bust: Depth of the bust in front of the spine, metres for `REFERENCE`.
        belly: Depth of the belly in front of the spine, metres for `REFERENCE`.
        head: Size of the head, 1 for an adult man's.
        stoop: Bend of the back forwards, degrees.
        vigour: Factor of the angles of the walk.
    """

    stature: float
    breadth: float = 1.0
    depth: float = 1.0
    limbs: float = 1.0
    shoulders: float = 0.182
    hips: float = 0.170
    waist: float = 0.150
    bust: float = 0.128
    belly: float = 0.112
    head: float = 1.0
    stoop: float = 0.0
    vigour: float = 1.0

    @property
    def scale(self) -> float:
        """Factor of girths: they grow with the stature."""
        return self.stature / REFERENCE


def woman(stature: float, **changed: float) -> Build:
    """A woman's build: narrower shoulders and waist, wider hips."""
    usual = {
        "shoulders": 0.166, "hips": 0.180, "waist": 0.138, "bust": 0.142, "belly": 0.104,
        "limbs": 0.92, "head": 0.96,
    }  # fmt: skip
    return Build(stature, **{**usual, **changed})


def man(stature: float, **changed: float) -> Build:
    """A man's build."""
    return Build(stature, **changed)


def child(stature: float, **changed: float) -> Build:
    """A child's build: a large head, no waist, thin limbs for its breadth."""
    usual = {
        "shoulders": 0.165, "hips": 0.155, "waist": 0.150, "bust": 0.118, "belly": 0.122,
        "limbs": 0.98, "head": 0.91, "breadth": 1.05, "depth": 1.1,
    }  # fmt: skip
    return Build(stature, **{**usual, **changed})
