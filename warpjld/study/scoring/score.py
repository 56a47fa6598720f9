"""Judging grasps of others: what is given on the command line becomes an experiment."""

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
    """The experiment that judges grasps of a file or folder.

    Args:
        grasps: A study's folder, or grasps of others; see ``docs/how-to/score.md``.
        hand: Whose grasps they are; with ``objects``, instead of ``plan``.
        objects: Folder of surfaces, each in the frame that the grasps are given in.
        plan: A study file whose hands, objects and measuring are taken.
        joint_map: What joints of others are, see `warpjld.study.scoring.joint_names`.
        friction: Coulomb coefficient where a grasp brings none.
        unit: Of the surfaces in ``objects``.
        measuring: How; that of the plan, or the defaults.
        device: Warp device of the covering.
        flat_hand_mean: Whether no rotation of a MANO pose means the flat hand; None where the file says it.
        frames: Of recordings, whether the last frame is a grasp or all are.

    Raises:
        InputError: Something of this cannot be used.
    """
    check_friction(friction)
    if plan is None and (hand is None or objects is None):
        raise InputError("want a hand and a folder of objects, or a study's plan that has both")
    if plan is not None and (hand is not None or objects is not None):
        raise InputError("a study's plan says which hands and objects there are: give none beside it")
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
        Scored(one, hands.find(one.hand), things(one), friction if one.friction is None else one.friction)
        for one in found
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
    """Judge grasps of others by the columns of a grasp study, on skin that deforms.

    Args:
        grasps: A study's folder, isaac_grasp YAML, DexGraspBench or GraspXL ``.npy``, CSV of joint angles, surfaces.
        out: Folder of the table.
        hand: Rig file of the hand, or ``builtin:left`` or ``builtin:right``.
        objects: Folder of surfaces in metres, each in the frame that the grasps are given in.
        plan: A study file instead of both.
        joint_map: JSON that says which angle of the hand each joint is, where names differ.
        friction: Coulomb coefficient where a grasp brings none.
        flat_hand_mean: Whether no rotation of a MANO pose means the flat hand; None where the file says it.
        processes: As of ``Study.run``, likewise ``table``, ``fresh``, ``ray``, ``allow_mixed`` and ``report``.

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
    """A hand as the command line names rigs: a file, ``builtin:left`` or ``builtin:right``.

    Raises:
        InputError: Nothing built in is called so, or there is no such file.
    """
    kind, colon, which = text.partition(":")
    if kind == "builtin" and colon:
        if which not in ("left", "right"):
            raise InputError(f"no hand that is built in is called '{which}': want builtin:left or builtin:right")
        return HandChoice(which, side=which)
    path = Path(text)
    if not path.is_file():
        raise InputError("no such file", path=path)
    return HandChoice(path.stem, file=path)


class _Hands:
    """The hands there are, by the names that grasps have for them."""

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
        named = {one.hand for one in grasps} - {""}
        if len(named) > 1 and len(self._choices) == 1:
            raise InputError(f"these are grasps of {', '.join(sorted(named))}: one hand is not all of them")


def _of_plan(plan: GraspPlan) -> Callable[[GivenGrasp], ObjectChoice]:
    known = {thing.name: thing for thing in plan.objects}

    def find(one: GivenGrasp) -> ObjectChoice:
        thing = known.get(one.thing) or known.get(PurePosixPath(one.thing).stem)
        if thing is None:
            raise InputError(f"{one.name}: no object '{one.thing}' in the plan; there are {', '.join(known)}")
        return thing

    return find


def _of_folder(folder: ObjectFolder, unit: str) -> Callable[[GivenGrasp], ObjectChoice]:
    def find(one: GivenGrasp) -> ObjectChoice:
        file = folder.find(one.thing)
        name = PurePosixPath(one.thing.replace("\\", "/"))
        called = name.stem if name.suffix.lower() == file.suffix.lower() else name.name
        mass = None if one.mass is None else one.mass / one.scale**3
        return ObjectChoice(called, file=file, unit=unit, centre=False, mass=mass)

    return find
