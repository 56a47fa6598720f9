"""Studies that close hands on objects: the plan in a TOML file, one trial, its measures."""

from warpjld.study.grasping.plan import GraspPlan, load_plan
from warpjld.study.grasping.study import Study
from warpjld.study.grasping.trial import GraspExperiment

__all__ = ["GraspExperiment", "GraspPlan", "Study", "load_plan"]
