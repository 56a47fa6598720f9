"""Rest pose for retargeting: the recording's own, or a frame of the motion where that one is arbitrary.

Several mocap systems write every OFFSET along the bone's own X, or no OFFSETs at all and a position for every joint:
such a rest is no pose of a body. Bone directions in the *frames* are valid in any case, so the frame closest to upright
standing replaces it, rotated so that the body stands upright and faces the file's front; its lean and heading stay in
the motion. A valid rest pose may have another up axis than the frames, if a root rotation converts between them; the
floor distinguishes this from a person who lies down.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from warpjld.geometry.rotations import minimal_rotation, rotate, slerp, unit
from warpjld.motion.clip import Clip
from warpjld.motion.landmarks import Landmarks, landmarks_of_clip
from warpjld.runtime.lazily import lazy_module

if TYPE_CHECKING:
    import scipy.spatial.transform as transform
else:
    transform = lazy_module("scipy.spatial.transform")

__all__ = ["turn_of_rest", "with_usable_rest"]

_OFF = 10.0
"""Largest median deviation [°] of bone directions in the frames from the rest's, carried by the rotations."""

_LEAN = 10.0
"""Angle [°] to the vertical up to which a trunk counts as upright: the spines of models are tilted, too."""

_AS_GOOD = 10.0
"""Score [°] above that of the best frame at which an earlier frame is preferred."""

_MOSTLY = 0.8
"""Length of the mean of a figure's unit feet-to-head vectors above which its orientation counts as constant."""

_FLOOR = 0.08
"""Tolerance of the floor's height, per size of the figure."""

_BEHIND = 0.3
"""Distance of the toes behind the shin, per length of the foot, at which a foot points backwards."""

_AXES = ("x", "y", "z")
_SIDEWAYS = 0.2
"""Smallest relative length of the horizontal part of a line across the body that gives a direction."""


def with_usable_rest(clip: Clip, *, side: str | None = None) -> tuple[Clip, Landmarks, tuple[str, ...]]:
    """A recording with a usable rest pose, its landmarks, and notes on what was replaced."""
    marks = _sided_landmarks(clip, side)
    ways = _ways_of_frames(marks, clip)
    if ways is None:
        return clip, marks, marks.notes
    why = _arbitrary(clip, marks)
    if why:
        up, lies = _up(clip, ways)
        frame = _most_like_standing(marks, clip, up)
        clip = clip.rebased(frame, _turns(marks, clip[frame : frame + 1].positions[0], up))
        notes = (f"the motion's rest says nothing of the body ({why}): its frame {frame} is taken as the rest",)
        marks = _sided_landmarks(clip, side)
        return clip, marks, (*marks.notes, *notes, *lies)
    turn, turned = turn_of_rest(clip, marks)
    if turn is None:
        return clip, marks, (*marks.notes, *turned)
    clip = clip.turned_rest(turn)
    marks = _sided_landmarks(clip, side)
    return clip, marks, (*marks.notes, *turned)


def _sided_landmarks(clip: Clip, side: str | None) -> Landmarks:
    """Landmarks of a recording; left and right are exchanged if its feet would point backwards.

    This occurs in files that a program mirrored: with the sides of the names, knees would bend backwards.
    """
    marks = landmarks_of_clip(clip, side=side)
    if not _feet_behind(marks, clip):
        return marks
    other = {"left": "right", "right": "left"}
    joints = {".".join([other.get(p, p) for p in name.split(".")]): joint for name, joint in marks.joints.items()}
    doubt = "in the recording, feet point backwards where left and right are what its names say: they are exchanged"
    return replace(marks, joints=joints, doubts=(*marks.doubts, doubt))


def _feet_behind(marks: Landmarks, clip: Clip) -> bool:
    """Whether feet point backwards relative to the pelvis, on average over all frames."""
    for side in ("left", "right"):
        toes = (f"{side}.ball", f"{side}.toe3.base", f"{side}.toe1.base")
        toe = next((marks.joints[name] for name in toes if name in marks.joints), None)
        knee, ankle = marks.joints.get(f"{side}.knee"), marks.joints.get(f"{side}.ankle")
        if marks.across("hip", marks.rest) is None or toe is None or knee is None or ankle is None:
            return False
        joints = toe, knee, ankle
        if clip.each(lambda some, joints=joints: _forward(marks, some.positions, *joints)).mean() >= -_BEHIND:  # type: ignore[misc]
            return False
    return True


def _forward(marks: Landmarks, places: NDArray[np.float64], toe: int, knee: int, ankle: int) -> NDArray[np.float64]:
    """Forward component of a foot's direction, -1 to 1, shape (F,)."""
    across = marks.across("hip", places)
    assert across is not None
    front = np.cross(unit(across), unit(places[:, knee] - places[:, ankle]))
    return np.asarray((unit(places[:, toe] - places[:, ankle]) * front).sum(-1))


def _ways_of_frames(marks: Landmarks, clip: Clip) -> NDArray[np.float64] | None:
    """``_ways`` of all frames of a recording, shape (F, 3)."""
    if _ways(marks, marks.rest) is None:
        return None
    return clip.each(lambda some: np.asarray(_ways(marks, some.positions)))


def _ways(marks: Landmarks, places: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """Unit vectors from feet (or knees, or pelvis) to head (or chest), of positions of shape (…, J, 3)."""
    for part in ("ankle", "knee"):
        if marks.joints.keys() >= {f"left.{part}", f"right.{part}"}:
            low = places[..., [marks.joints[f"left.{part}"], marks.joints[f"right.{part}"]], :].mean(axis=-2)
            top = next((j for j in (marks.joints.get("head"), marks.chest, marks.pelvis) if j is not None), None)
            return None if top is None else unit(places[..., top, :] - low)
    trunk = marks.trunk(places)
    return None if trunk is None else unit(trunk)


def _arbitrary(clip: Clip, marks: Landmarks) -> str:
    """Why a rest is no pose of a body, for the user; "" if it is one."""
    thighs, arms = marks.segment("hip", "knee", marks.rest), marks.segment("shoulder", "elbow", marks.rest)
    trunk = marks.trunk(marks.rest)
    for limbs in (thighs, arms):
        if limbs is not None and not np.linalg.norm(limbs, axis=-1).all():
            return "its bones have no length"
    if trunk is not None and not np.linalg.norm(trunk):
        return "its bones have no length"
    if _inconsistent(clip, marks):
        return "the joints of the frames are placed otherwise"
    if thighs is not None:
        if _degrees(thighs[0], thighs[1]) > 120.0:
            return "its legs point apart"
        if trunk is not None and _degrees(thighs.sum(axis=0), trunk) < 60.0:
            return "its legs and its trunk point the same way"
    across = next((a for p in ("hip", "shoulder") if (a := marks.across(p, marks.rest)) is not None and a.any()), None)
    if arms is not None and across is not None:
        left = unit(across)
        mirrored = arms[1] - 2.0 * left * (left @ arms[1])
        if _degrees(arms[0], mirrored) > 60.0:
            return "its arms are not on both sides"
        if trunk is not None and thighs is None and _degrees(arms.sum(axis=0), trunk) < 3.0:
            return "its arms and its trunk point the same way"
    return ""


def _inconsistent(clip: Clip, marks: Landmarks) -> bool:
    """Whether most limb bones deviate in the frames from the rest's directions carried by the rotations."""
    ends = {
        (int(marks.parents[j]), j)
        for part in ("elbow", "wrist", "knee", "ankle")
        for side in ("left", "right")
        if (j := marks.joints.get(f"{side}.{part}", -1)) >= 0 and marks.parents[j] >= 0
    }
    off = clip.each(
        lambda some: np.concatenate(
            [np.zeros(0), *(_apart(some, a, b, marks.rest[b] - marks.rest[a]) for a, b in sorted(ends))]
        )
    )
    return bool(len(off)) and float(np.median(off)) > _OFF


def _apart(clip: Clip, parent: int, child: int, bone: NDArray[np.float64]) -> NDArray[np.float64]:
    """Angles [°] between a bone in the frames and the rest's bone carried by the rotations, where both have lengths."""
    wanted = clip.positions[:, child] - clip.positions[:, parent]
    given = rotate(clip.rotations[:, parent], bone)
    known = (np.linalg.norm(wanted, axis=1) > 0.0) & (np.linalg.norm(given, axis=1) > 0.0)
    return _degrees(wanted[known], given[known])


def _most_like_standing(marks: Landmarks, clip: Clip, up: NDArray[np.float64]) -> int:
    """First frame whose score is nearly the best one."""
    score = clip.each(lambda some: _stance(marks, some.positions, up))
    return int(np.argmax(score <= score.min() + _AS_GOOD))


def _stance(marks: Landmarks, places: NDArray[np.float64], up: NDArray[np.float64]) -> NDArray[np.float64]:
    """Deviation [°] from standing, shape (F,): straight, upright trunk and legs, and symmetric arms."""
    score = np.zeros(len(places))
    trunk = marks.trunk(places)
    if trunk is not None:
        score += _degrees(trunk, up)
    for chain, share in ((("hip", "knee", "ankle"), 1.0), (("shoulder", "elbow", "wrist"), 0.5)):
        upper, lower = marks.segment(*chain[:2], places), marks.segment(*chain[1:], places)
        if upper is not None and chain[0] == "hip":
            score += _degrees(-upper.sum(axis=0), up)
        if upper is not None and lower is not None:
            score += share * _degrees(upper, lower).sum(axis=0)
        across = marks.across(chain[0], places)
        if upper is not None and across is not None:
            left = unit(across)
            mirrored = upper[1] - 2.0 * left * (left * upper[1]).sum(-1, keepdims=True)
            score += share * _degrees(upper[0], mirrored)
    return score


def _turns(marks: Landmarks, places: NDArray[np.float64], up: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rotation of every bone from upright standing, facing the front, to a pose, shape (B, 4)."""
    trunk = marks.trunk(places)
    rises = up if trunk is None or _degrees(trunk, up) < _LEAN else unit(trunk)
    lines = [marks.across(part, places) for part in ("hip", "shoulder")]
    frames = [None if line is None else _frame(line, rises) for line in lines]
    known = next((frame for frame in frames if frame is not None), None)
    if known is None:
        return np.tile([0.0, 0.0, 0.0, 1.0], (len(places), 1))
    upright = _standing(up, known)
    ends = np.array([transform.Rotation.from_matrix((known if f is None else f) @ upright.T).as_quat() for f in frames])
    pelvis, chest = marks.pelvis, marks.chest
    spine = () if pelvis is None or chest is None else marks.path(pelvis, chest)
    spread = slerp(np.array([0.0, 1.0]), ends, np.arange(1, len(spine) + 1) / max(len(spine), 1))
    turns = np.empty((len(places), 4))
    for j, parent in enumerate(marks.parents):
        turns[j] = spread[spine.index(j)] if j in spine else (ends[0] if parent < 0 else turns[parent])
    return turns


def _standing(up: NDArray[np.float64], body: NDArray[np.float64]) -> NDArray[np.float64]:
    """Left, up and forward directions, as columns, of a person in the file's axes who faces its front.

    The front is +z if y is up, as in BVH files, and -y if z is up, as in Blender; otherwise the axis that the body
    faces.
    """
    if up[1] > 0.5:
        return np.eye(3)
    if up[2] > 0.5:
        return np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
    standing = [g for g in transform.Rotation.create_group("O").as_matrix() if g[:, 1] @ up > 0.5]
    return np.asarray(max(standing, key=lambda g: float((g * body).sum())))


def _frame(across: NDArray[np.float64], up: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """Columns left, up, forward from a line across the body; None if that is nearly vertical."""
    left = across - up * (up @ across)
    if np.linalg.norm(left) <= _SIDEWAYS * np.linalg.norm(across):
        return None
    left = unit(left)
    return np.column_stack([left, up, np.cross(left, up)])


def turn_of_rest(clip: Clip, marks: Landmarks) -> tuple[NDArray[np.float64] | None, tuple[str, ...]]:
    """Rotation of a rest pose whose up axis differs from that of the frames, and a note; None if they agree."""
    at_rest, ways, pelvis = _ways(marks, marks.rest), _ways_of_frames(marks, clip), marks.pelvis
    if at_rest is None or ways is None or pelvis is None:
        return None, ()
    mean = ways.mean(axis=0)
    if np.linalg.norm(mean) < _MOSTLY:
        return None, ()
    own, found = _signed_axis(at_rest), _signed_axis(mean)
    if own @ found > 0.5:
        return None, ()
    direction = f"stands along {_axis_name(own)} in its rest and along {_axis_name(found)} in its frames"
    if not _stands(clip, found, own):
        return None, (f"the recorded figure {direction}: it is taken to lie, not to stand",)
    turn = minimal_rotation(own, found)
    if own @ found < -0.5:  # upside down: the rotation axis follows from the frames
        mean_turn = transform.Rotation.from_quat(clip.each(lambda some: some.rotations[:, pelvis])).mean()
        fitting = [g for g in transform.Rotation.create_group("O") if g.apply(own) @ found > 0.5]
        turn = np.asarray(min(fitting, key=lambda g: float((mean_turn * g.inv()).magnitude())).as_quat())
    return turn, (f"the recorded figure {direction}: the latter is taken as up",)


def _up(clip: Clip, ways: NDArray[np.float64]) -> tuple[NDArray[np.float64], tuple[str, ...]]:
    """The up axis if the rest is unusable: the one along which the figure stands, or y or z if these have a floor.

    Returns:
        The axis, and a note if the figure lies.
    """
    found = _signed_axis(ways.mean(axis=0))
    y, z = np.eye(3)[1:]
    floors = [up for up in (y, z) if _stands(clip, up, found)]
    if found @ y > 0.5 or not floors or _stands(clip, found, floors[0]):
        return found, ()
    along = f"the recorded figure is along {_axis_name(found)} in its frames, on a floor across {_axis_name(floors[0])}"
    return floors[0], (f"{along}: it is taken not to stand, but to lie or the like",)


def _stands(clip: Clip, up: NDArray[np.float64], other: NDArray[np.float64]) -> bool:
    """Whether there is a floor normal to one axis rather than to another.

    The lowest joints of a standing figure keep their height, which is near zero or varies along the other axis.
    """
    size = float(np.linalg.norm(np.ptp(clip[:1].positions[0], axis=0))) or 1.0
    axes = np.stack([up, other], axis=-1)
    low, across = clip.each(lambda some: (some.positions @ axes).min(axis=1)).T / size
    still = float(np.ptp(low)) < 2.0 * _FLOOR
    at_zero = abs(float(np.median(low))) < _FLOOR
    return still and (at_zero or float(np.ptp(across)) > 0.3)


def _signed_axis(direction: NDArray[np.float64]) -> NDArray[np.float64]:
    out = np.zeros(3)
    axis = int(np.abs(direction).argmax())
    out[axis] = np.copysign(1.0, direction[axis])
    return out


def _axis_name(axis: NDArray[np.float64]) -> str:
    k = int(np.abs(axis).argmax())
    return f"{'-' if axis[k] < 0 else '+'}{_AXES[k]}"


def _degrees(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Angles [°] between vectors, shape of all but the last axis."""
    return np.asarray(np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b), axis=-1), (a * b).sum(-1))))
