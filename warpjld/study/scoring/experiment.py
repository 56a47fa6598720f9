"""Scoring of given grasps as an experiment: each trial measures one grasp."""

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
from warpjld.study.grasping.tried import touching_skins
from warpjld.study.grasping.variety import varieties
from warpjld.study.scoring.given import GivenGrasp
from warpjld.tables.columns import Column

__all__ = ["ScoreExperiment", "Scored"]


@dataclass(frozen=True, eq=False)
class Scored:
    """One grasp to be scored, with its hand and object.

    Attributes:
        grasp: The grasp as read.
        hand: The hand.
        thing: The object.
        friction: Coulomb coefficient.
    """

    grasp: GivenGrasp
    hand: HandChoice
    thing: ObjectChoice
    friction: float


@dataclass(frozen=True, eq=False)
class ScoreExperiment:
    """Experiment for `warpjld.study.run_study` in which trial k measures grasp k; nothing is random.

    Attributes:
        scored: The grasps.
        measuring: Settings of the metrics.
        files: Name and SHA-256 of the files they were read from.
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
        """Number of grasps."""
        return len(self.scored)

    def identity(self) -> dict[str, Any]:
        """Hashes of all files, and settings."""
        hands = {item.hand.name: item.hand for item in self.scored}
        things = dict.fromkeys(item.thing for item in self.scored)
        return {
            "grasps": dict(self.files),
            "given": [[item.hand.name, item.thing.name, item.grasp.scale, item.friction] for item in self.scored],
            "hands": [hand.identity() for hand in hands.values()],
            "objects": [thing.identity() for thing in things],
            "measuring": vars(self.measuring),
            "versions": {name: versions([name])[name] for name in COMPUTING},
            **device_identity(self.device),
        }

    def plan(self, trial: int) -> dict[str, Any]:
        """Columns that are known before the trial."""
        scored = self.scored[trial]
        named = {"hand": scored.hand.name, "object": scored.thing.name, "scale": scored.grasp.scale}
        return {"grasp": scored.grasp.name, **named, "friction": scored.friction}

    def overall(self, rows: Sequence[dict[str, Any]], arrays: Mapping[str, NDArray[Any]]) -> dict[str, Any]:
        """Diversity of every hand's grasps."""
        return {"diversity": varieties(dict.fromkeys(item.hand for item in self.scored), rows, arrays)}

    def inputs(self) -> tuple[Path, ...]:
        """Files of hands and objects; the grasps have been read already."""
        paths = (path for item in self.scored for path in (*item.hand.inputs(), *item.thing.inputs()))
        return tuple(dict.fromkeys(paths))

    def moved(self, places: Mapping[Path, Path]) -> ScoreExperiment:
        """Copy that reads its files from other paths."""
        moved = (replace(item, hand=item.hand.moved(places), thing=item.thing.moved(places)) for item in self.scored)
        return replace(self, scored=tuple(moved))

    def begin(self) -> None:
        """Silence Warp's messages in a worker."""
        from warpjld.runtime.quiet import silence_warp

        silence_warp()

    def run(self, trial: int, rng: np.random.Generator) -> Outcome:
        """Deform the skin, and measure."""
        scored = self.scored[trial]
        grasp = scored.grasp
        hand, thing = hand_of(scored.hand), thing_of(scored.thing, grasp.scale, self.measuring.density, self.device)
        poses = grasp.poses(hand.rig.skeleton)
        values: dict[str, Any] = {}
        if poses is None:
            assert grasp.skin is not None
            skin = grasp.skin
        else:
            skin = hand.covering.deform(poses, device=self.device, threads=1)[0]
            wrist = grasp.place.to_local(poses.positions[0, [hand.rig.skeleton.index("wrist")]])[0, 0]
            values |= dict(zip(("wrist_x", "wrist_y", "wrist_z"), wrist, strict=True))
        local = skin if _at_origin(grasp) else grasp.place.to_local(skin)[0].astype(np.float32)
        both = closer_of(scored.hand, scored.thing, grasp.scale, self.measuring.density, self.device).both
        (touching,) = touching_skins(hand, thing, local[None], self.measuring.contact)
        measured = measure_grasp(hand, thing, both, touching, scored.friction, self.measuring)
        arrays = {} if grasp.angles is None else {f"{scored.hand.name}/angles": grasp.angles}
        touches = len(touching.patches) > 0
        return Outcome("scored" if touches else "no contact", {**values, **measured}, arrays, grasp.message)

    def check(self) -> tuple[list[str], list[str]]:
        """Load every hand and object once: notes on them, and warnings about what looks suspicious.

        Raises:
            InputError: One of them cannot be used.
        """
        notes, doubts = [], []
        for hand in {item.hand for item in self.scored}:
            rig = hand_of(hand).rig
            notes += [f"{hand.name}: {note}" for note in rig.notes]
            doubts += [f"{hand.name}: {doubt}" for doubt in rig.suspicious]
        for thing, scale in {(item.thing, item.grasp.scale): None for item in self.scored}:
            body = thing_of(thing, scale, self.measuring.density, self.device).body
            notes += [f"{thing.name}: {note}" for note in body.report.notes()]
        return notes, doubts

    def pictures(self, trial: int, outcome: Outcome, folder: Path) -> list[Path]:
        """Draws nothing, since the pose of a given grasp may be unknown."""
        return []


def _at_origin(grasp: GivenGrasp) -> bool:
    """Whether the object's placement is the identity."""
    place = grasp.place
    return not place.position.any() and bool((place.rotation == [[0.0, 0.0, 0.0, 1.0]]).all())
