"""The built-in hand as a rig: layout, implicit surface, triangulation and skeleton."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.geometry.rotations import unit
from warpjld.geometry.surface import Part, Surface
from warpjld.rig import Rig
from warpjld.skeleton import DIGITS, PALM_SEGMENTS, Skeleton, default_limits, hand_joint_names
from warpjld.skeleton.hand import FINGER_JOINTS, HAND_PARENTS
from warpjld.skeleton.recognise.tree import SourceTree
from warpjld.suggest import one_of

if TYPE_CHECKING:
    from warpjld.hand.plan import Plan

__all__ = ["build_hand", "hand_rig"]

Array = NDArray[np.float64]

_MILLIMETRE = 1e-3  # in metres; the design is in millimetres
_ACROSS = np.array([1.0, 0.0, 0.0])


def build_hand(
    side: str = "left",
    *,
    length: float = 0.19,
    breadth: float = 0.085,
    proportions: Mapping[str, float | tuple[float, float]] | None = None,
    resolution: int = 8000,
) -> Rig:
    """A closed, smooth hand with a stub of forearm, its skeleton exactly placed (R7, R13).

    The hand lies palm down, dorsal side +Y, fingers along -Z, the wrist's crease at z = 0.

    Args:
        side: "left" or "right"; the right hand is the left one's mirror image, vertex for vertex.
        length: From the wrist's crease to the tip of the middle finger [m].
        breadth: Across the palm at the heads of the metacarpals, without the thumb [m].
        proportions: Digit → scale of its length, or (scale of its length, scale of its thickness). Length and
            breadth of the hand do not change by it.
        resolution: Approximate number of vertices.

    Returns:
        The rig: 26 joints, root ``SIDE.forearm``.

    Raises:
        InputError: An unknown side or digit, or a measure out of range.

    Examples:
        >>> wj.build_hand("left", resolution=1500)
        Rig('left hand': 26 joints, ... vertices, ... triangles)
    """
    # imported here: SciPy's splines take as long to import as a stored hand takes to be read
    from warpjld.hand.fit import fit_plan
    from warpjld.hand.flesh import PlannedFlesh
    from warpjld.hand.triangulate import triangulate

    _check(side, length, breadth, resolution)
    flesh = PlannedFlesh(fit_plan(length / _MILLIMETRE, breadth / _MILLIMETRE, _scales(proportions)))
    vertices, faces = triangulate(flesh, resolution)
    skeleton = _skeleton(flesh.plan)
    if side == "right":
        vertices, faces, skeleton = vertices * (-1.0, 1.0, 1.0), faces[:, ::-1], _mirrored(skeleton)
    return hand_rig(side, skeleton, vertices * _MILLIMETRE, np.ascontiguousarray(faces, dtype=np.int32))


def hand_rig(side: str, skeleton: Skeleton, vertices: Array, faces: NDArray[np.int32]) -> Rig:
    """The rig of a built hand's skeleton and surface [m]."""
    return Rig(
        name=f"{side} hand",
        skeleton=skeleton,
        surface=_surface(vertices, faces),
        source=_source(skeleton),
        sources=tuple(range(len(skeleton))),
        owner=np.arange(len(skeleton)),
    )


def _source(skeleton: Skeleton) -> SourceTree:
    """The skeleton's joints as a source tree, with unrotated frames."""
    frames = np.tile(np.eye(4), (len(skeleton), 1, 1))
    frames[:, :3, 3] = skeleton.rest
    return SourceTree(skeleton.names, skeleton.parents.astype(np.int64), frames)


def _check(side: str, length: float, breadth: float, resolution: int) -> None:
    """Raise InputError for arguments of ``build_hand`` that are out of range."""
    if side not in ("left", "right"):
        raise InputError(f"side: want 'left' or 'right', got {side!r}")
    if not 0.05 <= length <= 0.30:
        raise InputError(f"length: want metres, between 0.05 and 0.30, got {length!r}")
    low, high = 0.32 * length, 0.62 * length
    if not low <= breadth <= high:
        raise InputError(f"breadth: want metres, {low:.3f}…{high:.3f} for this length, got {breadth!r}")
    if not 1_500 <= resolution <= 20_000_000:
        raise InputError(f"resolution: want a number of vertices between 1500 and 20 million, got {resolution!r}")


def _scales(proportions: Mapping[str, float | tuple[float, float]] | None) -> dict[str, tuple[float, float]]:
    """Checked scales of length and thickness by digit."""
    out = {}
    for digit, scale in (proportions or {}).items():
        if digit not in DIGITS:
            raise InputError(f"proportions: no digit '{digit}'{one_of(digit, DIGITS)}")
        long, thick = scale if isinstance(scale, tuple) else (scale, 1.0)
        if not (0.5 <= long <= 1.5 and 0.7 <= thick <= 1.3):
            raise InputError(
                f"proportions of '{digit}': want a length of 0.5…1.5 and a thickness of 0.7…1.3, got {scale!r}"
            )
        out[digit] = (float(long), float(thick))
    return out


def _surface(vertices: Array, faces: NDArray[np.int32]) -> Surface:
    """The surface without welding, since no two vertices coincide."""
    whole = Part("hand", slice(0, len(vertices)), slice(0, len(faces)))
    return Surface(vertices, faces, np.arange(len(vertices), dtype=np.int32), faces, parts=(whole,))


def _skeleton(plan: Plan) -> Skeleton:
    """Skeleton [m] of a left hand at the joints of its plan."""
    names = ("left.forearm", *hand_joint_names("left"))
    parents = [-1] + [0 if up is None else names.index(f"left.{up}") for up in HAND_PARENTS.values()]
    rest, axes = np.empty((len(names), 3)), np.tile(-_ACROSS, (len(names), 1))
    place = {name: j for j, name in enumerate(names)}
    rest[place["left.forearm"]], rest[place["left.wrist"]] = plan.forearm, plan.wrist
    for digit, point in plan.carpometacarpal.items():
        j = place[f"left.{digit}.carpometacarpal"]
        rest[j] = point
        along = plan.digits[digit].joints[0] - point
        axes[j] = unit(np.cross(plan.digits[digit].dorsal[0], along))
    for digit, parts in plan.digits.items():
        for k, joint in enumerate(FINGER_JOINTS):
            j = place[f"left.{digit}.{joint}"]
            rest[j] = parts.joints[k]
            bone = parts.joints[min(k + 1, 3)] - parts.joints[min(k, 2)]
            axes[j] = unit(np.cross(parts.dorsal[k], bone))
    palms = tuple((place[f"left.{a}"], place[f"left.{b}"]) for a, b in PALM_SEGMENTS)
    return Skeleton(names, np.array(parents, dtype=np.int32), rest * _MILLIMETRE, axes, default_limits(names), (palms,))


def _mirrored(left: Skeleton) -> Skeleton:
    names = tuple(name.replace("left.", "right.") for name in left.names)
    flip = np.array([-1.0, 1.0, 1.0])
    axes = -left.axes * flip  # an axis of rotation mirrors with the opposite sign
    return Skeleton(names, left.parents, left.rest * flip, axes, default_limits(names), left.palms)
