"""Animations of FBX files, sampled at frames."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.files.spilled_rows import SpilledRows
from warpjld.motion.joint_animation import JointAnimation, spilled_animation
from warpjld.skeleton.recognise.tree import SourceTree

__all__ = ["fbx_animation_names", "read_fbx_animation"]

_FLAT = 1e-12  # largest determinant of a singular matrix, per cube of its largest entry
_TINY = 1e-7
"""Scale that replaces zero scale."""


def fbx_animation_names(path: str | Path) -> tuple[str, ...]:
    """Names of an FBX file's animations that move something, in the file's order.

    Raises:
        InputError: The file cannot be read.
        MissingExtraError: Without ufbx.
    """
    from warpjld.io.fbx.scene import read_scene

    return tuple(stack.name for stack in read_scene(path).stacks if stack.moving)


def read_fbx_animation(path: str | Path, *, rate: float | None = None, name: str | None = None) -> JointAnimation:
    """An animation of an FBX file, in metres and Y up.

    Layers, rotation orders, pre- and post-rotations and pivots are evaluated by ufbx. Frames run from the start to the
    end of the animation.

    Args:
        path: The file.
        rate: Frames a second; None for the file's own.
        name: Name of the animation, in any case, with or without the object name and bar that Blender puts before it;
            None for the first that moves anything.

    Raises:
        InputError: The file cannot be read, or has no joints or no such animation.
        MissingExtraError: Without ufbx.
    """
    from warpjld.io.fbx.scene import read_scene
    from warpjld.io.fbx.skeleton import find_skeleton

    scene = read_scene(path, animated=True, name=name, rate=0.0 if rate is None else rate)
    names = [stack.name for stack in scene.stacks]
    if scene.worlds is None:
        if name is not None and names:
            known = ", ".join(f"'{n}'" for n in names)
            raise InputError(f"has no animation '{name}'; it has {known}", path=path)
        raise InputError("no animation in this file" if not names else "its animation moves nothing", path=path)
    skeleton = find_skeleton(scene)
    moving = [stack.name for stack in scene.stacks if stack.moving]
    notes = []
    if name is None and len(moving) > 1:
        others = ", ".join(f"'{n}'" for n in moving if n != scene.title)
        notes.append(f"animation '{scene.title}' is played; the file also has {others}")
    rows, warned = SpilledRows(16 * len(skeleton.tree)), dict[int, str]()
    before = skeleton.tree.frames
    for block in scene.worlds.blocks():
        worlds = block.reshape(-1, len(scene.names), 4, 4)[:, skeleton.nodes] @ skeleton.squared
        _turn_flat_ones(worlds, skeleton.tree, len(rows), before, warned)
        before = worlds[-1]
        rows.extend(worlds.reshape(len(worlds), -1))
    warnings = list(warned.values())
    if any(stack.shapes for stack in scene.stacks if stack.name == scene.title):
        warnings.append("the animation of blend shapes is not followed")
    remarks = (*notes, *skeleton.notes)
    nothing = np.zeros((0, len(skeleton.tree), 4, 4))
    head = JointAnimation(skeleton.tree, nothing, scene.rate, scene.title, notes=remarks, warnings=tuple(warnings))
    return spilled_animation(head, rows)


def _turn_flat_ones(
    worlds: NDArray[np.float64], tree: SourceTree, first: int, before: NDArray[np.float64], warnings: dict[int, str]
) -> None:
    """Replace singular transforms by the joint's previous rotation with a tiny scale, in place.

    Args:
        worlds: Transforms of a block of frames, shape (f, N, 4, 4).
        tree: The joints.
        first: Number of the block's first frame.
        before: Transforms of the frame before the block, shape (N, 4, 4).
        warnings: Warnings by joint, to which new ones are added.
    """
    linear = worlds[..., :3, :3]
    flat = np.abs(np.linalg.det(linear)) <= _FLAT * np.abs(linear).max(axis=(-1, -2)) ** 3
    for frame, joint in np.argwhere(flat):
        last = before[joint] if frame == 0 else worlds[frame - 1, joint]
        u, _, v = np.linalg.svd(last[:3, :3])
        linear[frame, joint] = _TINY * u @ v
        warnings.setdefault(
            int(joint),
            f"joint '{tree.names[joint]}' is scaled to nothing at frame {first + frame}: its last rotation is kept",
        )
