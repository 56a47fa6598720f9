"""Grip searches during a solve: the smallest grip that holds an object, or the grip of a given force (R123, R124)."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace

from warpjld.fem.contact import ContactSolution
from warpjld.simulation.animation import AngleEdit
from warpjld.simulation.bodies.deformable_body import History
from warpjld.simulation.bodies.flesh_body import FleshBody
from warpjld.simulation.bodies.model import ContactModel
from warpjld.simulation.grip.balanced import BalancedGrip, balanced_grip, with_balance
from warpjld.simulation.grip.find_shared import find_shared
from warpjld.simulation.grip.force import ForceStatus, PressedForce, force_grip
from warpjld.simulation.grip.found import FoundGrip, SupportRelease, digits_that_press, trial_row
from warpjld.simulation.grip.hand_trials import HandTrials
from warpjld.simulation.grip.opposed import firmest_opposed, left_ratio, worst_opposed
from warpjld.simulation.grip.search import GripStatus, Trial, gentlest_grip
from warpjld.simulation.grip.search_budget import SearchBudget
from warpjld.simulation.grip.squeeze import Squeeze
from warpjld.simulation.report.balance import ObjectBalance
from warpjld.simulation.solve.handed_over import HandedOver
from warpjld.simulation.specification import GripSpecification
from warpjld.skeleton.channels import FLEXION

__all__ = ["find_grip"]

_START = math.radians(0.5)
"""First step of a search [rad]."""
_NEAR = 0.1
"""Tolerance of the smallest grip, relative to its force: a trial near the limit, where the object creeps, takes 50 to
100 linear solves."""

_CLOSING, _STEP = 450, 120
"""Most linear solves while all digits close alike until a force is reached, and of one load step of that: 80 to 130 and
5 to 10 as a rule, up to 30 where a step is halved."""
_REACHED = 0.03
"""Relative tolerance of a force that was asked for, as searches find it within 2 %."""
_TRIALS = 24
"""Most grips tried; as a rule four to eight are enough, and those that press too little take few linear solves."""

_HELD = (GripStatus.HELD, GripStatus.HELD_AT_ONCE, GripStatus.HELD_SO_FAR)
"""Statuses of a successful search."""


def find_grip(
    model: ContactModel,
    history: History,
    request: GripSpecification,
    after: ContactSolution,
    limits: Mapping[str, float],
    tell: Callable[[str], None] = lambda line: None,
) -> FoundGrip:
    """Search for a grip from the equilibrium at its first frame; Ctrl-C ends the search with the trials so far.

    Args:
        model: The contact model.
        history: History at that frame.
        request: Specification of the grip.
        after: Equilibrium at its first frame.
        limits: Digit → force limit that differs from the default [N].
        tell: Called with a line about every grip tried.
    """
    hand = next(one for one in model.hands if one.name == request.actor)
    if request.share:
        return find_shared(model, history, request, after, limits, tell)
    joints = [hand.bones.skeleton.index(channel.rpartition(".")[0]) for channel in request.channels]
    budget = SearchBudget() if request.lift else SearchBudget(_CLOSING, trial=_STEP)
    squeeze = Squeeze(model, history, hand, joints, after, limits, budget)
    squeeze.keep_bones_out(request.most)
    most = max(min(request.most, squeeze.room), 1e-6)
    found = _gentlest(request, squeeze, most, tell) if request.lift else _firm(request, squeeze, most, tell)
    if not request.lift and not request.digits and _may_oppose(request):
        return _opposed(found, request, squeeze, joints, tell)
    return replace(found, edits=_edits(squeeze, request, joints, found.grip))


def _may_oppose(request: GripSpecification) -> bool:
    """Whether digits that close can press against one another: the thumb and a finger. Fingers alone press on what
    bears it, as a table."""
    digits = {channel.split(".")[-3] for channel in request.channels}
    return "thumb" in digits and len(digits) > 1


def _opposed(
    found: FoundGrip,
    request: GripSpecification,
    squeeze: Squeeze,
    joints: Sequence[int],
    tell: Callable[[str], None],
) -> FoundGrip:
    """A grip found with equal closings; where it leaves a rigid object unbalanced, one that closes digit by digit, or
    as far as what the digits press with is opposed."""
    assert request.force is not None
    closed = squeeze.closed(found.grip)
    before = worst_opposed(squeeze.model, closed.last) if closed.converged and not found.interrupted else None
    if before is None:
        return replace(found, edits=_edits(squeeze, request, joints, found.grip))
    balanced = None
    if found.status in (ForceStatus.REACHED.name, ForceStatus.NO_SOLUTION.name):
        balanced = balanced_grip(request, squeeze, found.grip, before, joints, _START, tell)
    least = (1.0 - _REACHED) * request.force
    if balanced is None or balanced.forces.sum() < min(least, _bound(squeeze, before.object)):
        alike = _alike(found, request, squeeze, before, tell)
        if balanced is None or balanced.forces.sum() <= alike.force:
            return replace(alike, edits=_edits(squeeze, request, joints, alike.grip))
    if balanced.forces.sum() < least:
        status = ForceStatus.UNOPPOSED
        rows = tuple(one | {"status": status.name} for one in found.rows)
        text = f"{status.value}; {request.force:.3g} N asked for"
        found = replace(found, status=status.name, text=text, rows=rows)
    return replace(with_balance(found, balanced), edits=_closed_edits(squeeze.hand, request, balanced))


def _bound(squeeze: Squeeze, name: str) -> float:
    """Force of the gentlest known equal closing that leaves an object unbalanced: firmer ones are not balanced [N]."""
    for grip in squeeze.known:
        last = squeeze.closed(grip).last
        if left_ratio(squeeze.model, last, name) > 1.0:
            return sum(digit.force for digit in squeeze.effort(grip, last).digits)
    return math.inf


def _alike(
    found: FoundGrip,
    request: GripSpecification,
    squeeze: Squeeze,
    before: ObjectBalance,
    tell: Callable[[str], None],
) -> FoundGrip:
    """The firmest equal closings that leave the object balanced; without edits."""
    status = ForceStatus.UNOPPOSED
    grip = firmest_opposed(squeeze, before.object, found.grip, tell)
    effort = squeeze.effort(grip, squeeze.closed(grip).last)
    worst = max(effort.digits, key=lambda digit: digit.share)
    force = sum(digit.force for digit in effort.digits)
    text = (
        f"{status.value}; {request.force:.3g} N asked for, {force:.3g} N reached, closing on by "
        f"{math.degrees(grip):.2f}°; with {found.force:.3g} N {before.net:.3g} N would be left over on {before.object}"
    )
    row = trial_row(request, grip, PressedForce(force, worst.share, worst.digit), True, status.name)
    rows = [one | {"chosen": 0, "status": status.name} for one in found.rows if one["grip_deg"] != row["grip_deg"]]
    digits = digits_that_press(effort)
    return replace(found, status=status.name, text=text, grip=grip, force=force, digits=digits, rows=(*rows, row))


def _closed_edits(hand: FleshBody, request: GripSpecification, balanced: BalancedGrip) -> tuple[AngleEdit, ...]:
    """Edits that close every digit by its own angle."""
    flexions = balanced.angles[:, FLEXION]
    joints = (joint for one in balanced.joints for joint in one)
    return tuple(AngleEdit(hand.name, joint, request.first, None, float(flexions[joint])) for joint in joints)


def _edits(squeeze: Squeeze, request: GripSpecification, joints: Sequence[int], grip: float) -> tuple[AngleEdit, ...]:
    """Edits that close the digits by a grip, each as far as it may bend."""
    if grip == 0.0:
        return ()
    closed = squeeze.angles(grip)[:, FLEXION]
    return tuple(AngleEdit(squeeze.hand.name, joint, request.first, None, float(closed[joint])) for joint in joints)


def _gentlest(request: GripSpecification, squeeze: Squeeze, most: float, tell: Callable[[str], None]) -> FoundGrip:
    """Search for the smallest grip up to ``most`` [rad] that holds the object's weight."""
    model = squeeze.model
    one = next(body for body in model.objects if body.name == request.object)
    friction = max(
        pair.friction
        for pair, owner in zip(model.pairs, model.owners, strict=True)
        if owner.other(request.object) == request.actor
    )
    trials = HandTrials(squeeze, one)
    heavy = trials.weight.weight

    def hold(grip: float) -> Trial:
        trial = trials(grip)
        tell(f"{math.degrees(grip):.2f}°: {trial.force:.3g} N, {trial.outcome.value}")
        return trial

    start = min(_START, most)
    known = {"weight": heavy, "friction": friction, "start": start, "tolerance": _NEAR}
    found = gentlest_grip(hold, 0.0, most, **known, most=_TRIALS, exhausted=lambda: squeeze.budget.exhausted)
    taken = trials.taken(found.grip) if found.status in _HELD else None
    instant = trials.closed(found.grip).last if taken is None else taken[1]
    text = f"{heavy:.3g} N of {request.object}: {found.text}"
    if taken is not None:
        text += f"; the digits close on by {math.degrees(found.grip):.2f}°"
    text += f"; {found.ended}, with {squeeze.budget.spent} linear solves"
    effort = squeeze.effort(found.grip, instant) if instant.touches else None
    rows = [
        trial_row(request, grip, trial, grip == found.grip, found.status.name)
        | {"outcome": trial.outcome.name, "held": int(trial.held), "sliding": trial.sliding, "borne": trial.borne}
        for grip, trial in found.trials
    ]
    grip, lowered = (0.0, None) if taken is None else (found.grip, taken[0])
    release = over = None
    if taken is not None:
        first, middle, last = (frame - model.start for frame in (request.first, request.middle, request.last))
        release = SupportRelease(request.object, first, middle, last, trials.ride.least)
        over = HandedOver(request.actor, last, instant.displacement, trials.found[found.grip].states)
    status, force, digits = found.status.name, found.trial.force, digits_that_press(effort)
    return FoundGrip(request, status, text, grip, lowered, force, digits, tuple(rows), release=release, over=over)


def _firm(request: GripSpecification, squeeze: Squeeze, most: float, tell: Callable[[str], None]) -> FoundGrip:
    """Search for the grip up to ``most`` [rad] whose digits press with the requested force."""
    assert request.force is not None
    counted = request.digits or tuple(dict.fromkeys(channel.split(".")[-3] for channel in request.channels))

    def pressed(grip: float, closed: ContactSolution) -> PressedForce:
        effort = squeeze.effort(grip, closed.last)
        worst = max(effort.digits, key=lambda digit: digit.share)
        force = sum(digit.force for digit in effort.digits if digit.digit.rpartition(".")[2] in counted)
        tell(f"{math.degrees(grip):.2f}°: {force:.3g} N of {request.force:.3g} N")
        return PressedForce(force, worst.share, worst.digit)

    def close(grip: float) -> Iterator[tuple[float, PressedForce]]:
        for at, closed in squeeze.toward(grip):
            yield at, pressed(at, closed)

    found = force_grip(close, 0.0, most, request.force, exhausted=lambda: squeeze.budget.exhausted)
    text = f"{' + '.join(counted)}: {found.text}"
    if found.status is ForceStatus.REACHED:
        text += f"; they close on by {math.degrees(found.grip):.2f}°"
    effort = squeeze.effort(found.grip, squeeze.closed(found.grip).last) if found.trials else None
    rows = [trial_row(request, grip, one, grip == found.grip, found.status.name) for grip, one in found.trials]
    force = found.pressed.force if found.pressed is not None else 0.0
    return FoundGrip(request, found.status.name, text, found.grip, None, force, digits_that_press(effort), tuple(rows))
