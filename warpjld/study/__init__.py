"""Studies: many independent trials, run in processes or on a cluster, resumable, collected into one table.

`run_study` runs any `Experiment`; `warpjld.study.grasping` holds the one that closes hands on objects.
"""

from warpjld.study.experiment import Experiment, Outcome
from warpjld.study.rerun import Rerun, rerun_trial
from warpjld.study.run import StudyResult, run_study
from warpjld.study.wilson import wilson_interval
from warpjld.tables.columns import Column

__all__ = ["Column", "Experiment", "Outcome", "Rerun", "StudyResult", "rerun_trial", "run_study", "wilson_interval"]
