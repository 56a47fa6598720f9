"""Scoring of grasps from other programs on deformed skin, with the columns of a grasp study."""

from warpjld.study.scoring.experiment import ScoreExperiment
from warpjld.study.scoring.score import given_scores, hand_choice, score_grasps

__all__ = ["ScoreExperiment", "given_scores", "hand_choice", "score_grasps"]
