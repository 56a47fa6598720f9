"""Grasp studies: plan from a TOML file, trials that close hands on objects, metrics of the grasps."""

from warpjld.study.grasping.plan import GraspPlan, load_plan
from warpjld.study.grasping.study import Study
from warpjld.study.grasping.trial import GraspExperiment

__all__ = ["GraspExperiment", "GraspPlan", "Study", "load_plan"]
