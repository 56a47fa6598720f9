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

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from warpjld.covering.drivers import drive
from warpjld.covering.parameters import default_parameters
from warpjld.covering.rows import rows_of, scalar_inputs
from warpjld.covering.volume_change import Bending, Driven, Swollen
from warpjld.geometry.rotations import unit
from warpjld.runtime.threads import helpers, threads_for
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
_THREAD = 100_000  # smallest number of joints times vertices worth a thread of its own


def volume_keeping(covering: Covering) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Amplitudes with which flexing joints, singly and together, preserves the flesh's volume.

    Returns:
        Swelling amplitudes, shape (J,). They lie between 0 and 1: a joint whose flesh gains volume gets 0, and the
        upper bound applies where hardly any flesh lies on the outside of a joint. And factors of the palm pairs'
        thickening, shape (N,), 1 but where a thumb's amplitude is at its bound.
    """
    import warp as wp
    from warpjld_kernels.bent_part import bend_part

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
    last = np.cumsum([len(a) for a in angles])
    default = default_parameters(skeleton)
    parameters = replace(covering.parameters, inflation=default.inflation, muscle=default.muscle, palm=default.palm)
    bending = Bending(covering, rows_of(covering.fields, skeleton, covering.anchors, parameters))
    driven, ratios = _driven(covering, parameters, poses)

    def fitted(number: int) -> tuple[float, float, float]:
        frames, joint = np.arange(last[number] - len(angles[number]), last[number]), int(joints[number])
        around = bending.around(joint)
        if around is None:
            return 0.0, 0.0, 1.0
        part, swelling = around
        swollen = part.swollen(driven[frames], swelling[:, None] * ratios[frames, joint])
        amplitude, without = _amplitude(swollen)
        pairs = _swinging(covering, joint)
        if amplitude < _MOST or not pairs.size:
            return amplitude, without, 1.0
        left_over = swollen.and_also(amplitude, part.thickened(driven[frames], pairs))
        return amplitude, without, 1.0 + _amplitude(left_over, _THICKEST - 1.0)[0]

    wp.load_module(bend_part.module, device="cpu")  # compilation is not thread-safe
    threads = threads_for(len(joints) * len(covering.surface.vertices), _THREAD)
    found = helpers(threads + 1).map(fitted, range(len(joints))) if threads > 1 else map(fitted, range(len(joints)))
    amplitudes[joints], lost[joints], thicker = zip(*found, strict=True)
    for joint, factor in zip(joints, thicker, strict=True):
        pairs = _swinging(covering, int(joint))
        factors[pairs] = np.maximum(factors[pairs], factor)
    return amplitudes * _together(covering, bending, parameters, amplitudes, lost), factors


def _driven(covering: Covering, parameters: Parameters, poses: Poses) -> tuple[Driven, NDArray[np.float64]]:
    """Inputs of the operators in these poses, and flexion ratios (F, J)."""
    drivers = drive(covering.skeleton, covering.anchors, poses)
    turns = np.concatenate([drivers.halfway, drivers.rotations], axis=1)
    scalars = scalar_inputs(covering.anchors, parameters, drivers)
    return Driven(drivers.positions, turns, scalars), drivers.flexion_ratio


def _amplitude(swollen: Swollen, most: float = _MOST) -> tuple[float, float]:
    """Amplitude, up to ``most``, of the least squared volume error (Gauss–Newton), and the volume [m³] lost without it
    where the joint is flexed farthest."""
    before = swollen.part.rest_volume()
    gained, slope = swollen.volume_and_slope(0.0)
    gained -= before
    farthest = max(-float(gained[len(_PARTS) - 1]), 0.0)
    # only directions of motion that lose volume are fitted: a thumb may gain it to one side and lose it to the other
    loses = np.repeat(gained.reshape(-1, len(_PARTS)).sum(axis=1) < 0.0, len(_PARTS))
    if not loses.any():
        return 0.0, farthest
    gained, slope = gained[loses], slope[loses]
    best = 0.0
    for _ in range(_STEPS):
        square = float(slope @ slope)
        if square <= 0.0:
            return 0.0, 0.0
        last, best = best, min(max(best - float(slope @ gained) / square, 0.0), most)
        if abs(best - last) < _EXACT:
            break
        gained, slope = (every[loses] for every in swollen.volume_and_slope(best))
        gained -= before
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
    before = whole.rest_volume()
    for frame, joints in enumerate(ranks):  # one at a time, which bounds memory
        one = slice(frame, frame + 1)
        swollen = whole.swollen(driven[one], bending.swellings @ (ratios[one] * amplitudes).T)
        without, with_swelling = (float(swollen.volume(amplitude)[0]) - before for amplitude in (0.0, 1.0))
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
