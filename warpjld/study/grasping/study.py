"""Grasp study as one object: load a plan, check it, run or resume it, rerun single trials, export."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from warpjld.study.arrays import gathered
from warpjld.study.grasping.plan import GraspPlan, load_plan
from warpjld.study.grasping.trial import GraspExperiment
from warpjld.study.rerun import Rerun, rerun_trial
from warpjld.study.run import StudyResult, TableFormat, opened, run_study

__all__ = ["Study"]


@dataclass(frozen=True)
class Study:
    """A study that closes hands on objects many times, and brings the grasps into one table.

    Attributes:
        plan: The plan.
        device: Warp device of closing hands, distances to objects and the covering of closed hands; all else is
            computed on the CPU.

    Examples:
        >>> from tempfile import mkdtemp
        >>> folder = Path(mkdtemp())
        >>> _ = (folder / "plan.toml").write_text('''
        ... title = "One grasp"
        ... trials = 1
        ... seed = 1
        ... [[hands]]
        ... builtin = "left"
        ... resolution = 1500
        ... [[objects]]
        ... builtin = "ball"
        ... diameter = 0.065
        ... ''')
        >>> study = wj.Study.load(folder / "plan.toml")
        >>> study
        Study(One grasp: 1 trial, 1 hand, 1 object)
        >>> notes, doubts = study.check()  # then study.run(folder / "out")
        >>> doubts
        []
    """

    plan: GraspPlan
    device: str = "cpu"

    def __repr__(self) -> str:
        counts = ((self.plan.trials, "trial"), (len(self.plan.hands), "hand"), (len(self.plan.objects), "object"))
        return f"Study({self.plan.title}: " + ", ".join(f"{n} {what}{'s' * (n != 1)}" for n, what in counts) + ")"

    @classmethod
    def load(cls, path: str | Path, *, device: str = "cpu") -> Study:
        """Read a plan (TOML).

        Raises:
            InputError: It cannot be read, or a value is invalid; names line and key.
        """
        return cls(load_plan(Path(path)), device)

    @property
    def experiment(self) -> GraspExperiment:
        """The experiment that ``run_study`` repeats."""
        return GraspExperiment(self.plan, self.device)

    def check(self) -> tuple[list[str], list[str]]:
        """Load every hand and object once: notes on them, and what looks suspicious.

        Raises:
            InputError: One of them cannot be used.
        """
        return self.experiment.check(), self.experiment.doubts()

    def run(
        self,
        out: str | Path,
        *,
        processes: int | None = None,
        table: TableFormat = "parquet",
        fresh: bool = False,
        ray: str | None = None,
        allow_mixed: bool = False,
        report: Callable[[str, int, int], None] = lambda what, done, total: None,
    ) -> StudyResult:
        """Run the missing trials of the study in a folder; arguments and errors as for ``run_study``.

        Where contact is solved, ``grips.png`` and ``pressure.png`` are drawn too.
        """
        result = run_study(
            self.experiment,
            out,
            processes=processes,
            table=table,
            fresh=fresh,
            title=self.plan.title,
            ray=ray,
            allow_mixed=allow_mixed,
            report=report,
        )
        if self.plan.pressing is None:
            return result
        from warpjld.study.grasping.grip_plots import write_grip_plots

        folder = Path(out)
        rows, arrays = gathered(opened(self.experiment, folder).all(self.experiment.trials))
        return replace(result, files=(*result.files, *write_grip_plots(folder, self.plan, rows, arrays)))

    def rerun(
        self,
        out: str | Path,
        trial: int,
        *,
        report: Callable[[str, int, int], None] = lambda what, done, total: None,
    ) -> Rerun:
        """Run one trial again, compare it with the stored result, and draw it; errors as for ``rerun_trial``."""
        return rerun_trial(self.experiment, out, trial, report=report)

    def export(self, out: str | Path, kinds: Sequence[str], *, trials: Sequence[int] | None = None) -> list[Path]:
        """Write the closed hands of a study for other programs, into ``out/export``.

        Args:
            out: The study's folder.
            kinds: Formats: ``isaac`` (isaac_grasp YAML 1.0), ``dexgraspbench`` (``.npy``), ``mesh`` (OBJ and GLB of
                hand and object, and contact maps).
            trials: Numbers of trials; all that closed if left out.

        Raises:
            InputError: An unknown kind, another study in ``out``, a trial that did not close, or none that did.
        """
        from warpjld.study.grasping.export import export_grasps

        folder = Path(out)
        return export_grasps(self.plan, opened(self.experiment, folder), folder / "export", kinds, trials)
