"""Animations of FBX files, sampled at frames."""

from __future__ import annotations

from pathlib import Path

from warpjld.errors import InputError
from warpjld.motion.joint_animation import JointAnimation

__all__ = ["fbx_animation_names", "read_fbx_animation"]


def fbx_animation_names(path: str | Path) -> tuple[str, ...]:
    """Names of the animations of an FBX file that move something, in its order.

    Raises:
        InputError: It cannot be read.
        MissingExtraError: Without ufbx.
    """
    from warpjld.io.fbx.scene import read_scene

    return tuple(stack.name for stack in read_scene(path).stacks if stack.moving)


def read_fbx_animation(path: str | Path, *, rate: float | None = None, name: str | None = None) -> JointAnimation:
    """An animation of an FBX file, in metres and Y up.

    Its layers are blended, and rotation orders, pre- and post-rotations and pivots applied, by ufbx. The first frame
    is where the animation starts, the last where it ends.

    Args:
        path: The file.
        rate: Frames a second; None for the file's own.
        name: Which animation; None for the first that moves anything.

    Raises:
        InputError: It cannot be read, has no joints, or no such animation.
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
    worlds = scene.worlds[:, skeleton.nodes] @ skeleton.squared
    return JointAnimation(skeleton.tree, worlds, scene.rate, title=scene.title, notes=(*notes, *skeleton.notes))
