"""Joint-dependent Local Deformations on NVIDIA Warp: a surface follows a skeleton without painted weights.

``import warpjld as wj``: what is listed in ``dir(wj)`` is the library, each name once. Whatever else lies in the
package's modules is how it is done, and may change. Nothing is imported before it is first asked for.

Lengths are metres, angles radians, forces newtons, pressures pascals; Y is up. Arrays are (frames, …).
"""

from __future__ import annotations

from importlib import import_module

TYPE_CHECKING = False  # as type checkers know it; importing typing takes longer than all else here
if TYPE_CHECKING:
    from warpjld import fem, render
    from warpjld.baking import bake, write_baked
    from warpjld.batch.deform_file import deform_file
    from warpjld.covering import Covering, Parameters, load_parameters, save_parameters
    from warpjld.covering import bind_rig as bind
    from warpjld.covering.calibrate import calibrate
    from warpjld.covering.gradient import Differentiable
    from warpjld.errors import InputError, MissingExtraError, WarpjldError
    from warpjld.grasp import GraspObject, load_object, make_object, shapes
    from warpjld.grasp.close_hand import close_hand
    from warpjld.grasp.find_grasp import find_grasp
    from warpjld.grasp.judge import judge
    from warpjld.hand import build_hand
    from warpjld.hand.figure import build_body
    from warpjld.io import load_rig
    from warpjld.io.caches import open_cache
    from warpjld.motion import Motion, load_motion
    from warpjld.rig import Rig
    from warpjld.script import Arguments, Scene, command
    from warpjld.script.menus import menu
    from warpjld.script.run_script import run_script
    from warpjld.simulation.recorded import RecordedActor, RecordedAnimation, RecordedObject
    from warpjld.simulation.simulate import simulate
    from warpjld.simulation.specification import (
        ContactSpecification,
        FleshMaterial,
        GripSpecification,
        ObjectMaterial,
        SolveSpecification,
    )
    from warpjld.skeleton import Poses, Skeleton, poses_from_angles
    from warpjld.skeleton.place.place import propose_points
    from warpjld.study.grasping import Study
    from warpjld.study.scoring.score import score_grasps
    from warpjld.touch import Touch

__version__ = "0.1.0"

_WHERE = {
    # rigs
    "load_rig": "io",
    "build_hand": "hand",
    "build_body": "hand.figure",
    "propose_points": "skeleton.place.place",
    "Rig": "rig",
    "Skeleton": "skeleton",
    # motion
    "Motion": "motion",
    "load_motion": "motion",
    "Poses": "skeleton",
    "poses_from_angles": "skeleton",
    # covering
    "bind": "covering:bind_rig",
    "Covering": "covering",
    "Parameters": "covering",
    "load_parameters": "covering",
    "save_parameters": "covering",
    "calibrate": "covering.calibrate",
    "Differentiable": "covering.gradient",
    "Touch": "touch",
    # files
    "deform_file": "batch.deform_file",
    "open_cache": "io.caches",
    "bake": "baking",
    "write_baked": "baking",
    # grasping
    "load_object": "grasp",
    "make_object": "grasp",
    "GraspObject": "grasp",
    "close_hand": "grasp.close_hand",
    "find_grasp": "grasp.find_grasp",
    "judge": "grasp.judge",
    # contact
    "simulate": "simulation.simulate",
    "ContactSpecification": "simulation.specification",
    "FleshMaterial": "simulation.specification",
    "ObjectMaterial": "simulation.specification",
    "GripSpecification": "simulation.specification",
    "SolveSpecification": "simulation.specification",
    "RecordedActor": "simulation.recorded",
    "RecordedAnimation": "simulation.recorded",
    "RecordedObject": "simulation.recorded",
    # scripts and studies
    "run_script": "script.run_script",
    "command": "script",
    "menu": "script.menus",
    "Scene": "script",
    "Arguments": "script",
    "Study": "study.grasping",
    "score_grasps": "study.scoring.score",
    # errors
    "WarpjldError": "errors",
    "InputError": "errors",
    "MissingExtraError": "errors",
}
"""Module of every public name, below ``warpjld``; behind a colon the name it has there, where that is another."""

_MODULES = {"fem": "fem", "render": "render", "shapes": "grasp.shapes"}
"""Modules that are public themselves, with the names in their ``__all__``."""

__all__ = [
    "Arguments",
    "ContactSpecification",
    "Covering",
    "Differentiable",
    "FleshMaterial",
    "GraspObject",
    "GripSpecification",
    "InputError",
    "MissingExtraError",
    "Motion",
    "ObjectMaterial",
    "Parameters",
    "Poses",
    "RecordedActor",
    "RecordedAnimation",
    "RecordedObject",
    "Rig",
    "Scene",
    "Skeleton",
    "SolveSpecification",
    "Study",
    "Touch",
    "WarpjldError",
    "__version__",
    "bake",
    "bind",
    "build_body",
    "build_hand",
    "calibrate",
    "close_hand",
    "command",
    "deform_file",
    "fem",
    "find_grasp",
    "judge",
    "load_motion",
    "load_object",
    "load_parameters",
    "load_rig",
    "make_object",
    "menu",
    "open_cache",
    "poses_from_angles",
    "propose_points",
    "render",
    "run_script",
    "save_parameters",
    "score_grasps",
    "shapes",
    "simulate",
    "write_baked",
]


if not TYPE_CHECKING:  # to a type checker a name that is not listed is an error

    def __getattr__(name: str) -> object:
        if name in _MODULES:
            found = import_module(f"warpjld.{_MODULES[name]}")
        elif name in _WHERE:
            module, _, other = _WHERE[name].partition(":")
            found = getattr(import_module(f"warpjld.{module}"), other or name)
        else:
            raise AttributeError(f"module 'warpjld' has no attribute '{name}'")
        globals()[name] = found  # from now on it is an attribute like any other
        return found


def __dir__() -> list[str]:
    return sorted([*_WHERE, *_MODULES, "__version__"])
