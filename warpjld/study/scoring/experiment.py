"""Grasps of others judged: the trials of a study whose hands are where somebody else put them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from warpjld.files.manifest import versions
from warpjld.study.experiment import Outcome
from warpjld.study.grasping.choices import HandChoice, ObjectChoice
from warpjld.study.grasping.columns import SCORE_COLUMNS
from warpjld.study.grasping.load import closer_of, device_identity, hand_of, thing_of
from warpjld.study.grasping.measure import measure_grasp
from warpjld.study.grasping.plan import COMPUTING, Measuring
from warpjld.study.grasping.variety import varieties
from warpjld.study.scoring.given import GivenGrasp
from warpjld.tables.columns import Column

__all__ = ["ScoreExperiment", "Scored"]


@dataclass(frozen=True, eq=False)
class Scored:
    """One grasp to be judged, with all that it wants.

    Attributes:
        grasp: As it was given.
        hand: Whose it is.
        thing: What is held.
        friction: Coulomb coefficient.
    """

    grasp: GivenGrasp
    hand: HandChoice
    thing: ObjectChoice
    friction: float


@dataclass(frozen=True, eq=False)
class ScoreExperiment:
    """Trial k is grasp k, for `warpjld.study.run_study`; nothing is drawn at random.

    Attributes:
        scored: The grasps.
        measuring: How they are measured.
        files: SHA-256 of the files they were read from, by name.
        device: Warp device of the covering.
    """

    scored: tuple[Scored, ...]
    measuring: Measuring
    files: tuple[tuple[str, str], ...]
    device: str = "cpu"

    columns: ClassVar[tuple[Column, ...]] = SCORE_COLUMNS
    success: ClassVar[str] = "success"
    shown: ClassVar[tuple[str, ...]] = ("penetration", "epsilon", "area", "volume", "displacement", "overlap")
    groups: ClassVar[tuple[str, ...]] = ("hand", "object", "scale", "friction")
    seed: ClassVar[int] = 0

    @property
    def trials(self) -> int:
        """How many grasps."""
        return len(self.scored)

    def identity(self) -> dict[str, Any]:
        """Hashes of all files, and settings."""
        hands = {one.hand.name: one.hand for one in self.scored}
        things = dict.fromkeys(one.thing for one in self.scored)
        return {
            "grasps": dict(self.files),
            "given": [[one.hand.name, one.thing.name, one.grasp.scale, one.friction] for one in self.scored],
            "hands": [hand.identity() for hand in hands.values()],
            "objects": [thing.identity() for thing in things],
            "measuring": vars(self.measuring),
            "versions": {name: versions([name])[name] for name in COMPUTING},
            **device_identity(self.device),
        }

    def plan(self, trial: int) -> dict[str, Any]:
        """What the file says."""
        one = self.scored[trial]
        named = {"hand": one.hand.name, "object": one.thing.name, "scale": one.grasp.scale}
        return {"grasp": one.grasp.name, **named, "friction": one.friction}

    def overall(self, rows: Sequence[dict[str, Any]], arrays: Mapping[str, NDArray[Any]]) -> dict[str, Any]:
        """Diversity of every hand's grasps."""
        return {"diversity": varieties(dict.fromkeys(one.hand for one in self.scored), rows, arrays)}

    def inputs(self) -> tuple[Path, ...]:
        """Files of hands and objects; the grasps are read already."""
        return tuple(dict.fromkeys(path for one in self.scored for path in (*one.hand.inputs(), *one.thing.inputs())))

    def moved(self, places: Mapping[Path, Path]) -> ScoreExperiment:
        """The same grasps, these files elsewhere."""
        moved = (replace(one, hand=one.hand.moved(places), thing=one.thing.moved(places)) for one in self.scored)
        return replace(self, scored=tuple(moved))

    def begin(self) -> None:
        """Keep Warp's remarks off the output."""
        from warpjld.runtime.quiet import silence_warp

        silence_warp()

    def run(self, trial: int, rng: np.random.Generator) -> Outcome:
        """Deform the skin, and measure."""
        one = self.scored[trial]
        hand, thing = hand_of(one.hand), thing_of(one.thing, one.grasp.scale, self.measuring.density)
        poses = one.grasp.poses(hand.rig.skeleton)
        values: dict[str, Any] = {}
        if poses is None:
            assert one.grasp.skin is not None
            skin = one.grasp.skin
        else:
            skin = hand.covering.deform(poses, device=self.device, threads=1)[0]
            wrist = one.grasp.place.to_local(poses.positions[0, [hand.rig.skeleton.index("wrist")]])[0, 0]
            values |= dict(zip(("wrist_x", "wrist_y", "wrist_z"), wrist, strict=True))
        local = skin if _stands_still(one.grasp) else one.grasp.place.to_local(skin)[0].astype(np.float32)
        both = closer_of(one.hand, one.thing, one.grasp.scale, self.measuring.density).both
        measured, patches = measure_grasp(hand, thing, both, local, one.friction, self.measuring)
        arrays = {} if one.grasp.angles is None else {f"{one.hand.name}/angles": one.grasp.angles}
        touches = len(patches) > 0
        return Outcome("scored" if touches else "no contact", {**values, **measured}, arrays, one.grasp.message)

    def check(self) -> tuple[list[str], list[str]]:
        """Load every hand and object once: notes on them, and what looks suspicious.

        Raises:
            InputError: One of them cannot be used.
        """
        notes, doubts = [], []
        for hand in {one.hand for one in self.scored}:
            rig = hand_of(hand).rig
            notes += [f"{hand.name}: {note}" for note in rig.notes]
            doubts += [f"{hand.name}: {doubt}" for doubt in rig.suspicious]
        for thing, scale in {(one.thing, one.grasp.scale): None for one in self.scored}:
            body = thing_of(thing, scale, self.measuring.density).body
            notes += [f"{thing.name}: {note}" for note in body.report.notes()]
        return notes, doubts

    def pictures(self, trial: int, outcome: Outcome, folder: Path) -> list[Path]:
        """None: a grasp's pose may not be known."""
        return []


def _stands_still(grasp: GivenGrasp) -> bool:
    place = grasp.place
    return not place.position.any() and bool((place.rotation == [[0.0, 0.0, 0.0, 1.0]]).all())
