"""Contact of a scene: bodies as the script has them at the first moment, solved over its frames, and reported."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.simulation.specification import placed
from warpjld.simulation.specification import ContactWishes, GripWish, Pressing
from warpjld.simulation.solve.start_frame import approach
from warpjld.script.binding import cover
from warpjld.script.press_bodies import hand_body, object_body, prop_obstacle
from warpjld.script.press_checks import check_wishes
from warpjld.script.press_keys import corrected_keys, gripped_keys
from warpjld.simulation.report.table import PressRows
from warpjld.script.staging import stage

if TYPE_CHECKING:
    from warpjld.fem.contact import ContactSolution
    from warpjld.simulation.report.tactile import Tactile
    from warpjld.simulation.bodies.model import Bodies
    from warpjld.simulation.grip.find import FoundGrip
    from warpjld.simulation.display.surfaces import Pressed
    from warpjld.simulation.report.table import Row
    from warpjld.simulation.report.verdict import Verdict
    from warpjld.script.scene import Scene

__all__ = ["PressReport", "run_press"]

Report = Callable[[str, int, int], None]


@dataclass(eq=False)
class PressReport:
    """What came of ``PRESS``.

    Attributes:
        pressed: Shapes and pressures.
        rows: The table.
        verdict: In words.
        grips: Grips that were searched for.
        notes: What was found on the way.
    """

    pressed: Pressed
    rows: list[Row]
    verdict: Verdict
    grips: list[FoundGrip] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def tactile(self, actor: str) -> Tactile:
        """What the pads of an actor feel at the frames that were solved.

        Raises:
            InputError: Its flesh was not solved, or no frame was.
        """
        from warpjld.simulation.report.tactile_readings import felt

        hands = [hand for hand in self.pressed.bodies.hands if hand.name == actor]
        if not hands:
            raise InputError(f"{actor} has no flesh that feels: FLESH {actor} makes it so")
        if not self.pressed.solved.frames:
            raise InputError(f"{actor} feels nothing: {self.pressed.solved.message}")
        return felt(self.pressed.bodies, hands[0], self.pressed.solved.frames)


def run_press(scene: Scene, folder: Path, progress: Report = lambda what, done, total: None) -> PressReport:
    """Do what ``PRESS`` asks for; grips that are found, and angles that are corrected, become keys of their actors.

    Raises:
        InputError: Bodies that cannot be meshed or driven; names the command's line.
    """
    pressing = scene.contact.pressing
    assert pressing is not None
    try:
        return _run(scene, pressing, folder, progress)
    except InputError as error:
        raise placed(error, pressing.where) from error


def _run(scene: Scene, pressing: Pressing, folder: Path, progress: Report) -> PressReport:
    from warpjld.simulation.bodies.model import assemble
    from warpjld.simulation.solve.checks import refuse_hopeless
    from warpjld.simulation.solve.identity import identity_of
    from warpjld.simulation.grip.correct_frames import Mending
    from warpjld.simulation.display.surfaces import Pressed
    from warpjld.simulation.solve.frames import solve_frames
    from warpjld.simulation.report.visible_overlap import missed, seen
    from warpjld.simulation.report.verdict import verdict_of

    wishes = scene.contact
    check_wishes(scene, pressing)
    progress("looking for the first touch", 0, 1)
    before = approach(scene, pressing)
    start = before.start
    notes = before.notes()
    progress("meshing", 0, 1)
    hands = [hand_body(scene, scene.actor(name), wish, start, notes) for name, wish in wishes.flesh.items()]
    objects = [object_body(scene, scene.prop(name), start, before.place(name)) for name in wishes.physical]
    rigid = [prop for prop in scene.props.values() if prop.name not in wishes.physical]
    obstacles = {prop.name: prop_obstacle(scene, prop, start) for prop in rigid}
    bodies = assemble(hands, objects, obstacles, wishes, start=start)
    refuse_hopeless(bodies, wishes)
    table = PressRows(scene, bodies)
    grips: list[FoundGrip] = []
    mending = Mending(bodies, wishes.strength, lambda *change: corrected_keys(scene, start, *change))
    frames = _frames(pressing, wishes, start)
    solved = solve_frames(
        bodies,
        start,
        frames,
        method=pressing.method,
        aitken=pressing.aitken,
        watch=table.take if pressing.stop else table.note,
        mend=mending if pressing.correct else None,
        pauses=_pauses(scene, bodies, grips),
        state=None if pressing.state is None else folder / pressing.state,
        identity=None if pressing.state is None else identity_of(bodies, wishes, frames),
        progress=progress,
    )
    notes += table.notes()
    if solved.resumed:
        notes.append(f"{solved.resumed} of {len(solved.frames)} frames were in {pressing.state} already")
    pushed = {name: (np.array(frames), places) for name, (frames, places) in before.moved.items()}
    shapes = {name: scene.prop(name).thing.vertices for name in pushed}

    def covered(actor: str, frame: float) -> NDArray[np.floating]:
        one = scene.actor(actor)
        return np.asarray(cover(one).deform(stage(one, np.array([frame]), scene.rate))[0])

    pressed = Pressed(bodies, solved, covered, pushed, shapes)
    verdict = verdict_of(solved, table.rows, table.suggestions(), missed(pressed))
    verdict = replace(
        verdict,
        text="; ".join([verdict.text, *before.notes()]),
        grips=tuple(f"{one.wish.actor} at frame {one.wish.first:g}: {one.text}" for one in grips),
        corrections=(*(one.text for one in mending.worst), *mending.failed),
    )
    notes += [brush.text for brush in solved.brushes]
    if solved.frames:
        notes += seen(pressed, solved.frames[-1].frame)
    return PressReport(pressed, table.rows, verdict, grips, notes)


def _frames(pressing: Pressing, wishes: ContactWishes, start: float) -> list[float]:
    """Frames to solve: every so many, the last, and those at which a grip begins or ends."""
    frames = {float(f) for f in range(pressing.first, pressing.last + 1, pressing.every)} | {float(pressing.last)}
    for wish in wishes.grips:
        frames |= {wish.first, wish.middle, wish.last}
    return sorted(f for f in frames if f > start)


def _pauses(scene: Scene, bodies: Bodies, found: list[FoundGrip]) -> dict[float, Callable[[ContactSolution], None]]:
    """What to do at frames at which grips are searched for."""
    from warpjld.simulation.grip.find import find_grip

    def search(wish: GripWish, solution: ContactSolution) -> None:
        grip = find_grip(bodies, wish, solution, scene.contact.strength.get(wish.actor, {}))
        found.append(grip)
        gripped_keys(scene.actor(wish.actor), grip)
        for hand in bodies.hands:
            hand.drive.changed()
        for one in bodies.objects:
            if wish.lift and one.name == wish.object and one.support is not None and grip.lowered is not None:
                begins, free = wish.middle - bodies.start, wish.last - bodies.start
                one.support.release(begins, free, grip.lowered)

    pauses: dict[float, Callable[[ContactSolution], None]] = {}
    for wish in scene.contact.grips:
        pauses[wish.first] = partial(search, wish)
    return pauses
