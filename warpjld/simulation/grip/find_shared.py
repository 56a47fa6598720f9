"""Search during a solve for closings of the digits at which all use the same share of their muscles (R118, R123)."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.fem.contact import ContactSolution
from warpjld.fem.hand.limits import force_limits
from warpjld.simulation.animation import AngleEdit
from warpjld.simulation.bodies.deformable_body import History
from warpjld.simulation.bodies.flesh_body import FleshBody
from warpjld.simulation.bodies.model import ContactModel
from warpjld.simulation.grip.digit_squeeze import DigitSqueeze
from warpjld.simulation.grip.force import PressedForce
from warpjld.simulation.grip.found import FoundGrip, digits_that_press, trial_row
from warpjld.simulation.grip.pressed_digits import PressedDigits
from warpjld.simulation.grip.search_budget import SearchBudget
from warpjld.simulation.grip.shared_force import SAME_CLOSING, SharedGrip, share_force
from warpjld.simulation.specification import GripSpecification, located
from warpjld.skeleton.channels import FLEXION

__all__ = ["find_shared"]

_START = math.radians(0.5)
"""First step of a digit that does not press [rad]; as in searches with one angle."""


def find_shared(
    model: ContactModel,
    history: History,
    request: GripSpecification,
    after: ContactSolution,
    limits: Mapping[str, float],
    tell: Callable[[str], None],
) -> FoundGrip:
    """Search for the closings at which the digits press with the requested force and equal shares of their muscles."""
    assert request.force is not None
    hand = next(one for one in model.hands if one.name == request.actor)
    wanted, joints = _sharing(hand, request), dict[str, list[int]]()
    for joint in (channel.rpartition(".")[0] for channel in request.channels):
        digit = joint.rpartition(".")[0]
        if digit.rpartition(".")[2] in wanted:
            joints.setdefault(digit, []).append(hand.bones.skeleton.index(joint))
    squeeze = DigitSqueeze(model, history, hand, joints, after, limits, SearchBudget())
    allowed = force_limits(limits)
    strengths = [allowed[digit.rpartition(".")[2]] for digit in joints]

    def press(grips: NDArray[np.float64]) -> PressedDigits | None:
        pressed = squeeze.press(grips)
        if pressed is not None:
            each = zip(joints, grips, pressed.forces, pressed.shares, strict=True)
            tell("; ".join(f"{d.rpartition('.')[2]} {math.degrees(g):.2f}° {f:.3g} N {s:.1%}" for d, g, f, s in each))
        return pressed

    low, high = squeeze.range(request.most)
    found = share_force(
        press, low, high, strengths, request.force, start=_START, touch=squeeze.touch, exhausted=squeeze.spent
    )
    instant = squeeze.known(found.grips)
    effort = squeeze.effort(found.grips, instant) if instant is not None and instant.touches else None
    rows = [
        trial_row(request, grip, PressedForce(force, share, digit), grips is found.grips, found.status.name)
        for grips, pressed in found.trials
        for digit, grip, force, share in zip(
            joints, grips.tolist(), pressed.forces.tolist(), pressed.shares.tolist(), strict=True
        )
    ]
    angles = squeeze.angles(found.grips)[:, FLEXION]
    edits = tuple(
        AngleEdit(hand.name, joint, request.first, None, float(angles[joint]))
        for one in joints.values()
        for joint in one
    )
    force = 0.0 if found.pressed is None else float(found.pressed.forces.sum())
    left = {list(joints)[k].rpartition(".")[2]: float(found.grips[k]) for k in found.left_out}
    on_bone = tuple(d for d, at in left.items() if at >= squeeze.bone_room.get(d, math.inf) - SAME_CLOSING)
    text, grip = _text(request.force, list(joints), found, on_bone), float(found.grips.max())
    edits = edits if found.grips.any() else ()
    each = digits_that_press(effort)
    short = tuple(left), on_bone
    return FoundGrip(request, found.status.name, text, grip, None, force, each, tuple(rows), edits, None, *short)


def _sharing(hand: FleshBody, request: GripSpecification) -> list[str]:
    """Digits that share the force: those that were named, or all that close and have flesh to press with.

    Raises:
        InputError: They have no flesh.
    """
    closing = list(dict.fromkeys(channel.split(".")[-3] for channel in request.channels))
    wanted = [digit for digit in request.digits or closing if hand.has_flesh(digit)]
    if bare := [digit for digit in request.digits if digit not in wanted]:
        raise located(InputError(f"{bare[0]} has no flesh that deforms, and so no share of the force"), request.where)
    if not wanted:
        raise located(InputError("no digit that closes has flesh that deforms: FLESH gives it"), request.where)
    return wanted


def _text(force: float, digits: Sequence[str], found: SharedGrip, on_bone: Sequence[str]) -> str:
    """Summary of a shared grip in one line."""
    names = [digit.rpartition(".")[2] for digit in digits]
    out = f"{' + '.join(names)}: {found.status.value}; {force:.3g} N asked for"
    if found.pressed is None:
        return out
    out += f", {found.pressed.forces.sum():.3g} N reached after {len(found.trials)} trials: "
    each = zip(names, found.pressed.forces, found.pressed.shares, found.grips, strict=True)
    out += ", ".join(f"{name} {f:.3g} N ({s:.1%} of its muscles, {math.degrees(g):+.2f}°)" for name, f, s, g in each)
    if found.left_out:
        left = [names[k] for k in found.left_out]
        short = ", ".join(f"{name} (its bone meets the object)" if name in on_bone else name for name in left)
        out += f"; without their share, as far as they may bend: {short}"
    return out
