"""A requested total force, distributed over digits such that they oppose each other on a rigid object (R112, R123).

Digits that all close by the same angle press with forces that need not balance: four fingers press an object against
nothing once they press harder than the thumb. Its placement is prescribed, and would bear what is left over. The forces
of the digits are therefore scaled such that their resultant force and moment become least (linear least squares with
bounds), and then each digit closes by the angle at which it presses with its own force (``share_force``).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from warpjld.fem.contact import ContactInstant
from warpjld.fem.hand.muscles import Effort
from warpjld.simulation.bodies.flesh_body import FleshBody
from warpjld.simulation.bodies.model import ContactModel
from warpjld.simulation.grip.digit_squeeze import DigitSqueeze
from warpjld.simulation.grip.force import ForceStatus
from warpjld.simulation.grip.found import FoundGrip, digits_that_press
from warpjld.simulation.grip.opposed import allowed_left, firmest_allowed, left_ratio, worst_opposed
from warpjld.simulation.grip.pressed_digits import PressedDigits
from warpjld.simulation.grip.search_budget import SearchBudget
from warpjld.simulation.grip.shared_force import share_force
from warpjld.simulation.grip.squeeze import Squeeze
from warpjld.simulation.report.balance import ObjectBalance
from warpjld.simulation.specification import GripSpecification

__all__ = ["BalancedGrip", "balanced_grip", "opposed_scales", "with_balance"]

Array = NDArray[np.float64]

_LEAST, _MOST = 0.1, 10.0
"""Bounds of the factor on a digit's force over that of all: beyond them directions and places of the forces are not
known. With a lower bound of 0.25 an index finger pressed a box more than it should, and slid with all of its skin."""
_RELUCTANCE = 0.05
"""Weight of keeping a digit's force, over that of balance."""
_TOTAL = 30.0
"""Weight of the total force, over that of balance: nearly a constraint."""
_PRESSES = 0.02
"""Force of a digit over the total above which it presses: flesh between two digits transmits a little to both."""
_LOWER = 0.9
"""Resultant over that of equal closings below which a distribution counts as better."""
_EVEN = 0.25
"""Largest relative error of a digit's force: those of weak digits, which hardly matter, would take most trials."""
_ROUNDS = 2
"""Most distributions: directions of forces change as digits close, and are not known before a digit presses."""
_REACHED = 1.03
"""Force over the one asked for that counts as the same, as searches find it within 2 %."""
_SHORT = 0.97
"""Force over the one asked for below which a part of closings that are not balanced is looked for."""
_ASKED = 0.02
"""Relative difference from the force asked for within which a grip presses with it."""
_SPARE = 2.0
"""Force at which the share of a digit is 1, over the force it should have: shares stay below 1, as those of muscles."""


@dataclass(frozen=True, eq=False)
class BalancedGrip:
    """Closings of the digits found, and the angles that they mean.

    Attributes:
        digits: Names of the digits that close.
        joints: Joints of each.
        grips: Closing of each [rad], shape (D,).
        forces: Force of each [N], shape (D,).
        angles: Joint angles at these closings [rad], shape (J, 4).
        effort: Effort of the muscles there.
        before, after: Balance of the object with equal closings, and with these.
    """

    digits: tuple[str, ...]
    joints: list[list[int]]
    grips: Array
    forces: Array
    angles: Array
    effort: Effort
    before: ObjectBalance
    after: ObjectBalance

    @property
    def text(self) -> str:
        """Closings, and what is left over on the object, in words."""
        each = zip(self.digits, np.degrees(self.grips), self.forces, strict=True)
        closed = ", ".join(f"{digit.rpartition('.')[2]} {grip:+.2f}° {force:.3g} N" for digit, grip, force in each)
        return (
            f"closed digit by digit, to balance {self.before.object}: {closed}; {self.after.net:.3g} N are left over, "
            f"{self.before.net:.3g} N if all joints close alike"
        )


def opposed_scales(wrenches: Array, rest: Array, forces: Array, force: float) -> Array:
    """Factors on the digits' forces at which these sum to ``force`` and their resultant is least, shape (D,).

    Args:
        wrenches: Force [N] and moment over the object's size [N] of every digit on the object, shape (D, 6).
        rest: The same of all other bodies, shape (6,).
        forces: What every digit presses with, shape (D,) [N], above 0.
        force: Wanted sum [N].
    """
    start = np.full(len(forces), force / float(forces.sum()))
    matrix = np.vstack([wrenches.T / force, _RELUCTANCE * np.diag(forces) / force, _TOTAL * forces[None] / force])
    wanted = np.concatenate([-rest / force, _RELUCTANCE * forces * start / force, [_TOTAL]])
    found = lsq_linear(matrix, wanted, bounds=(_LEAST * start, _MOST * start))
    return np.asarray(found.x * force / float(found.x @ forces))


def balanced_grip(
    request: GripSpecification,
    squeeze: Squeeze,
    grip: float,
    before: ObjectBalance,
    joints: Sequence[int],
    start: float,
    tell: Callable[[str], None],
) -> BalancedGrip | None:
    """Closings of the digits that balance a rigid object which equal closings leave unbalanced, with the force of the
    request, or else with the largest that was found; None if none of those tried balance it.

    Args:
        request: Specification of the grip, with its force.
        squeeze: Equal closings.
        grip: Equal closing that presses with that force [rad].
        before: Balance of the object there.
        joints: The joints that close.
        start: First step of a digit that does not press [rad].
        tell: Called with a line about every trial.
    """
    model, hand, force = squeeze.model, squeeze.hand, request.force
    assert force is not None
    closed, balance = squeeze.closed(grip), before
    effort, instant = squeeze.effort(grip, closed.last), closed.last
    taking = _taking_part(hand, joints, effort, force)
    each = DigitSqueeze(model, squeeze.history, hand, taking, squeeze.first, squeeze.limits, SearchBudget())
    low, high = each.range(request.most)
    high[each.touch > high] = 0.0  # a digit that touches nothing stays as it is
    grips, last = np.full(len(taking), grip), None
    for alike in squeeze.known:
        each.note(np.full(len(taking), alike), squeeze.angles(alike), squeeze.closed(alike))
    for _ in range(_ROUNDS if len(taking) > 1 else 0):
        wanted = _distributed(model, hand, instant, balance, effort, each.digits, force)
        if wanted is None:
            break
        each.wanted = _SPARE * wanted
        press, strengths, touch = _telling(each, wanted, tell), each.wanted, each.touch
        spent = each.spent
        found = share_force(
            press, low, high, strengths, force, start=start, even=_EVEN, begin=grips, touch=touch, exhausted=spent
        )
        there = each.known(found.grips)
        if there is None or found.status not in (ForceStatus.REACHED, ForceStatus.UNEVEN):
            break
        effort, instant, grips = each.effort(found.grips, there), there, found.grips
        last = grips
        after = worst_opposed(model, instant, before.object)
        if after is None or max(one.share for one in effort.digits) > 1.0 or not after.net < _LOWER * balance.net:
            break
        if after.net <= allowed_left(after):
            break
        balance = after
    best = _firmest(each, before, force)
    if last is not None and (best is None or best.forces.sum() < _SHORT * force):
        _ease(each, last, before.object, tell)
        best = _firmest(each, before, force)
    return best


def _ease(each: DigitSqueeze, grips: Array, name: str, tell: Callable[[str], None]) -> None:
    """Look for the firmest part of closings (D,) [rad] at which a rigid object is balanced, as they come nearer to that
    than equal ones."""

    def ratio(part: float) -> float:
        return left_ratio(each.model, each.solved_at(part * grips), name)

    def say(part: float, found: float) -> None:
        tell(f"{100.0 * part:.0f} % of these closings: {found:.2f} of what may be left over on {name}")

    firmest_allowed(ratio, [0.0, 1.0], 1.0, say)


def _firmest(each: DigitSqueeze, before: ObjectBalance, force: float) -> BalancedGrip | None:
    """The grip found that balances the object and presses with ``force`` [N], and of those the best balanced one; or
    else the one that presses with most, but not with more than that, or than muscles can; None if there is none."""
    best: BalancedGrip | None = None
    most = (False, 0.0)
    for grips, instant in each.found:
        after = worst_opposed(each.model, instant, before.object)
        if after is None or after.net > allowed_left(after):
            continue
        effort = each.effort(grips, instant)
        forces = np.array([effort[digit].force for digit in each.digits])
        over = forces.sum() > _REACHED * force or max(one.share for one in effort.digits) > 1.0
        as_asked = bool(abs(forces.sum() / force - 1.0) <= _ASKED)
        good = (as_asked, -after.net if as_asked else float(forces.sum()))
        if not over and (best is None or good > most):
            most = good
            best = BalancedGrip(each.digits, each.joints, grips, forces, each.angles(grips), effort, before, after)
    return best


def _taking_part(hand: FleshBody, joints: Sequence[int], effort: Effort, force: float) -> dict[str, list[int]]:
    """Joints of the digits that press, and of those that would oppose them: the thumb, or the fingers if only the thumb
    presses."""
    parts: dict[str, list[int]] = {}
    for joint in joints:
        parts.setdefault(hand.bones.skeleton.names[joint].rpartition(".")[0], []).append(joint)
    parts = {digit: own for digit, own in parts.items() if hand.has_flesh(digit.rpartition(".")[2])}
    thumbs = {digit for digit in parts if digit.rpartition(".")[2] == "thumb"}
    pressing = {digit for digit in parts if effort[digit].force > _PRESSES * force}
    for one, other in ((thumbs, set(parts) - thumbs), (set(parts) - thumbs, thumbs)):
        if pressing and pressing <= one:
            pressing |= other
    return {digit: own for digit, own in parts.items() if digit in pressing}


def _distributed(
    model: ContactModel,
    hand: FleshBody,
    instant: ContactInstant,
    balance: ObjectBalance,
    effort: Effort,
    digits: Sequence[str],
    force: float,
) -> Array | None:
    """Forces of the digits, with the sum ``force``, for balance [N], shape (D,); None if they would not lower what is
    left over. Those that do not press yet are assumed to oppose it."""
    forces = np.array([effort[digit].force for digit in digits])
    wrenches, rest = _wrenches(model, hand, instant, balance, digits)
    idle = forces <= _PRESSES * force
    forces[idle] = force / len(forces)
    opposing = np.append(-balance.force / max(balance.net, 1e-300), np.zeros(3))
    wrenches[idle] = forces[idle, None] * opposing
    scales = opposed_scales(wrenches, rest, forces, force)
    left = float(np.linalg.norm((scales @ wrenches + rest)[:3]))
    return scales * forces if left < _LOWER * balance.net else None


def _telling(each: DigitSqueeze, wanted: Array, tell: Callable[[str], None]) -> Callable[[Array], PressedDigits | None]:
    """Forces at closings, told as they are found."""

    def press(grips: Array) -> PressedDigits | None:
        pressed = each.press(grips)
        if pressed is not None:
            seen = zip(each.digits, np.degrees(grips), pressed.forces, wanted, strict=True)
            tell("; ".join(f"{d.rpartition('.')[2]} {g:.2f}° {f:.3g} of {w:.3g} N" for d, g, f, w in seen))
        return pressed

    return press


def with_balance(found: FoundGrip, balanced: BalancedGrip) -> FoundGrip:
    """The grip found with equal closings, replaced by balanced ones."""
    text, digits = f"{found.text}; {balanced.text}", digits_that_press(balanced.effort)
    most, force = float(balanced.grips.max()), float(balanced.forces.sum())
    return replace(found, text=text, grip=most, force=force, digits=digits)


def _wrenches(
    model: ContactModel, hand: FleshBody, instant: ContactInstant, balance: ObjectBalance, digits: Sequence[str]
) -> tuple[Array, Array]:
    """Force [N] and moment over size [N] of every digit on an object, shape (D, 6), and of all that is left, (6,)."""
    x = model.body.mesh.nodes + instant.displacement
    push = np.zeros_like(x)
    for owner, touch in zip(model.owners, instant.touches, strict=True):
        if owner.master == balance.object:
            push -= touch.nodal
    size = np.linalg.norm(push, axis=1)
    arm = x - size @ x / size.sum()
    long = max(float(np.sqrt(size @ np.einsum("ni,ni->n", arm, arm) / size.sum())), 1e-9)
    each = np.concatenate([push, np.cross(arm, push) / long], axis=1)
    span, names = model.spans[hand.name], hand.node_digits
    wrenches = np.array([each[span][names == digit.rpartition(".")[2]].sum(axis=0) for digit in digits])
    return wrenches.reshape(-1, 6), each.sum(axis=0) - wrenches.reshape(-1, 6).sum(axis=0)
