"""A requested total force, distributed over digits such that they oppose each other on a rigid object (R112, R123).

Digits that all close by the same angle press with forces that need not balance: four fingers press an object against
nothing once they press harder than the thumb. Its placement is prescribed, and would bear what is left over. The forces
of the digits are therefore scaled such that their resultant force and moment become least (linear least squares with
bounds), and then each digit closes by the angle at which it presses with its own force (``share_force``).
"""

from __future__ import annotations

from collections.abc import Callable
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
from warpjld.simulation.grip.shared_force import PressedDigits, share_force
from warpjld.simulation.grip.squeeze import Squeeze
from warpjld.simulation.report.balance import ObjectBalance, balances
from warpjld.simulation.solve.solved_frame import solved_frame
from warpjld.simulation.specification import GripSpecification

__all__ = ["BalancedGrip", "balanced_grip", "opposed_scales", "with_balance"]

Array = NDArray[np.float64]

_LEAST, _MOST = 0.1, 10.0
"""Bounds of the factor on a digit's force: beyond them directions and places of the forces are not known."""
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
    joints: list[int],
    start: float,
    tell: Callable[[str], None],
) -> BalancedGrip | None:
    """Closings of the digits that balance a rigid object which equal closings leave unbalanced; None if it is balanced,
    or none are found that leave less over.

    Args:
        request: Specification of the grip, with its force.
        squeeze: Equal closings.
        grip: Equal closing that presses with that force [rad].
        joints: The joints that close.
        start: First step of a digit that does not press [rad].
        tell: Called with a line about every trial.
    """
    model, hand = squeeze.model, squeeze.hand
    closed = squeeze.closed(grip)
    before = _worst(model, closed.last) if closed.converged else None
    if before is None or not before.unbalanced:
        return None
    assert request.force is not None
    effort, names = squeeze.effort(grip, closed.last), hand.bones.skeleton.names
    parts: dict[str, list[int]] = {}
    for joint in joints:
        parts.setdefault(names[joint].rpartition(".")[0], []).append(joint)
    pressing = {digit: own for digit, own in parts.items() if effort[digit].force > _PRESSES * request.force}
    forces = np.array([effort[digit].force for digit in pressing])
    wrenches, rest = _wrenches(model, hand, closed.last, before, list(pressing))
    if len(pressing) < 2:
        return None
    scales = opposed_scales(wrenches, rest, forces, request.force)
    left = float(np.linalg.norm((scales @ wrenches + rest)[:3]))
    if not left < _LOWER * before.net:
        return None
    wanted = _SPARE * scales * forces
    each = DigitSqueeze(model, squeeze.history, hand, pressing, squeeze.first, squeeze.limits, wanted)

    def press(grips: Array) -> PressedDigits | None:
        pressed = each.press(grips)
        if pressed is not None:
            seen = zip(pressing, np.degrees(grips), pressed.forces, scales * forces, strict=True)
            tell("; ".join(f"{d.rpartition('.')[2]} {g:.2f}° {f:.3g} of {w:.3g} N" for d, g, f, w in seen))
        return pressed

    low, high = (np.clip(end, -request.most, request.most) for end in each.range)
    begin = np.full(len(pressing), grip)
    found = share_force(press, low, high, wanted, request.force, start=start, even=_EVEN, begin=begin)
    instant = each.known(found.grips)
    if instant is None or found.pressed is None or found.status not in (ForceStatus.REACHED, ForceStatus.UNEVEN):
        return None
    after = _worst(model, instant)
    if after is None or not after.net < _LOWER * before.net:
        return None
    effort, angles = each.effort(found.grips, instant), each.angles(found.grips)
    if max(one.share for one in effort.digits) > 1.0:
        return None
    return BalancedGrip(each.digits, each.joints, found.grips, found.pressed.forces, angles, effort, before, after)


def with_balance(found: FoundGrip, balanced: BalancedGrip) -> FoundGrip:
    """The grip found with equal closings, replaced by balanced ones; without edits."""
    text, digits = f"{found.text}; {balanced.text}", digits_that_press(balanced.effort)
    most, force = float(balanced.grips.max()), float(balanced.forces.sum())
    return replace(found, text=text, grip=most, force=force, digits=digits)


def _worst(model: ContactModel, instant: ContactInstant) -> ObjectBalance | None:
    """Balance of the rigid object with the largest resultant among those that only hands touch."""
    solved = solved_frame(model.start + instant.time, [instant])
    rigid = [one for one in balances(model, solved) if one.object in model.obstacles and one.grasped]
    return max(rigid, key=lambda one: one.net, default=None)


def _wrenches(
    model: ContactModel, hand: FleshBody, instant: ContactInstant, balance: ObjectBalance, digits: list[str]
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
