"""Trials of a grasp study: draw a placement of the open hand, close the hand, measure the grasp."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from warpjld.errors import InputError
from warpjld.geometry.ray import ray_hit
from warpjld.grasp.close import Closer
from warpjld.grasp.find_grasp import find_grasp
from warpjld.grasp.hand_scale import doubt_of_size, hand_length
from warpjld.grasp.postures import posture_for
from warpjld.grasp.quality import ContactPatches
from warpjld.grasp.segments import SEGMENTS
from warpjld.skeleton import poses_from_angles
from warpjld.study.experiment import Outcome, generator
from warpjld.study.grasping.choices import HandChoice, ObjectChoice
from warpjld.study.grasping.columns import GRASP_COLUMNS, PRESSED_COLUMNS
from warpjld.study.grasping.load import Hand, Thing, closer_of, device_identity, hand_of, opened_hand, thing_of
from warpjld.study.grasping.measure import measure_grasp
from warpjld.study.grasping.plan import GraspPlan
from warpjld.study.grasping.tried import OpenHand, PosedHand, TriedHand, posed_hands
from warpjld.study.grasping.variety import varieties
from warpjld.study.grasping.wrist import backed_off, draw_approach, place_palm
from warpjld.tables.columns import Column

__all__ = ["GraspExperiment"]

Array = NDArray[np.float64]

_GROUPS = ("hand", "object", "scale", "friction")
_SHOWN = ("penetration", "epsilon", "area", "volume", "displacement", "overlap")
_SHOWN_PRESSED = ("force", "normal_force", "pressed_area", "peak_pressure", "muscle_share", "epsilon")


@dataclass(frozen=True)
class GraspExperiment:
    """Experiment of a grasp plan, for `warpjld.study.run_study`.

    Attributes:
        settings: The plan.
        device: Warp device of closing hands, distances to objects and the covering of closed hands.
    """

    settings: GraspPlan
    device: str = "cpu"
    _ahead: dict[int, tuple[TriedHand, PosedHand] | Outcome] = field(default_factory=dict, compare=False, repr=False)

    success: ClassVar[str] = "success"

    @property
    def columns(self) -> tuple[Column, ...]:
        """Columns of the table: those of grasps, and those of contact if it is solved."""
        return (*GRASP_COLUMNS, *(() if self.settings.pressing is None else PRESSED_COLUMNS))

    @property
    def shown(self) -> tuple[str, ...]:
        """Columns shown in summaries: those of contact if it is solved, else those of grasps."""
        return _SHOWN if self.settings.pressing is None else _SHOWN_PRESSED

    @property
    def groups(self) -> tuple[str, ...]:
        """Columns whose values the plan combines."""
        return (*_GROUPS, *(() if self.settings.pressing is None else ("weight",)))

    @property
    def trials(self) -> int:
        """Number of trials."""
        return self.settings.trials

    @property
    def seed(self) -> int:
        """Seed of the study."""
        return self.settings.seed

    def identity(self) -> dict[str, Any]:
        """Identity of the plan (see `GraspPlan.identity`) and of the device, whose last bits may differ."""
        return self.settings.identity() | device_identity(self.device)

    def overall(self, rows: Sequence[dict[str, Any]], arrays: Mapping[str, NDArray[Any]]) -> dict[str, Any]:
        """Diversity of every hand's grasps."""
        return {"diversity": varieties(self.settings.hands, rows, arrays)}

    def inputs(self) -> tuple[Path, ...]:
        """Files of hands and objects."""
        hands = (path for hand in self.settings.hands for path in hand.inputs())
        return (*hands, *(path for thing in self.settings.objects for path in thing.inputs()))

    def moved(self, places: Mapping[Path, Path]) -> GraspExperiment:
        """Copy that reads its files from other paths."""
        hands = tuple(hand.moved(places) for hand in self.settings.hands)
        objects = tuple(thing.moved(places) for thing in self.settings.objects)
        return replace(self, settings=replace(self.settings, hands=hands, objects=objects))

    def plan(self, trial: int) -> dict[str, Any]:
        """Columns that are known before the trial."""
        hand, thing, scale, friction = self.settings.combination(trial)
        weight = {} if self.settings.pressing is None else {"weight": self.settings.weight(trial)}
        return {"hand": hand.name, "object": thing.name, "scale": scale, "friction": friction, **weight}

    def check(self) -> list[str]:
        """Load all hands and objects once, to find errors before the study; returns notes on them.

        Raises:
            InputError: A hand or object cannot be used.
        """
        notes = []
        for choice in self.settings.hands:
            notes += [f"{choice.name}: {note}" for note in hand_of(choice).rig.notes]
            if self.settings.posture != "auto":
                opened_hand(choice, self.settings.posture)
        for wanted in self.settings.objects:
            for scale in self.settings.scales:
                thing = self._thing(wanted, scale)
            notes += [f"{wanted.name}: {note}" for note in thing.body.report.notes()]
        return notes

    def doubts(self) -> list[str]:
        """Warnings about suspicious inputs: a hand's size, doubtful joints, objects that may be in another unit.

        Raises:
            InputError: A hand or object cannot be used.
        """
        found = [f"{hand.name}: {doubt}" for hand in self.settings.hands for doubt in hand_of(hand).rig.suspicious]
        lengths = [hand_length(hand_of(hand).rig.skeleton) for hand in self.settings.hands]
        length = max(filter(None, lengths), default=None)
        for wanted in self.settings.objects:
            bodies = [self._thing(wanted, scale).body for scale in self.settings.scales] if wanted.file else []
            doubts = (doubt_of_size(body, length, wanted.unit, _as_in_a_plan) for body in bodies)
            found += [f"{wanted.name} {doubt}" for doubt in doubts if doubt]
        return found

    def begin(self) -> None:
        """Silence Warp's messages in a worker."""
        from warpjld.runtime.quiet import silence_warp

        silence_warp()

    def run(self, trial: int, rng: np.random.Generator) -> Outcome:
        """Place the hand, close it, measure the grasp."""
        choice, wanted, scale, friction = self.settings.combination(trial)
        hand, thing = hand_of(choice), self._thing(wanted, scale)
        best_of = self.settings.wrist.best_of
        if trial in self._ahead:
            ended = self._ahead.pop(trial)
        else:
            if best_of:
                found = self._best_of(best_of, choice, wanted, scale, friction, self._search_seed(trial, rng))
            else:
                (found,) = self._closed([self._placed(choice, wanted, scale, rng)], choice, wanted, scale)
            (ended,) = self._posed([found], hand, thing)
        if isinstance(ended, Outcome):
            return ended
        tried, posed = ended
        root = {"root_position": tried.position, "root_rotation": tried.rotation}
        placed = dict(zip(("wrist_x", "wrist_y", "wrist_z"), posed.wrist, strict=True))
        both = self._closer(choice, wanted, scale).both
        measured = measure_grasp(hand, thing, both, posed.touching, friction, self.settings.measuring)
        kept = {"angles": tried.angles, **root, **_by_segment(posed.touching.patches)}
        pressed, pressure, message = self._pressed(trial, hand, thing, tried, friction, measured["success"])
        if pressure is not None:
            kept["pressure"] = pressure
        arrays = {f"{choice.name}/{name}": array for name, array in kept.items()}
        values = {**tried.values, **placed, **measured, **pressed}
        return Outcome("closed" if tried.touches else "no contact", values, arrays, message)

    def _search_seed(self, trial: int, rng: np.random.Generator) -> int:
        """Seed of the search for the best placement.

        It is the trial's own; if contact is solved, it is the same for all combinations, so that all weights are held
        with the same grasp.
        """
        if self.settings.pressing is not None:
            rng = generator(self.seed, trial // self.settings.combinations)
        return int(rng.integers(2**31))

    def _pressed(
        self, trial: int, hand: Hand, thing: Thing, tried: TriedHand, friction: float, success: bool
    ) -> tuple[dict[str, Any], Array | None, str]:
        """Contact results of a successful grasp, if the plan requests them; values, pressure and message."""
        how, weight = self.settings.pressing, self.settings.weight(trial)
        if how is None or weight is None or not success:
            return {}, None, ""
        from warpjld.study.grasping.press_grasp import press_grasp

        placed = (tried.start, tried.angles, tried.position, tried.rotation)
        return press_grasp(hand, thing, *placed, friction=friction, weight=weight, how=how)

    def alike(self, trial: int) -> tuple[HandChoice, ObjectChoice, float]:
        """Hand, object and scale; trials in which these are equal are closed in one batch."""
        return self.settings.combination(trial)[:3]

    def look_ahead(self, trials: Sequence[int]) -> None:
        """Close and pose similar trials' hands in one batch; the results are, bit for bit, those of single trials."""
        self._ahead.clear()
        if self.settings.wrist.best_of:
            return
        choice, wanted, scale = self.alike(trials[0])
        try:
            placed = [self._placed(choice, wanted, scale, generator(self.seed, trial)) for trial in trials]
            closed = self._closed(placed, choice, wanted, scale)
            ended = self._posed(closed, hand_of(choice), self._thing(wanted, scale))
            self._ahead.update(zip(trials, ended, strict=True))
        except Exception:  # the trial that failed is found when they are run one by one
            self._ahead.clear()

    def _placed(
        self, choice: HandChoice, wanted: ObjectChoice, scale: float, rng: np.random.Generator
    ) -> OpenHand | Outcome:
        """Draw one placement from the plan's ranges."""
        hand, thing = hand_of(choice), self._thing(wanted, scale)
        approach = draw_approach(self.settings.wrist, rng, thing.body.size)
        values = {**_direction(approach.direction), "gap": approach.gap, "tilt": approach.tilt}
        start = approach.aim + 4.0 * thing.radius * approach.direction
        met = ray_hit(thing.body.vertices[thing.body.faces], start, -approach.direction)
        if met is None:
            return Outcome("missed", values, message="the line of approach misses the object")
        way = met[0]
        turn, shift = place_palm(hand.palm, approach, start + (approach.gap - way) * approach.direction)
        posture = self.settings.posture
        opened = opened_hand(choice, posture_for(thing.body.size) if posture == "auto" else posture)
        back = backed_off(opened.skin, self._closer(choice, wanted, scale).both.near, turn, shift, approach)
        if back is None:
            return Outcome("no room", values, message="the open hand does not fit beside the object")
        values["gap"] = approach.gap + back
        root = hand.rig.skeleton.rest[0]
        position = turn @ root + shift + back * approach.direction - root
        rotation = Rotation.from_matrix(turn).as_quat()
        return OpenHand(opened.angles, position, rotation, values)

    def _closed(
        self, placed: Sequence[OpenHand | Outcome], choice: HandChoice, wanted: ObjectChoice, scale: float
    ) -> list[TriedHand | Outcome]:
        """Close open hands on one object in a batch; outcomes of failed placements are passed through."""
        hands = [hand for hand in placed if isinstance(hand, OpenHand)]
        if not hands:
            return [failed for failed in placed if isinstance(failed, Outcome)]
        closer, angles = self._closer(choice, wanted, scale), np.stack([hand.angles for hand in hands])
        poses = poses_from_angles(
            closer.covering.skeleton,
            angles,
            root_position=np.stack([hand.position for hand in hands]),
            root_rotation=np.stack([hand.rotation for hand in hands]),
        )
        coupling = self.settings.coupling if any(self.settings.coupling) else None
        closed = closer.close(poses, angles, digits=self.settings.digits, coupling=coupling)
        touches = np.asarray(closed.touching().any(axis=1))
        ended = iter(
            TriedHand(hand.angles, closed.angles[g], hand.position, hand.rotation, bool(touches[g]), hand.values)
            for g, hand in enumerate(hands)
        )
        return [item if isinstance(item, Outcome) else next(ended) for item in placed]

    def _posed(
        self, tried: Sequence[TriedHand | Outcome], hand: Hand, thing: Thing
    ) -> list[tuple[TriedHand, PosedHand] | Outcome]:
        """Pose closed hands in a batch; outcomes of failed placements are passed through."""
        closed = [one for one in tried if isinstance(one, TriedHand)]
        posed = posed_hands(hand, thing, closed, self.settings.measuring.contact, device=self.device)
        pairs = iter(zip(closed, posed, strict=True))
        return [one if isinstance(one, Outcome) else next(pairs) for one in tried]

    def _best_of(
        self,
        count: int,
        choice: HandChoice,
        wanted: ObjectChoice,
        scale: float,
        friction: float,
        seed: int,
    ) -> TriedHand | Outcome:
        """The best grasp of ``count`` placements, by ``find_grasp`` as in the script's GRASP … AUTO."""
        posture = self.settings.posture
        assert isinstance(posture, str)
        try:
            closer = self._closer(choice, wanted, scale)
            found = find_grasp(
                closer.covering,
                closer.thing,
                closer=closer,
                count=count,
                posture=None if posture == "auto" else posture,
                coupling=self.settings.coupling if any(self.settings.coupling) else None,
                friction=friction,
                palm=self.settings.wrist.palm,
                seed=seed,
            )
        except InputError as error:
            return Outcome("no grasp", message=str(error))
        values = _direction(-found.approach)
        return TriedHand(found.start, found.angles, found.position, found.rotation, bool(found.touching), values)

    def pictures(self, trial: int, outcome: Outcome, folder: Path) -> list[Path]:
        """Draw three views of the closed hand and its object, see `draw_grasp`."""
        from warpjld.study.grasping.pictures import draw_grasp

        choice, wanted, scale, _ = self.settings.combination(trial)
        return draw_grasp(hand_of(choice), self._thing(wanted, scale).body, trial, outcome, folder)

    def _thing(self, choice: ObjectChoice, scale: float) -> Thing:
        return thing_of(choice, scale, self.settings.measuring.density, self.device)

    def _closer(self, hand: HandChoice, choice: ObjectChoice, scale: float) -> Closer:
        return closer_of(hand, choice, scale, self.settings.measuring.density, self.device)


def _as_in_a_plan(unit: str) -> str:
    return f'unit = "{unit.lower()}"'


def _direction(away: Array) -> dict[str, Any]:
    return dict(zip(("approach_x", "approach_y", "approach_z"), away, strict=True))


def _by_segment(patches: ContactPatches) -> dict[str, Array]:
    """Contact patches as arrays with one row per segment of ``SEGMENTS``, NaN where a segment does not touch."""
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
