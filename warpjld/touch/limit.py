"""Limits of the closing of digits: each bends only until it touches the rest of the hand or body."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from warpjld.covering.intersections import crossing_faces
from warpjld.geometry.rotations import conjugate, multiply, rotate
from warpjld.skeleton.digits import digit_joints
from warpjld.skeleton.kinematics import Poses, vertical_flexion
from warpjld.skeleton.streamed_poses import blocks_of, streamed_rows
from warpjld.touch.frame import Overlaps
from warpjld.touch.limited_digits import LimitedDigits
from warpjld.touch.touch import Touch

if TYPE_CHECKING:
    from warpjld.covering.covering import Covering

__all__ = ["close_until_touch"]

_ALLOWED = 0.5  # depth that a digit may overlap, relative to what skin can yield; its separation then bulges little
_BESIDE = 0.4  # factor of overlaps between two digits: side by side they overlap regardless of their flexion
_SCAN = 10  # steps of the scan that opens a digit until it is free
_STEPS = 7  # bisections of the last scan step: 1/1280 of a digit's bend; depths are interpolated from there
_ROUNDS = 2  # times that digits are opened against all parts: once, and again where some could not get free
_FASTEST = 2.0  # largest rate of a digit's change of share, relative to the motion of the digits
_BLOCK = 32  # frames searched at once
_STILL = 1e-6  # rotation from rest [rad] below which a digit cannot be opened


def close_until_touch(covering: Covering, poses: Poses, touch: Touch, *, first: int = 0) -> tuple[Poses, LimitedDigits]:
    """Limit the closing of digits to first contact; returns the poses and the digits changed, by digit and frame.

    The joints of a digit turn back together, by a common share of their rotation from rest: the least for which its
    deepest overlap is half of what skin can yield, and no face of it crosses another after separation. Digits are
    processed in turn, from index to pinky and the thumb last, each against the palm, the body and the limited digits
    before it, so that each share is the root of a scalar equation, which varies continuously with the motion. A digit
    that touches nothing keeps its pose exactly; one that crosses something however far it opens is opened to where
    fewest faces cross, if that halves them, and the others are then opened against it.

    Args:
        covering: The hand or body.
        poses: F poses.
        touch: Its contact.
        first: Number of the first frame, for reports.
    """
    digits = _digits(covering)
    reported = LimitedDigits([digit.name for digit in digits], [fan.name for fan in covering.fans])
    if not digits:
        return poses, reported
    spans = [slice(k, min(k + _BLOCK, len(poses))) for k in range(0, len(poses), _BLOCK)]
    searched = [_block(covering, poses[span], touch, digits) for span in spans]
    moved = _motion(covering, poses, digits)
    shares = []
    for n, digit in enumerate(digits):
        bend = np.concatenate([_bend(covering, some, digit.joints) for _, some in blocks_of(poses)])
        share = np.concatenate([block[n][0] for block in searched])
        shares.append(_steady(share, moved / np.maximum(bend, _STILL)))

    def limited(frames: slice) -> Poses:
        some = poses[frames]
        for digit, share in zip(digits, shares, strict=True):
            some = _bent(covering, some, digit.joints, share[frames])
        return some

    for span, block in zip(spans, searched, strict=True):
        some = poses[span]
        for n, (digit, (_, stuck, _, depth, other)) in enumerate(zip(digits, block, strict=True)):
            share = shares[n][span]
            some = _bent(covering, some, digit.joints, share)
            f = np.flatnonzero((share < 1.0) | stuck)
            flexion = np.degrees(some.flexion[f][:, digit.joints].sum(axis=1))
            frames, found = first + span.start + f, {"depth": depth[f], "other": other[f], "crosses": stuck[f]}
            reported.add(n, frames, share=share[f], flexion=flexion, **found)
    return streamed_rows(len(poses), limited), reported


@dataclass(frozen=True, eq=False)
class _Digit:
    """A digit and masks of parts.

    Attributes:
        name: Name, e.g. ``left.index``.
        joints: Its joints.
        parts: Its own parts, shape (P,).
        counts: Parts that it is closed against, its own included, shape (P,).
        fingers: Parts of all digits, shape (P,).
    """

    name: str
    joints: list[int]
    parts: NDArray[np.bool_]
    counts: NDArray[np.bool_]
    fingers: NDArray[np.bool_]


def _digits(covering: Covering) -> list[_Digit]:
    """Digits in the order in which they are limited; metacarpals belong to the palm."""
    parts = [fan.name for fan in covering.fans]
    found = []
    for name, joints in digit_joints(covering.skeleton).items():
        own = np.array([part.startswith(f"{name}.") for part in parts])
        if own.any():
            found.append((name, list(joints), own))
    order = ("index", "middle", "ring", "pinky", "thumb")
    found.sort(key=lambda digit: order.index(digit[0].rpartition(".")[2]))
    later = np.zeros(len(parts), dtype=bool)
    fingers = np.logical_or.reduce([own for _, _, own in found]) if found else later
    out = []
    for name, joints, own in reversed(found):
        out.append(_Digit(name, joints, own, ~later, fingers))
        later = later | own
    return out[::-1]


def _block(covering: Covering, poses: Poses, touch: Touch, digits: list[_Digit]) -> list[tuple[NDArray, ...]]:
    """For every digit the share of its rotation that it keeps, whether it still crosses something, and
    :func:`_depths` of the original poses, arrays of shape (F,)."""
    share = [np.ones(len(poses)) for _ in digits]
    found = touch.measured(covering.deform(poses), poses)
    depth = [_depths(found, digit) for digit in digits]
    for n, digit in enumerate(digits):

        def over(tried: Poses, digit: _Digit = digit) -> NDArray[np.float64]:
            return _depths(touch.measured(covering.deform(tried), tried), digit)[0] - _ALLOWED

        left = _search(covering, poses, digit, _depths(found, digit)[0] - _ALLOWED, over, interpolated=True)
        if (left < 1.0).any():
            share[n] *= left
            poses = _bent(covering, poses, digit.joints, left)
            found = touch.measured(covering.deform(poses), poses)
    # again against all parts: skin separated from a later digit may cross an earlier one, and a digit that could not
    # get free may have been in the way of others
    everything = [replace(digit, counts=np.ones_like(digit.counts)) for digit in digits]
    for against in (digits, *[everything] * _ROUNDS):
        crossing = _crossing(covering, touch, poses, against)
        for n, digit in enumerate(against):
            if not crossing[n].any():
                continue

            def crosses(tried: Poses, digit: _Digit = digit) -> NDArray[np.float64]:
                return _crossing(covering, touch, tried, [digit])[0] - 0.5

            left = _search(covering, poses, digit, crossing[n] - 0.5, crosses, interpolated=False)
            if (left < 1.0).any():
                share[n] *= left
                poses = _bent(covering, poses, digit.joints, left)
                crossing = _crossing(covering, touch, poses, against)
    return [(kept, stuck > 0, *of) for kept, stuck, of in zip(share, crossing, depth, strict=True)]


def _motion(covering: Covering, poses: Poses, digits: list[_Digit]) -> NDArray[np.float64]:
    """Largest rotation of any digit's joint from the frame before [rad], shape (F,)."""
    joints = [j for digit in digits for j in digit.joints]
    parents = [max(int(covering.skeleton.parents[j]), 0) for j in joints]
    out, last = [np.zeros(min(len(poses), 1))], np.zeros((0, len(joints), 4))
    for _, some in blocks_of(poses):
        local = np.concatenate([last, multiply(conjugate(some.rotations[:, parents]), some.rotations[:, joints])])
        step, last = multiply(conjugate(local[:-1]), local[1:]), local[-1:]
        if len(step):
            turned = Rotation.from_quat(step.reshape(-1, 4)).magnitude().reshape(step.shape[:2])
            out.append(turned.max(axis=1))
    return np.concatenate(out)


def _steady(share: NDArray[np.float64], moved: NDArray[np.float64]) -> NDArray[np.float64]:
    """The largest shares (F,) below those given that change at a bounded rate, since crossings of single faces may
    flicker from frame to frame.

    Args:
        share: Shares, shape (F,).
        moved: Motion from the frame before, relative to the digit's rotation from rest, shape (F,).
    """
    out = share.copy()
    for f in range(1, len(out)):
        out[f] = min(out[f], out[f - 1] + _FASTEST * moved[f])
    for f in range(len(out) - 1, 0, -1):
        out[f - 1] = min(out[f - 1], out[f] + _FASTEST * moved[f])
    return out


def _search(
    covering: Covering,
    poses: Poses,
    digit: _Digit,
    over: NDArray[np.float64],
    measure: Callable[[Poses], NDArray[np.float64]],
    *,
    interpolated: bool,
) -> NDArray[np.float64]:
    """Largest share of a digit's rotation from rest for which a measure is not positive, shape (F,); 1 where it is not
    positive in the original pose. Where it is positive however far the digit opens: the scanned share at which a
    measure that is not interpolated is least, if that is less than half, else 1.

    Args:
        covering: The hand or body.
        poses: F poses.
        digit: The digit that is opened.
        over: The measure in the original poses, shape (F,).
        measure: The measure of n poses, shape (n,).
        interpolated: Whether the measure is continuous: then its zero in the last interval is interpolated. Otherwise
            it is a number of faces less a half.
    """
    out = np.ones(len(poses))
    frames = np.flatnonzero((over > 0.0) & (_bend(covering, poses, digit.joints) > _STILL))
    if not len(frames):
        return out
    # scan from closed to open, since the measure may change its sign more than once
    low, high, at_low, at_high = np.ones(len(frames)), np.ones(len(frames)), over[frames], over[frames]
    best, fewest = np.ones(len(frames)), 0.5 * over[frames]
    for share in np.linspace(1.0, 0.0, _SCAN + 1)[1:]:
        rows = np.flatnonzero(at_low > 0.0)
        if not len(rows):
            break
        high[rows], at_high[rows] = low[rows], at_low[rows]
        low[rows] = share
        at_low[rows] = measure(_bent(covering, _picked(poses, frames[rows]), digit.joints, low[rows]))
        fewer = at_low < fewest
        best, fewest = np.where(fewer, low, best), np.where(fewer, at_low, fewest)
    opens = at_low <= 0.0
    if not interpolated:
        out[frames[~opens]] = best[~opens]
    frames = frames[opens]
    low, high, at_low, at_high = low[opens], high[opens], at_low[opens], at_high[opens]
    picked = _picked(poses, frames)
    for _ in range(_STEPS if len(frames) else 0):
        middle = 0.5 * (low + high)
        at = measure(_bent(covering, picked, digit.joints, middle))
        free = at <= 0.0
        low, at_low = np.where(free, middle, low), np.where(free, at, at_low)
        high, at_high = np.where(free, high, middle), np.where(free, at_high, at)
    if interpolated:
        low = low + (high - low) * -at_low / np.maximum(at_high - at_low, 1e-12)
    out[frames] = low
    return out


def _bend(covering: Covering, poses: Poses, joints: list[int]) -> NDArray[np.float64]:
    """Largest rotation of a digit's joints from rest in every frame [rad], shape (F,)."""
    parents = [max(int(covering.skeleton.parents[j]), 0) for j in joints]
    local = multiply(conjugate(poses.rotations[:, parents]), poses.rotations[:, joints])
    return np.asarray(Rotation.from_quat(local.reshape(-1, 4)).magnitude().reshape(local.shape[:2]).max(axis=1))


def _depths(
    overlaps: list[Overlaps], digit: _Digit
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.int64]]:
    """Deepest overlap of a digit with the parts it is closed against, in every frame, shape (F,) each: relative to what
    skin can yield, in metres, and the other part, -1 for none."""
    count = len(overlaps)
    ratio, depth, other = np.zeros(count), np.zeros(count), np.full(count, -1)
    for f, found in enumerate(overlaps):
        inside, around = digit.parts[found.part], digit.parts[found.other]
        rows = np.flatnonzero((inside | around) & digit.counts[found.part] & digit.counts[found.other])
        if len(rows):
            beside = ~(digit.parts[found.part[rows]] & digit.parts[found.other[rows]])
            beside &= digit.fingers[found.part[rows]] & digit.fingers[found.other[rows]]
            ratio[f] = (found.ratio[rows] * np.where(beside, _BESIDE, 1.0)).max()
            deepest = rows[found.depth[rows].argmax()]
            depth[f] = found.depth[deepest]
            other[f] = found.other[deepest] if digit.parts[found.part[deepest]] else found.part[deepest]
    return ratio, depth, other


def _crossing(covering: Covering, touch: Touch, poses: Poses, digits: list[_Digit]) -> NDArray[np.int64]:
    """Number of pairs of crossing faces, one of the digit, the other of a part it is closed against, after separation,
    shape (digits, F)."""
    part = touch.patches.part[touch.patches.faces]
    parted, _ = touch.parted(covering.deform(poses), poses)
    own = np.array([digit.parts[part].any(axis=1) for digit in digits])
    counts = np.array([digit.counts[part].all(axis=1) for digit in digits])
    out = np.zeros((len(digits), len(poses)), dtype=np.int64)
    for f, points in enumerate(parted):
        near = np.flatnonzero(_beside(points[touch.patches.faces], own))
        pairs = touch.new_crossings(near[crossing_faces(points, touch.patches.faces[near]).pairs])
        found = np.logical_and(own[:, pairs].any(axis=2), counts[:, pairs].all(axis=2))
        out[:, f] = np.asarray(found).sum(axis=1)
    return out


def _beside(corners: NDArray[np.floating], own: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Which faces overlap the bounding box of some digit's faces, shape (T,); no others can cross them.

    Args:
        corners: Corners of the faces [m], shape (T, 3, 3).
        own: Faces of every digit, shape (digits, T).
    """
    lower, upper = corners.min(axis=1), corners.max(axis=1)
    out = np.zeros(len(corners), dtype=bool)
    for faces in own[own.any(axis=1)]:  # in a coarse mesh a digit may have no face
        low, high = lower[faces].min(axis=0), upper[faces].max(axis=0)
        out |= (lower <= high).all(axis=1) & (upper >= low).all(axis=1)
    return out


def _picked(poses: Poses, frames: NDArray[np.int64]) -> Poses:
    return Poses(poses.positions[frames], poses.rotations[frames], poses.flexion[frames])


def _bent(covering: Covering, poses: Poses, joints: list[int], share: NDArray[np.float64]) -> Poses:
    """Poses with some joints at a share (F,) of their rotation from rest. Bone lengths are kept, and frames at a share
    of 1 are unchanged to the bit."""
    frames = np.flatnonzero(share < 1.0)
    if not len(frames):
        return poses
    skeleton, picked = covering.skeleton, _picked(poses, frames)
    positions, rotations, local = picked.positions.copy(), picked.rotations.copy(), picked.rotations.copy()
    changed = np.isin(np.arange(len(skeleton)), joints)
    for j, parent in enumerate(skeleton.parents.tolist()):
        if parent < 0:
            continue
        local[:, j] = multiply(conjugate(picked.rotations[:, parent]), picked.rotations[:, j])
        if j in joints:
            vector = share[frames, None] * Rotation.from_quat(local[:, j]).as_rotvec()
            local[:, j] = Rotation.from_rotvec(vector).as_quat()
            local[:, j] *= np.where(local[:, j, 3:] < 0.0, -1.0, 1.0)
        if changed[j] or changed[parent]:
            changed[j] = True
            rotations[:, j] = multiply(rotations[:, parent], local[:, j])
            along = picked.positions[:, j] - picked.positions[:, parent]
            offset = rotate(conjugate(picked.rotations[:, parent]), along)
            positions[:, j] = positions[:, parent] + rotate(rotations[:, parent], offset)
    out = Poses(poses.positions.copy(), poses.rotations.copy(), poses.flexion.copy())
    out.positions[frames], out.rotations[frames] = positions, rotations
    out.flexion[frames] = vertical_flexion(skeleton, local)
    return out
