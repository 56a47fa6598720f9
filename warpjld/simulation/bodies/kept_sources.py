"""Which of the program's files meshes of flesh and objects follow from."""

from __future__ import annotations

__all__ = ["MESHING"]

MESHING = (
    "*.py",
    "fem/**/*.py",
    "files/*.py",
    "geometry/*.py",
    "grasp/objects.py",
    "grasp/pieces.py",
    "io/mesh_file.py",
    "rig/*.py",
    "runtime/*.py",
    "simulation/**/*.py",
    "skeleton/**/*.py",
)
"""Patterns: more than meshing needs, so that no mesh is ever out of date."""
