"""Retargeting of hand recordings to a rig: choice of hands, and plausibility checks."""

from __future__ import annotations

import numpy as np

from warpjld.errors import InputError
from warpjld.geometry.rotations import slerp
from warpjld.motion.finger_bends import BENDING, FINGERS, bending_side, bent_beyond_limits
from warpjld.motion.frame_times import frame_times
from warpjld.motion.hand_motion import IDENTITY, HandMotion, hand_joints
from warpjld.skeleton import Poses, Skeleton, poses_from_rotations

__all__ = ["poses_of_hands"]

_SIDES = ("left", "right")
_MOST_JOINTS = 3
"""A quarter of the fingers' twelve joints: one or two with much extension may be due to lax distal joints."""
_MOST_FRAMES = 0.25  # largest share of frames in which a joint may be beyond its limits
_FAR = np.radians(30.0)
"""Violation that exceeds tracking errors and joint laxity."""


def poses_of_hands(
    hands: tuple[HandMotion, ...], skeleton: Skeleton, rate: float, *, side: str | None = None
) -> tuple[Poses, tuple[str, ...], tuple[str, ...]]:
    """Poses of a rig whose hands follow recorded hands of the same side; a single one of the other side is mirrored.

    A rig that consists of a hand, with or without a forearm, starts at rest and then moves as a whole with the
    recorded palm, relative to the palm's first orientation; of other skeletons only the fingers move. Where two hands
    were recorded for different times, each holds its first and last pose.

    Args:
        hands: The recorded hands.
        skeleton: Skeleton to pose.
        rate: Frames a second of the result.
        side: Side of a single recorded hand, overriding its file; of two hands, the one to use.

    Returns:
        The poses, notes on which hand drives which, and warnings.

    Raises:
        InputError: The rig has no hand, the recorded hand's side is unknown, or its fingers would bend backwards.
    """
    own = [one for one in _SIDES if f"{one}.wrist" in skeleton.names]
    if not own:
        raise InputError("this rig has no hand for a recording of one to drive")
    notes: list[str] = []
    warnings: list[str] = []
    known = [_sided(hand, own, side if len(hands) == 1 else None, notes, warnings) for hand in hands]
    if len({hand.side for hand in known}) < len(known):
        raise InputError(f"both recorded hands look like {known[0].side} ones: the file must state their handedness")
    known = _followed(known, own, side, notes)
    for hand in known:
        warnings += _check_bends(hand, given=side is not None)
    if len(known) == 1 and known[0].side not in own:
        notes.append(f"a recorded {known[0].side} hand drives the other one, mirrored")
        known = [known[0].mirrored()]
    elif len(own) == 2:
        notes += [f"the recorded {hand.side} hand drives the {hand.side} one" for hand in known]
    turns = [hand.turns(skeleton) for hand in known]
    first, last = min(float(hand.times[0]) for hand in known), max(float(hand.times[-1]) for hand in known)
    at = frame_times(first, last, rate)
    local = np.tile(IDENTITY, (len(at), len(skeleton), 1))
    root = np.zeros((len(at), 3))
    for hand, turn in zip(known, turns, strict=True):
        joints = list(turn.joints)
        local[:, joints] = slerp(hand.times, turn.local[:, joints], at)
        if turn.moves and _just_a_hand(skeleton, hand.side):
            local[:, 0] = slerp(hand.times, turn.root, at)
            root = np.stack([np.interp(at, hand.times, column) for column in turn.displacement.T], axis=-1)
    if any(turn.moves for turn in turns) and not _just_a_hand(skeleton, known[0].side):
        notes.append("only fingers follow the recording: where a hand is does not move a rig that is more than one")
    return poses_from_rotations(skeleton, local, root_position=root), tuple(notes), tuple(warnings)


def _just_a_hand(skeleton: Skeleton, side: str | None) -> bool:
    own = hand_joints(skeleton, side)
    return len(own) == len(skeleton) and "shoulder" not in own


def _sided(hand: HandMotion, own: list[str], side: str | None, notes: list[str], warnings: list[str]) -> HandMotion:
    """A hand with its side: as given, else as stated, else the one for which its finger bends are plausible."""
    bent = bending_side(hand.bends)
    if side is not None:
        if hand.side not in (None, side):
            warnings.append(f"the file says that this is a {hand.side} hand: taken for a {side} one, as asked for")
        return hand.called(side)
    if hand.side is not None:
        seen = bent or hand.leaning
        if seen in (None, hand.side):
            return hand
        if hand.may_be_mirrored:
            warnings.append(
                f"labelled a {hand.side} hand, but shaped like a {seen} one, as in a mirrored (selfie) image: "
                f"mirrored back; --side {seen} takes it for a {seen} hand instead"
            )
            return hand.mirrored().called(hand.side)
        if bent is None:
            warnings.append(f"stated to be a {hand.side} hand, but its thumb and fingers look like a {seen} one's")
        return hand
    if bent is not None:
        notes.append(f"the file does not say which hand this is: fingers bend as a {bent} hand's (--side to change)")
        return hand.called(bent)
    if hand.leaning is not None:
        notes.append(
            f"the file does not say which hand this is: thumb and fingers look like a {hand.leaning} one's "
            "(--side to change)"
        )
        return hand.called(hand.leaning)
    if len(own) == 2:
        raise InputError(
            "the file does not say which hand this is, and neither bends nor thumb tell: state it with --side"
        )
    notes.append(
        f"the file does not say which hand this is, and neither bends nor thumb tell: taken for a {own[0]} one, "
        "as the rig's (--side to change)"
    )
    return hand.called(own[0])


def _followed(hands: list[HandMotion], own: list[str], side: str | None, notes: list[str]) -> list[HandMotion]:
    """The recorded hands that are used."""
    if len(hands) > 1 and side is not None:
        hands = [hand for hand in hands if hand.side == side]
        if not hands:
            raise InputError(f"the recording has no {side} hand")
    elif len(hands) > 1 and len(own) == 1:
        left_out = [hand for hand in hands if hand.side not in own]
        if len(left_out) < len(hands):
            notes += [f"the recorded {hand.side} hand drives nothing: the rig has none" for hand in left_out]
            hands = [hand for hand in hands if hand.side in own]
    return hands


def _check_bends(hand: HandMotion, *, given: bool) -> tuple[str, ...]:
    """Reject hands with fingers bent backwards; warn of single joints that are, as tracking errs.

    A recording is rejected if its finger bends are plausible for the other hand, or if in a quarter of the frames at
    least three of the twelve joints violate their limits by more than 15°, or one by more than 45°.

    Raises:
        InputError: Such a recording, with its worst joint, frame and angle.
    """
    side = hand.side or ""
    excess = bent_beyond_limits(hand.bends, side)
    if not excess.any():
        return ()
    frame, f, k = np.unravel_index(int(excess.argmax()), excess.shape)
    angle = float(np.degrees(hand.bends[frame, f, k])) * (1.0 if side == "right" else -1.0)
    label = hand.labels[frame] if hand.labels else f"frame {frame}"
    worst = f"{side}.{FINGERS[f]}.{BENDING[k]} by {-angle:.0f}° at {label}"
    if bending_side(hand.bends) not in (None, side):
        doubt = "leave --side out, or give the other one" if given else "--side if the file is wrong"
        raise InputError(
            f"as a {side} hand its fingers bend backwards, worst {worst}: it looks like the other hand's ({doubt})"
        )
    often, far = ((excess > least).mean(axis=0) > _MOST_FRAMES for least in (0.0, _FAR))
    if np.count_nonzero(often) >= _MOST_JOINTS or far.any():
        raise InputError(
            f"its fingers bend backwards on either hand, worst {worst}: no hand's motion, or one of both hands in turn"
        )
    frames = int(np.count_nonzero(excess.any(axis=(1, 2))))
    return (f"fingers bend backwards beyond their limits in {frames} of {len(excess)} frames, worst {worst}",)
