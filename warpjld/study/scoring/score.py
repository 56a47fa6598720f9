"""Scoring of given grasps: builds the experiment from files and options, and runs it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path, PurePosixPath
from typing import Literal

from warpjld.errors import InputError
from warpjld.files.manifest import file_hash
from warpjld.grasp.judge import check_friction
from warpjld.rig import Rig
from warpjld.study.grasping.choices import HandChoice, ObjectChoice
from warpjld.study.grasping.load import hand_of
from warpjld.study.grasping.plan import GraspPlan, Measuring, load_plan
from warpjld.study.run import StudyResult, TableFormat, run_study
from warpjld.study.scoring.experiment import Scored, ScoreExperiment
from warpjld.study.scoring.given import GivenGrasp
from warpjld.study.scoring.joint_names import JointNames, read_joint_names
from warpjld.study.scoring.read import grasp_files, read_grasps
from warpjld.study.scoring.reading_grasps import GraspReading
from warpjld.study.scoring.things import ObjectFolder

__all__ = ["given_scores", "hand_choice", "score_grasps"]


def given_scores(
    grasps: str | Path,
    *,
    hand: HandChoice | None = None,
    objects: str | Path | None = None,
    plan: str | Path | None = None,
    joint_map: str | Path | None = None,
    friction: float = 0.6,
    unit: str = "m",
    measuring: Measuring | None = None,
    device: str = "cpu",
    flat_hand_mean: bool | None = None,
    frames: Literal["last", "all"] = "last",
) -> ScoreExperiment:
    """Experiment that scores the grasps of a file or folder.

    Args:
        grasps: A study's folder, or grasps of another program; see ``docs/how-to/score.md``.
        hand: The hand; together with ``objects``, instead of ``plan``.
        objects: Folder of surfaces, each in the frame that the grasps refer to.
        plan: A study file whose hands, objects and measuring are used.
        joint_map: Joint map, see `warpjld.study.scoring.joint_names`.
        friction: Coulomb coefficient for grasps without one.
        unit: Unit of the surfaces in ``objects``.
        measuring: Settings of the metrics; by default those of the plan, or the general defaults.
        device: Warp device of the covering.
        flat_hand_mean: Whether zero rotations of a MANO pose mean the flat hand; None if the file states it.
        frames: For recordings, whether the last frame is the grasp, or all frames are.

    Raises:
        InputError: One of these cannot be used.
    """
    check_friction(friction)
    if plan is None and (hand is None or objects is None):
        raise InputError("want a hand and a folder of objects, or a study's plan that has both")
    if plan is not None and (hand is not None or objects is not None):
        raise InputError("a study's plan already names hands and objects: give either a plan, or a hand and objects")
    path = Path(grasps)
    if not path.exists():
        raise InputError("no such file", path=path)
    planned = None if plan is None else load_plan(plan)
    hands = _Hands(planned.hands if planned else (hand,) if hand else ())
    names = JointNames() if joint_map is None else read_joint_names(joint_map)
    found = read_grasps(path, GraspReading(hands.rig, names, flat_hand_mean, frames))
    hands.check(found)
    things = _of_plan(planned) if planned else _of_folder(ObjectFolder(Path(objects or ".")), unit)
    scored = tuple(
        Scored(grasp, hands.find(grasp.hand), things(grasp), friction if grasp.friction is None else grasp.friction)
        for grasp in found
    )
    files = [*grasp_files(path), *([Path(joint_map)] if joint_map else [])]
    hashes = tuple(
        (str(file.relative_to(path) if file.is_relative_to(path) else file.name), file_hash(file)) for file in files
    )
    return ScoreExperiment(scored, measuring or (planned.measuring if planned else Measuring()), hashes, device)


def score_grasps(
    grasps: str | Path,
    out: str | Path,
    *,
    hand: str | Path | None = None,
    objects: str | Path | None = None,
    plan: str | Path | None = None,
    joint_map: str | Path | None = None,
    friction: float = 0.6,
    flat_hand_mean: bool | None = None,
    processes: int | None = None,
    table: TableFormat = "parquet",
    fresh: bool = False,
    ray: str | None = None,
    allow_mixed: bool = False,
    report: Callable[[str, int, int], None] = lambda what, done, total: None,
) -> StudyResult:
    """Score grasps of other programs on deformed skin, with the columns of a grasp study.

    Args:
        grasps: A study's folder, isaac_grasp YAML, DexGraspBench or GraspXL ``.npy``, CSV of joint angles, surfaces.
        out: Output folder.
        hand: Rig file of the hand, or ``builtin:left`` or ``builtin:right``.
        objects: Folder of surfaces in metres, each in the frame that the grasps refer to.
        plan: A study file, instead of ``hand`` and ``objects``.
        joint_map: JSON file that maps joints of other names to angles of the hand.
        friction: Coulomb coefficient for grasps without one.
        flat_hand_mean: Whether zero rotations of a MANO pose mean the flat hand; None if the file states it.
        processes: As for ``Study.run``, likewise ``table``, ``fresh``, ``ray``, ``allow_mixed`` and ``report``.

    Raises:
        InputError: Grasps, hand or objects cannot be used; names the file.

    Examples:
        >>> wj.score_grasps("grasps.yaml", "out", hand="hand.glb", objects="meshes")  # doctest: +SKIP
        StudyResult(12 of 20 succeed, 20 run now in 3.1 s)
        >>> try:
        ...     wj.score_grasps("missing.yaml", "out", hand="builtin:left", objects="meshes")
        ... except wj.InputError as error:
        ...     print(error)
        missing.yaml: no such file
    """
    chosen = None if hand is None else hand_choice(str(hand))
    experiment = given_scores(
        grasps,
        hand=chosen,
        objects=objects,
        plan=plan,
        joint_map=joint_map,
        friction=friction,
        flat_hand_mean=flat_hand_mean,
    )
    return run_study(
        experiment,
        out,
        processes=processes,
        table=table,
        fresh=fresh,
        title="scores",
        ray=ray,
        allow_mixed=allow_mixed,
        report=report,
    )


def hand_choice(text: str) -> HandChoice:
    """A hand by its name on the command line: a file, ``builtin:left`` or ``builtin:right``.

    Raises:
        InputError: There is no such built-in hand, or no such file.
    """
    kind, colon, which = text.partition(":")
    if kind == "builtin" and colon:
        if which not in ("left", "right"):
            raise InputError(f"there is no built-in hand '{which}': want builtin:left or builtin:right")
        return HandChoice(which, side=which)
    path = Path(text)
    if not path.is_file():
        raise InputError("no such file", path=path)
    return HandChoice(path.stem, file=path)


class _Hands:
    """The hands, by name; a single hand is used whatever name a grasp states."""

    def __init__(self, choices: tuple[HandChoice, ...]) -> None:
        self._choices = {choice.name: choice for choice in choices}

    def find(self, name: str) -> HandChoice:
        if len(self._choices) == 1:
            return next(iter(self._choices.values()))
        if name not in self._choices:
            raise InputError(f"no hand '{name}'; there are {', '.join(self._choices)}")
        return self._choices[name]

    def rig(self, name: str) -> Rig:
        return hand_of(self.find(name)).rig

    def check(self, grasps: list[GivenGrasp]) -> None:
        """Refuse grasps of several hands when only one hand is given."""
        named = {grasp.hand for grasp in grasps} - {""}
        if len(named) > 1 and len(self._choices) == 1:
            raise InputError(f"these are grasps of several hands, {', '.join(sorted(named))}, but one hand is given")


def _of_plan(plan: GraspPlan) -> Callable[[GivenGrasp], ObjectChoice]:
    known = {thing.name: thing for thing in plan.objects}

    def find(grasp: GivenGrasp) -> ObjectChoice:
        thing = known.get(grasp.thing) or known.get(PurePosixPath(grasp.thing).stem)
        if thing is None:
            raise InputError(f"{grasp.name}: no object '{grasp.thing}' in the plan; there are {', '.join(known)}")
        return thing

    return find


def _of_folder(folder: ObjectFolder, unit: str) -> Callable[[GivenGrasp], ObjectChoice]:
    def find(grasp: GivenGrasp) -> ObjectChoice:
        file = folder.find(grasp.thing)
        name = PurePosixPath(grasp.thing.replace("\\", "/"))
        called = name.stem if name.suffix.lower() == file.suffix.lower() else name.name
        mass = None if grasp.mass is None else grasp.mass / grasp.scale**3
        return ObjectChoice(called, file=file, unit=unit, centre=False, mass=mass)

    return find
