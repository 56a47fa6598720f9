"""Swelling amplitudes of the joints, fitted at binding so that flexing a joint preserves the volume of the surface.

A tube that bends about its axis keeps its volume but for a few hundredths. Flesh does not surround its joints as a
tube: where a joint lies near the outer side, most of the flesh is on the inside of the bend, and the wedge that closes
there is larger than the one that opens outside; the ball of a thumb or a buttock has no counterpart at all. The lost
volume is measured at binding, joint by joint, and restored over both adjacent segments, on the outside and the flanks:
in one place it would be a lump, and inside the bend it would be folded in again.

Where digits are joined by webs, or lie so close that their flesh is one, flexing one alone crushes what joins it to its
neighbours, and flexing all together does not. So joints of one rank are also measured together, and their amplitudes
multiplied by the factor that serves both best.

A thumb that is opposed crushes the flesh between its metacarpal and the palm. Where that is more than its outside can
take up, the palm pair between them thickens by more than keeps the area of its cross-section (R44, C3).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from warpjld.covering.bent_parts import BentPart, BentParts, Driven, PackedRows, Swelling
from warpjld.covering.binding import STATIONS
from warpjld.covering.drivers import drive
from warpjld.covering.parameters import default_parameters
from warpjld.covering.rows import Rows, rows_of, scalar_inputs
from warpjld.covering.volume_change import Bending
from warpjld.geometry.rotations import unit
from warpjld.skeleton.channels import ABDUCTION, FLEXION
from warpjld.skeleton.kinematics import poses_from_angles

if TYPE_CHECKING:
    from warpjld.covering.covering import Covering
    from warpjld.covering.parameters import Parameters
    from warpjld.skeleton.kinematics import Poses
    from warpjld.skeleton.tree import Skeleton

__all__ = ["volume_keeping"]

# fractions of the largest flexion that are measured; the loss grows faster than the flexion ratio, the swelling in
# proportion to it
_PARTS = (0.33, 0.67, 1.0)
_WIDEST = np.radians(110.0)  # largest flexion that is measured: beyond, limbs touch each other
_MOST = 1.0  # upper bound of the amplitudes; with 6/5 volume is preserved no better, and fingers collide earlier
_THICKEST = 2.0  # upper bound of the pairs' factors: with 3 hands of few vertices get as rough as by blended weights
_ALIKE = 0.7  # smallest cosine between a joint's axis and the mean axis of the joints of its rank
_STEPS = 4  # Gauss-Newton steps for one amplitude
_EXACT = 1e-9  # change of an amplitude that ends its fit
_POINTS = 1_000_000  # points of parts in poses that are evaluated together, which bounds memory


def volume_keeping(covering: Covering) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Amplitudes with which flexing joints, singly and together, preserves the flesh's volume.

    Returns:
        Swelling amplitudes, shape (J,). They lie between 0 and 1: a joint whose flesh gains volume gets 0, and the
        upper bound applies where hardly any flesh lies on the outside of a joint. And factors of the palm pairs'
        thickening, shape (N,), 1 but where a thumb's amplitude is at its bound.
    """
    skeleton = covering.skeleton
    largest = np.minimum(skeleton.limits[:, FLEXION, 1], _WIDEST)
    bends = (skeleton.parents >= 0) & np.array([bool(c) for c in skeleton.children]) & (largest > 1e-6)
    amplitudes, lost = np.zeros(len(skeleton)), np.zeros(len(skeleton))
    factors = np.ones(len(covering.anchors.pairs))
    joints = np.flatnonzero(bends)
    if not joints.size or not len(covering.flesh.faces):
        return amplitudes, factors
    angles = [_measured(skeleton, int(joint), largest[joint]) for joint in joints]
    poses = poses_from_angles(skeleton, np.concatenate(angles))
    counts = np.array([len(a) for a in angles], dtype=np.int64)
    first = np.cumsum(counts) - counts
    default = default_parameters(skeleton)
    parameters = replace(covering.parameters, inflation=default.inflation, muscle=default.muscle, palm=default.palm)
    rows = rows_of(covering.fields, skeleton, covering.anchors, parameters)
    bending, packed = Bending(covering, rows), PackedRows(rows)
    driven, ratios = _driven(covering, parameters, poses)
    for some in _groups(bending, joints, counts):
        numbers, found = zip(*some, strict=True)
        chosen, begin, frames = joints[list(numbers)], first[list(numbers)], int(counts[numbers[0]])
        parts = BentParts(found, begin, frames)
        driving = ratios[begin[:, None] + np.arange(frames), chosen[:, None]]  # (P, F)
        more = np.concatenate([p.swelling for p in found])[:, None] * driving[parts.owner]
        swelling = parts.swelling(packed, driven, more)
        amplitudes[chosen], lost[chosen] = _amplitudes(swelling, bending.rest)
        pairs = [_swinging(covering, int(joint)) for joint in chosen]
        full = np.array([len(p) > 0 for p in pairs]) & (amplitudes[chosen] >= _MOST)
        if not full.any():
            continue
        thicker = _thickening(rows, parts, driven, begin, pairs)
        also = _amplitudes(swelling.and_also(amplitudes[chosen], thicker), bending.rest, _THICKEST - 1.0)[0]
        for part in np.flatnonzero(full):
            factors[pairs[part]] = np.maximum(factors[pairs[part]], 1.0 + also[part])
    return amplitudes * _together(covering, bending, packed, parameters, amplitudes, lost), factors


def _groups(
    bending: Bending, joints: NDArray[np.int64], frames: NDArray[np.int64]
) -> Iterator[list[tuple[int, BentPart]]]:
    """Numbers among the joints, and the parts that they bend, in groups of the same number of frames and bounded
    size; joints that bend nothing are left out."""
    for count in np.unique(frames).tolist():
        group: list[tuple[int, BentPart]] = []
        size = 0
        for number in np.flatnonzero(frames == count).tolist():
            part = bending.around(int(joints[number]))
            if part is None:
                continue
            if group and size + count * len(part.vertices) > _POINTS:
                yield group
                group, size = [], 0
            group.append((number, part))
            size += count * len(part.vertices)
        if group:
            yield group


def _thickening(
    rows: Rows,
    parts: BentParts,
    driven: Driven,
    first: NDArray[np.int64],
    pairs: list[NDArray[np.int64]],
) -> NDArray[np.float64]:
    """What palm pairs' thickening adds to the growth of the parts' offsets, shape (n, F); ``first`` are the parts'
    first poses, shape (P,)."""
    out, joints = np.zeros((len(parts.owner), parts.frames)), len(driven.positions[0])
    for number, (part, own) in enumerate(zip(parts.parts, pairs, strict=True)):
        if len(own):
            columns = joints + (STATIONS * own[:, None] + np.arange(STATIONS)).ravel()
            scalars = driven.scalars[first[number] : first[number] + parts.frames, columns]
            out[parts.owner == number] = rows.scales[part.vertices][:, columns] @ scalars.T
    return out


def _driven(covering: Covering, parameters: Parameters, poses: Poses) -> tuple[Driven, NDArray[np.float64]]:
    """Inputs of the operators in these poses, and flexion ratios (F, J)."""
    drivers = drive(covering.skeleton, covering.anchors, poses)
    turns = np.concatenate([drivers.halfway, drivers.rotations], axis=1)
    scalars = scalar_inputs(covering.anchors, parameters, drivers)
    return Driven(drivers.positions, turns, scalars), drivers.flexion_ratio


def _amplitudes(
    swelling: Swelling, rest: NDArray[np.float64], most: float = _MOST
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Amplitude of every part, up to ``most``, of the least squared volume error (Gauss–Newton), and the volume [m³]
    lost without it where the joint is flexed farthest, shape (P,) each; from rest positions [m], shape (V, 3)."""
    parts = swelling.parts
    before = np.array([part.rest_volume(rest) for part in parts.parts])[:, None]
    best = np.zeros(len(parts))
    gained, slope = swelling.volume_and_slope(best)
    gained = gained - before
    farthest = np.maximum(-gained[:, len(_PARTS) - 1], 0.0)
    # only directions of motion that lose volume are fitted: a thumb may gain it to one side and lose it to the other
    loses = np.repeat(gained.reshape(len(parts), -1, len(_PARTS)).sum(axis=2) < 0.0, len(_PARTS), axis=1)
    going = loses.any(axis=1)
    for step in range(_STEPS):
        if step:
            gained, slope = swelling.volume_and_slope(best)
            gained = gained - before
        square = (loses * slope**2).sum(axis=1)
        hopeless = going & (square <= 0.0)
        best[hopeless], farthest[hopeless] = 0.0, 0.0
        going &= ~hopeless
        change = (loses * slope * gained).sum(axis=1) / np.where(square > 0.0, square, 1.0)
        last, best = best, np.where(going, np.clip(best - change, 0.0, most), best)
        going &= np.abs(best - last) >= _EXACT
        if not going.any():
            break
    return best, farthest


def _swinging(covering: Covering, joint: int) -> NDArray[np.int64]:
    """Palm pairs of a joint that swings sideways farther than it flexes, as a thumb's root."""
    limits = covering.skeleton.limits[joint]
    if limits[ABDUCTION, 1] <= min(limits[FLEXION, 1], _WIDEST):
        return np.zeros(0, dtype=np.int64)
    begins = covering.anchors.ends[covering.anchors.pairs, 0]
    return np.flatnonzero((begins == joint).any(axis=1))


def _together(
    covering: Covering,
    bending: Bending,
    packed: PackedRows,
    parameters: Parameters,
    amplitudes: NDArray[np.float64],
    lost: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Factors of the amplitudes (J,), the same for all joints of a rank, shape (J,).

    Least squares over the poses in which the joints of a rank are flexed singly, where the factor 1 leaves no error and
    0 the volume ``lost`` [m³] (J,), and the one in which they are flexed together, which counts as all the others.
    """
    skeleton = covering.skeleton
    ranks = [joints for joints in _ranks(skeleton) if (amplitudes[joints] > 0.0).sum() > 1]
    factors = np.ones(len(skeleton))
    if not ranks:
        return factors
    angles = np.repeat(skeleton.initial[None], len(ranks), axis=0)
    for row, joints in zip(angles, ranks, strict=True):
        row[joints, FLEXION] = np.minimum(skeleton.limits[joints, FLEXION, 1], _WIDEST)
    driven, ratios = _driven(covering, parameters, poses_from_angles(skeleton, angles))
    whole = bending.whole(amplitudes)
    before = whole.rest_volume(bending.rest)
    together = max(_POINTS // len(bending.rest), 1)
    changes = []
    for first in range(0, len(ranks), together):
        some = slice(first, first + together)
        parts = BentParts([whole], [first], len(ranks[some]))
        swelling = parts.swelling(packed, driven, bending.swellings @ (ratios[some] * amplitudes).T)
        changes.append([swelling.volume_and_slope(np.array([one]))[0][0] - before for one in (0.0, 1.0)])
    for joints, without, with_swelling in zip(ranks, *np.concatenate(changes, axis=1), strict=True):
        singly = float(lost[joints] @ lost[joints])
        slope, weight = with_swelling - without, len(joints)
        square = singly + weight * slope**2
        if square > 0.0:
            factors[joints] = np.clip((singly - weight * slope * without) / square, 0.0, 1.0)
    return factors


def _ranks(skeleton: Skeleton) -> list[NDArray[np.int64]]:
    """Groups of joints of the same rank: at the same depth below the same branching joint, with nearly the same flexion
    axis. Fingers form such groups; the thumb beside them does not belong to them."""
    ranks: dict[tuple[int, int], list[int]] = {}
    for joint in range(len(skeleton)):
        above, steps = int(skeleton.parents[joint]), 1
        while above >= 0 and len(skeleton.children[above]) == 1:
            above, steps = int(skeleton.parents[above]), steps + 1
        if above >= 0:
            ranks.setdefault((above, steps), []).append(joint)
    out = []
    for joints in ranks.values():
        axes = skeleton.axes[joints]
        alike = np.array(joints)[axes @ unit(axes.sum(axis=0)) > _ALIKE]
        if len(alike) > 1:
            out.append(alike)
    return out


def _measured(skeleton: Skeleton, joint: int, largest: float) -> NDArray[np.float64]:
    """Angles of the poses in which one joint is measured, shape (F, J, channels): flexed, and where its abduction
    exceeds its flexion, as at a thumb's root, also abducted to either side."""
    angles = np.repeat(skeleton.initial[None], len(_PARTS), axis=0)
    angles[:, joint, FLEXION] = largest * np.array(_PARTS)
    sideways = skeleton.limits[joint, ABDUCTION]
    if sideways[1] <= largest:
        return angles
    both = np.repeat(angles[None], 2, axis=0)
    both[:, :, joint, ABDUCTION] = 0.5 * sideways[:, None] * np.array(_PARTS)
    return np.concatenate([angles, *both])
