"""A baked rig in the files that engines read: a skin, morph targets, and a JSON that says what drives them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from warpjld.bake.baked import Baked
from warpjld.errors import InputError
from warpjld.folders import make_folder
from warpjld.io.motion_out.baked_skin import BakedSkin
from warpjld.io.motion_out.source_motion import source_motion
from warpjld.io.motion_out.write import Timing, WrittenMotion, check_motion_out
from warpjld.skeleton.kinematics import Poses, rest_poses
from warpjld.whole_file import whole_file

__all__ = ["BAKED", "check_baked", "drivers_file", "write_baked", "write_drivers"]

BAKED = (".glb", ".usd", ".usda", ".usdc")
"""Suffixes of baked rigs."""


def drivers_file(path: Path) -> Path:
    """Where the correctives' drivers lie: ``hand.glb`` has ``hand.correctives.json`` beside it."""
    return path.with_name(f"{path.stem}.correctives.json")


def check_baked(path: Path) -> None:
    """Raise what ``write_baked`` would for a file's name.

    Raises:
        InputError: Unknown suffix.
        MissingExtraError: The format needs an optional dependency.
    """
    if path.suffix.lower() not in BAKED:
        raise InputError(f"unknown kind of baked rig '{path.suffix}'; known: {', '.join(BAKED)}", path=path)
    check_motion_out(path)


def write_baked(path: Path, baked: Baked, clip: Poses | None = None, *, rate: float = 30.0) -> WrittenMotion:
    """Write a baked rig; with a clip also its joints and the shapes' weights over time.

    Args:
        path: The file, ``.glb`` or ``.usd``, ``.usda``, ``.usdc``.
        baked: The rig.
        clip: Poses to animate it by; at rest without.
        rate: Frames a second of the clip.

    Raises:
        InputError: Unknown suffix, poses of another rig, or a place that cannot be written.
        MissingExtraError: The format needs an optional dependency.
    """
    check_baked(path)
    make_folder(path.parent)
    poses = rest_poses(baked.rig.skeleton) if clip is None else clip
    motion = source_motion(baked.rig, poses)
    spare = ((0, 0), (0, -baked.joints.shape[1] % 4))
    weights = np.pad(baked.weights, spare)
    skin = BakedSkin(
        np.where(weights > 0.0, baked.bones.sources[np.pad(baked.joints, spare)], 0),
        weights,
        tuple(f"corrective{k + 1:02}" for k in range(len(baked.correctives))),
        baked.correctives.shapes,
        baked.correctives.weights(baked.bones.turns(poses)),
    )
    timing = Timing(rate, 0, path.stem)
    try:
        with whole_file(path) as part:
            if path.suffix.lower() != ".glb":
                from warpjld.io.motion_out.usd import write_usd

                return write_usd(part, baked.rig, poses, timing, skin)
            from warpjld.io.motion_out.glb import animate
            from warpjld.io.motion_out.gltf_new import new_document

            notes, warnings = list(motion.notes), list[str]()
            file, nodes = new_document(baked.rig, motion, notes, skin)
            if clip is not None:
                animate(file, nodes, motion, timing, warnings, skin)
            file.write(part)
            return WrittenMotion(tuple(notes), tuple(warnings))
    except OSError as error:
        raise InputError(f"cannot be written: {error.strerror or error}", path=path) from error


def write_drivers(path: Path, baked: Baked) -> None:
    """Write what drives the shapes; docs/bake.md describes the file.

    Raises:
        InputError: A place that cannot be written.
    """
    bones, found = baked.bones, baked.correctives
    shapes: list[dict[str, Any]] = []
    for k in range(len(found)):
        used = np.flatnonzero(np.abs(found.drivers[k]).max(axis=1) > 0.0).tolist()
        drivers = [
            {
                "joint": bones.names[b],
                "parent": bones.names[bones.parents[b]],
                "weights": [float(f"{x:.8g}") for x in found.drivers[k, b]],
            }
            for b in used
        ]
        shapes.append({"name": f"corrective{k + 1:02}", "drivers": drivers})
    content = {
        "version": 1,
        "features": ["x", "y", "z", "xx", "yy", "zz", "xy", "xz", "yz"],
        "axes": "world, Y up, at rest",
        "shapes": shapes,
    }
    try:
        with whole_file(path) as part:
            part.write_text(json.dumps(content, indent=1), "utf-8")
    except OSError as error:
        raise InputError(f"cannot be written: {error.strerror or error}", path=path) from error
