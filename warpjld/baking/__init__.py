"""Baking: skin weights and corrective shapes for game engines, fitted to a covering."""

from __future__ import annotations

from warpjld.baking.baked import Baked, bake
from warpjld.baking.poses import NamedPoses, training_poses, unseen_poses
from warpjld.baking.report import Accuracy, accuracy, write_report
from warpjld.baking.write import write_baked

__all__ = [
    "Accuracy",
    "Baked",
    "NamedPoses",
    "accuracy",
    "bake",
    "training_poses",
    "unseen_poses",
    "write_baked",
    "write_report",
]
