"""One trial of a grasp study: a wrist is drawn beside the object, the hand closes, the grasp is measured."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from warpjld.grasp.close import close_hand
from warpjld.grasp.quality import Patches
from warpjld.skeleton import Poses, poses_from_angles
from warpjld.study.columns import Column
from warpjld.study.experiment import Outcome
from warpjld.study.grasping.choices import HandChoice, ObjectChoice
from warpjld.study.grasping.columns import GRASP_COLUMNS
from warpjld.study.grasping.load import SEGMENTS, Hand, Thing, hand_of, thing_of
from warpjld.study.grasping.measure import measure_grasp
from warpjld.study.grasping.plan import GraspPlan
from warpjld.study.grasping.wrist import Approach, draw_approach, place_palm, touch_along

__all__ = ["GraspExperiment"]

Array = NDArray[np.float64]

_CLEAR = 5e-4  # the open hand starts at least this far from the object [m]
_BACKED_OFF = 0.25  # a palm that cannot come nearer than this is not beside the object [m]


@dataclass(frozen=True)
class GraspExperiment:
    """The experiment of a plan, for `warpjld.study.run_study`."""

    settings: GraspPlan

    columns: ClassVar[tuple[Column, ...]] = GRASP_COLUMNS
    success: ClassVar[str] = "success"
    shown: ClassVar[tuple[str, ...]] = ("penetration", "epsilon", "area", "volume", "displacement", "overlap")
    groups: ClassVar[tuple[str, ...]] = ("hand", "object", "scale", "friction")

    @property
    def trials(self) -> int:
        """How many."""
        return self.settings.trials

    @property
    def seed(self) -> int:
        """Of the study."""
        return self.settings.seed

    def identity(self) -> dict[str, Any]:
        """See `GraspPlan.identity`."""
        return self.settings.identity()

    def plan(self, trial: int) -> dict[str, Any]:
        """What is known beforehand."""
        hand, thing, scale, friction = self.settings.combination(trial)
        return {"hand": hand.name, "object": thing.name, "scale": scale, "friction": friction}

    def check(self) -> list[str]:
        """Load everything once: better now than in the middle of a study. Returns what is worth knowing.

        Raises:
            InputError: A hand or object cannot be used.
        """
        notes = []
        for choice in self.settings.hands:
            notes += [f"{choice.name}: {note}" for note in self._hand(choice).rig.notes]
        for wanted in self.settings.objects:
            for scale in self.settings.scales:
                thing = self._thing(wanted, scale)
            notes += [f"{wanted.name}: {note}" for note in thing.body.report.notes()]
        return notes

    def begin(self) -> None:
        """Keep Warp's greeting off the output of a command that runs many workers."""
        import warp

        warp.config.log_level = warp.LOG_ERROR

    def run(self, trial: int, rng: np.random.Generator) -> Outcome:
        """Place, close, measure."""
        choice, wanted, scale, friction = self.settings.combination(trial)
        hand, thing = self._hand(choice), self._thing(wanted, scale)
        approach = draw_approach(self.settings.wrist, rng, thing.body.size)
        values: dict[str, Any] = dict(zip(("approach_x", "approach_y", "approach_z"), approach.direction, strict=True))
        values |= {"gap": approach.gap, "tilt": approach.tilt}
        start = approach.aim + 4.0 * thing.radius * approach.direction
        way = touch_along(thing.objects, start, -approach.direction, 8.0 * thing.radius)
        if way is None:
            return Outcome("missed", values, message="the line of approach passes beside the object")
        turn, shift = place_palm(hand.palm, approach, start + (approach.gap - way) * approach.direction)
        back = _room(hand, thing, turn, shift, approach)
        if back is None:
            return Outcome("no room", values, message="the open hand does not fit beside the object")
        values["gap"] = approach.gap + back
        shift = shift + back * approach.direction

        skeleton = hand.rig.skeleton
        root = skeleton.rest[0]
        position, rotation = (turn @ root + shift - root)[None], Rotation.from_matrix(turn).as_quat()[None]

        def posed(angles: Array) -> Poses:
            return poses_from_angles(skeleton, angles, root_position=position, root_rotation=rotation)

        open_hand = hand.opened[None]
        closed = close_hand(
            hand.covering, posed(open_hand), open_hand, thing.objects, digits=self.settings.digits, threads=1
        )
        poses = posed(closed.angles)
        wrist = poses.positions[0, skeleton.index("wrist")]
        values |= dict(zip(("wrist_x", "wrist_y", "wrist_z"), wrist, strict=True))
        vertices = hand.covering.deform(poses, threads=1)[0]
        measured, patches = measure_grasp(hand, thing, vertices, friction, self.settings.measuring)
        values |= measured
        pose = {"angles": closed.angles[0], "root_position": position[0], "root_rotation": rotation[0]}
        arrays = {f"{choice.name}/{name}": array for name, array in (pose | _by_segment(patches)).items()}
        return Outcome("closed" if closed.touching().any() else "no contact", values, arrays)

    def pictures(self, trial: int, outcome: Outcome, folder: Path) -> list[Path]:
        """Three views of the closed hand on its object, see `draw_grasp`."""
        from warpjld.study.grasping.pictures import draw_grasp

        choice, wanted, scale, _ = self.settings.combination(trial)
        return draw_grasp(self._hand(choice), self._thing(wanted, scale).body, trial, outcome, folder)

    def _hand(self, choice: HandChoice) -> Hand:
        return hand_of(choice, self.settings.posture)

    def _thing(self, choice: ObjectChoice, scale: float) -> Thing:
        return thing_of(choice, scale, self.settings.measuring.density)


def _room(hand: Hand, thing: Thing, turn: Array, shift: Array, approach: Approach) -> float | None:
    """How far the open hand must be moved back until it is clear of the object [m]; None if too far."""
    skin, back = hand.skin @ turn.T + shift, 0.0
    while back <= _BACKED_OFF:
        nearest = float(thing.objects.distances(skin + back * approach.direction, threads=1).distance.min())
        if nearest >= _CLEAR:
            return back
        # not nearer than this can it be clear: the object is that deep in the hand
        back += max(_CLEAR - nearest, 1e-4)
    return None


def _by_segment(patches: Patches) -> dict[str, Array]:
    """Patches in rows of ``SEGMENTS``, NaN where a segment does not touch."""
    rows = [SEGMENTS.index(name) for name in patches.names]
    out = {}
    for name, values in (
        ("contact_point", patches.points),
        ("contact_normal", patches.normals),
        ("skin_normal", patches.skin_normals),
        ("contact_area", patches.areas),
    ):
        out[name] = np.full((len(SEGMENTS), *values.shape[1:]), np.nan)
        out[name][rows] = values
    return out
