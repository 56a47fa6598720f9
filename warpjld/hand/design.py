"""Measures of the built-in hand: positions and sizes of its joints, digits and muscles.

Millimetres on a left hand 190 mm long and 85 mm broad, palm down, as (radial, dorsal, distal) from the wrist.
"""

from __future__ import annotations

from dataclasses import dataclass

__all__ = [
    "BREADTH",
    "CARPOMETACARPAL",
    "FINGER_DESIGNS",
    "FINGER_PROFILE",
    "FOREARM",
    "LENGTH",
    "MUSCLES",
    "REST_FLEXION",
    "THUMB_ABDUCTION",
    "THUMB_BASE",
    "THUMB_DEPTH",
    "THUMB_HALF_WIDTH",
    "THUMB_LENGTHS",
    "THUMB_PROFILE",
    "THUMB_ROLL",
    "WRIST",
    "Finger",
    "Muscle",
    "Point",
]  # fmt: skip

Point = tuple[float, float, float]

LENGTH, BREADTH = 190.0, 85.0  # mm, of the design hand

FOREARM, WRIST = (0.27, 0.28, -44.0), (-0.1, -0.16, 0.0)  # at their sections' centroids
CARPOMETACARPAL = {
    "index": (12.0, 2.0, 29.0),
    "middle": (2.0, 3.0, 29.5),
    "ring": (-8.0, 2.0, 29.0),
    "pinky": (-17.5, -0.5, 27.0),
}


@dataclass(frozen=True)
class Finger:
    """Measures of a finger.

    Attributes:
        base: Position of its base joint [mm].
        lengths: Lengths of its phalanges, the last one to the skin [mm].
        half_width: Half-width at knuckle 2 [mm].
        splay: Angle of its axis towards the radial side [degrees].
        roll: Lean of its nail towards the radial side [degrees].
    """

    base: Point
    lengths: Point
    half_width: float
    splay: float
    roll: float


@dataclass(frozen=True)
class Muscle:
    """A spindle of flesh between two points [mm]; ``profile`` has rows of axial fraction, half-width, palmar and dorsal
    half-height."""

    start: Point
    end: Point
    profile: tuple[tuple[float, float, float, float], ...]


FINGER_DESIGNS = {
    "index": Finger((26.3, 0.0, 85.0), (43.0, 25.5, 24.0), 9.4, 6.0, 6.0),
    "middle": Finger((4.0, 1.5, 87.0), (46.5, 30.0, 26.5), 9.5, 0.5, 0.0),
    "ring": Finger((-17.3, 0.0, 80.5), (43.5, 28.5, 25.0), 8.9, -5.5, -6.0),
    "pinky": Finger((-36.3, -3.5, 71.5), (35.0, 21.5, 22.0), 7.8, -13.0, -13.0),
}
REST_FLEXION = (5.0, 8.0, 5.0)  # degrees of flexion at base, knuckle 2, knuckle 3

# rows of joint, fraction of the segment after it, half-width, dorsal and palmar half-height; the last three in units of
# the half-width at knuckle 2
FINGER_PROFILE = (
    (-1, 0.0, 0.78, 0.70, 0.80),
    (0, 0.0, 1.02, 1.02, 1.04),
    (0, 0.28, 1.05, 0.92, 1.10),
    (0, 0.62, 0.95, 0.83, 1.04),
    (1, 0.0, 1.00, 0.92, 0.88),
    (1, 0.5, 0.88, 0.77, 0.92),
    (2, 0.0, 0.87, 0.73, 0.78),
    (2, 0.35, 0.84, 0.62, 0.85),
    (2, 0.7, 0.78, 0.52, 0.79),
    (2, 1.0, 0.67, 0.44, 0.61),
)

THUMB_BASE = (22.0, -8.0, 22.0)  # mm, position of its carpometacarpal joint
THUMB_LENGTHS = (43.0, 32.0, 27.5)  # mm, lengths of the thumb's bones
THUMB_HALF_WIDTH = 10.4  # mm, at knuckle 3
THUMB_ABDUCTION = (42.0, 43.0, 49.0)  # degrees of the three segments from the hand's axis in the dorsal view
THUMB_DEPTH = (25.0, 18.0, 12.0)  # degrees of the three segments towards the palm
THUMB_ROLL = 65.0  # degrees about its own axis
THUMB_PROFILE = (
    (-1, 0.0, 0.85, 0.75, 0.80),
    (0, 0.0, 1.20, 1.05, 1.25),
    (0, 0.5, 1.22, 1.05, 1.35),
    (1, 0.0, 1.16, 1.14, 1.14),
    (1, 0.5, 0.96, 0.84, 1.00),
    (2, 0.0, 1.00, 0.90, 0.88),
    (2, 0.38, 1.04, 0.72, 0.92),
    (2, 0.7, 0.98, 0.58, 0.86),
    (2, 1.0, 0.84, 0.46, 0.64),
)

# flesh in addition to that around the bones
MUSCLES = (
    Muscle(  # thenar eminence
        (10.0, -9.0, 8.0),
        (48.0, -24.0, 54.0),
        ((0.0, 9.0, 8.0, 8.0), (0.35, 14.0, 12.5, 10.0), (0.7, 13.0, 11.0, 10.0), (1.0, 9.0, 8.0, 8.0)),
    ),
    Muscle(  # first dorsal interosseous
        (17.0, -1.0, 24.0),
        (33.0, -6.0, 66.0),
        ((0.0, 9.0, 8.0, 9.0), (0.4, 13.0, 8.0, 9.0), (0.75, 11.0, 7.0, 8.0), (1.0, 7.0, 6.0, 7.0)),
    ),
    Muscle(  # fold of skin between thumb and index
        (24.0, -2.0, 58.0),
        (44.0, -18.0, 44.0),
        ((0.0, 17.0, 7.0, 7.0), (0.5, 15.0, 7.0, 8.0), (1.0, 16.0, 8.0, 8.0)),
    ),
)
