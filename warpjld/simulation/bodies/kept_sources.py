"""Source files of the program on which cached meshes of flesh and objects depend."""

from __future__ import annotations

__all__ = ["MESHING"]

MESHING = (
    "*.py",
    "fem/**/*.py",
    "files/*.py",
    "geometry/*.py",
    "grasp/objects.py",
    "grasp/pieces.py",
    "io/**/*.py",
    "rig/*.py",
    "runtime/*.py",
    "simulation/**/*.py",
    "skeleton/**/*.py",
)
"""Glob patterns relative to the package; more than meshing needs, so that no cached mesh is ever out of date."""
