"""Free fall of unsupported objects before and after the frames solved as contact (B §3.4, R139)."""

from __future__ import annotations

from dataclasses import replace

from warpjld.errors import InputError
from warpjld.fem import SolveStatus
from warpjld.simulation.animation import Animation
from warpjld.simulation.fall.fall_path import fall_summaries
from warpjld.simulation.solve.fallen import (
    FallenAnimation,
    dropped_objects,
    fallen_start,
    moved_by,
    released_bodies,
    standing_objects,
    taking_part,
    without,
)
from warpjld.simulation.solve.falling import Falls, falling_names, follow_falls
from warpjld.simulation.solve.start_frame import StartFrame, find_start
from warpjld.simulation.solve_result import SolveResult
from warpjld.simulation.specification import BondStrength, ContactSpecification, SolveSpecification, located

__all__ = ["after_contact", "before_contact", "let_go"]


def before_contact(
    specification: ContactSpecification, animation: Animation, request: SolveSpecification
) -> tuple[ContactSpecification, Animation, StartFrame]:
    """Let unsupported deformable objects fall rigidly until they rest or touch a hand.

    Returns:
        The specification without bodies that take no part in contact, the animation with the falls applied, and the
        start frame of the contact solve.
    """
    names = falling_names(specification, request)
    if not names:
        return specification, animation, find_start(animation, specification, request)
    found = follow_falls(animation, specification, request, names)
    _refuse_turning(specification, found)
    paths, specification = found.paths, replace(specification, bonds=found.bonds)
    start = fallen_start(paths, float(request.first), float(request.last))
    stage, others = FallenAnimation(animation, paths), without(specification, names)
    before = StartFrame(start, {})
    if found.interrupted is not None:
        before = replace(before, start=found.interrupted, interrupted=found.interrupted)
    elif others.flesh or others.physical:
        before = find_start(stage, others, request, fell=True)
        before = replace(before, start=min(start, before.start))
    inside = taking_part(paths, before.start)
    outside = [name for name in names if name not in inside]
    if found.interrupted is not None:
        inside, outside = names, []
    if outside and not (inside or others.flesh or others.physical):
        inside, outside = names, []  # nothing else deforms, and no frame is left to solve
    moved = moved_by(paths, before, inside)
    return without(specification, outside), stage, replace(moved, falls=(*moved.falls, *found.openings))


def let_go(solved: SolveResult, specification: ContactSpecification, request: SolveSpecification) -> Falls | None:
    """Falls of objects that nothing holds any more, from the last solved frame on; None if there are none.

    That is so where a solve ended for that reason, and where points of objects that touch nothing are held no longer.
    Other objects stand as they were solved, unless points of them follow the animation.
    """
    weights = any(specification.pull) and request.method != "paper"
    model = solved.model
    if not weights or model.animation is None:
        return None
    first = solved.frames[-1].frame if solved.frames else solved.start
    held = replace(specification, bonds=_bonds_left(solved, specification))
    unheld = solved.status in (SolveStatus.UNHELD, SolveStatus.SLIDING)
    if not unheld and not (solved.converged and dropped_objects(model, solved.frames, held)):
        return None
    bodies = released_bodies(model, solved.frames, held, request.rate)
    if not bodies:
        return None
    standing = standing_objects(model, solved.frames, bodies)
    names, spins = list(bodies), {name: spin for name, spin in held.spins.items() if name not in bodies}
    falls = follow_falls(
        model.animation,
        replace(held, spins=spins),
        request,
        names,
        released=bodies,
        standing=standing,
        first=first,
    )
    turning = [name for name in names if name in held.spins and held.spins[name].at(first) != 0.0]
    said = (f"SPIN of {name} does not act while it falls: nothing holds its axis" for name in turning)
    return replace(falls, openings=(*falls.openings, *said))


def after_contact(solved: SolveResult, before: StartFrame) -> tuple[StartFrame, SolveResult]:
    """Add what fell during the contact solve, or after it where it could not go on. What rests and could not be solved
    at all stays rigid.

    Returns:
        The start frame extended by the falls, and the result with ``released`` set; both unchanged if nothing
        falls. Where Ctrl-C ended a fall, the result says so.
    """
    if before.interrupted is not None:
        return before, _stopped(solved, before.interrupted)
    if rigid := _rests_rigidly(solved, before):
        before = replace(before, falls=(*before.falls, rigid))
        solved = replace(solved, status=SolveStatus.CONVERGED, message=SolveStatus.CONVERGED.value, unsolved=None)
    found = [*solved.falls, *([] if solved.unsolved is None else [solved.unsolved])]
    found = [falls for falls in found if any(path.summary() for path in falls.paths.values())]
    moved, said = dict(before.moved), list(before.falls)
    for falls in found:
        for name, path in falls.paths.items():
            frames, places = moved.get(name, ([], []))
            moved[name] = ([*frames, *path.frames], [*places, *path.places])
        said += [*fall_summaries(falls.paths.values()), *falls.openings]
    if found and solved.released is None:
        solved = replace(solved, released=min(path.frames[0] for path in found[0].paths.values()))
    stopped = None if solved.unsolved is None else solved.unsolved.interrupted
    return replace(before, moved=moved, falls=tuple(said)), _stopped(solved, stopped)


def _refuse_turning(specification: ContactSpecification, found: Falls) -> None:
    """Reject a steady rotation of an object that falls.

    Raises:
        InputError: With the command's line, if there is one.
    """
    for name, path in found.paths.items():
        spin = specification.spins.get(name)
        if spin is None or not path.summary() or not any(spin.at(frame) for frame in path.frames):
            continue
        text = (
            f"SPIN {name}: nothing holds {name}, so that it falls or moves, and nothing holds the axis that it should "
            f"turn about: HOLD points of it, or let it rest where friction is enough"
        )
        raise located(InputError(text), spin.where)


def _stopped(solved: SolveResult, after: float | None) -> SolveResult:
    """The result of a run that Ctrl-C ended after a frame of a fall; unchanged if nothing did."""
    if after is None:
        return solved
    message = f"interrupted after frame {after:g}"
    return replace(solved, status=SolveStatus.STOPPED, message=message, interrupted=True)


def _bonds_left(solved: SolveResult, specification: ContactSpecification) -> list[BondStrength]:
    """Bonds that hold at the last solved frame, wholly or in part."""
    if not solved.frames:
        return specification.bonds
    shares = zip(solved.model.owners, solved.frames[-1].bonded, strict=True)
    parted = [{owner.slave, owner.master} for owner, share in shares if share == 0.0]
    return [bond for bond in specification.bonds if {bond.one, bond.other} not in parted]


def _rests_rigidly(solved: SolveResult, before: StartFrame) -> str:
    """Reason why fallen bodies at rest are shown rigid: how they give way to their own weight was not found.

    Returns:
        The text; empty if a frame was solved, the run was stopped, or anything else had to be solved.
    """
    model = solved.model
    fallen = all(one.name in before.moved and not one.states for one in model.objects)
    ended = solved.frames or solved.interrupted or solved.status in (SolveStatus.CONVERGED, SolveStatus.STOPPED)
    if ended or not before.falls or model.hands or not fallen or not model.pairs:
        return ""
    return f"how what rests gives way to its own weight was not found, and is not shown: {solved.status.value}"
