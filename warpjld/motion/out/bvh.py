"""Writer of BVH files: the rig's own joints as a hierarchy of offsets, then a line of channel values per frame.

Lengths are metres and Y is up, whatever the rig's file has. Zero rotations are the rest pose, and joint axes are the
world's, as usual for BVH: OFFSETs are differences of rest positions. The root's OFFSET is 0, so that readers that add
its position channels to it and readers that replace it by them agree. Joints whose distance to their parent changes
over the clip have position channels, too; these replace the OFFSET, as Blender, Maya and MotionBuilder read them.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TextIO

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from warpjld.geometry.rotations import conjugate, multiply, rotate
from warpjld.listed import first_few
from warpjld.motion.out.euler import ContinuousEuler
from warpjld.motion.out.source_motion import SourceMotion, source_motion
from warpjld.motion.out.write import Timing, WrittenMotion
from warpjld.rig import Rig
from warpjld.skeleton import Poses

__all__ = ["write_bvh"]

_POSITION = "Xposition Yposition Zposition"
_ROTATION = "Zrotation Xrotation Yrotation"
_CONSTANT = 1e-6  # largest change of an offset that counts as constant, per size of the rig
_STUB = 0.02  # length of the end site of a joint without a bone, per size of the rig


@dataclass(frozen=True)
class _Joint:
    """A joint of the file; ``source`` is its index in the motion, -1 for an added common root."""

    name: str
    source: int
    parent: int
    depth: int
    offset: NDArray[np.float64]
    end: NDArray[np.float64] | None


def write_bvh(path: Path, rig: Rig, poses: Poses, timing: Timing) -> WrittenMotion:
    """Write a motion of a rig's own joints as BVH; a :class:`~warpjld.motion.out.write.MotionWriter`.

    BVH holds one hierarchy, so several roots get a common parent at the origin.
    """
    motion = source_motion(rig, poses)
    notes = list(motion.notes)
    joints = _hierarchy(motion, rig, notes)
    moving = _moving(motion, joints)
    stretched = [joint.name for joint, moves in zip(joints, moving, strict=True) if moves and joint.parent >= 0]
    if stretched:
        notes.append(
            f"position channels besides the root's, where the distance to the parent changes: {first_few(stretched, 6)}"
        )
    if timing.start_frame:
        notes.append(f"BVH has no frame numbers: the first frame is frame {timing.start_frame}")
    with path.open("w", encoding="utf-8", newline="\n") as file:
        _write_hierarchy(file, joints, moving)
        file.write(f"MOTION\nFrames: {len(motion)}\nFrame Time: {1.0 / timing.rate:.10g}\n")
        _write_frames(file, motion, joints, moving)
    return WrittenMotion(tuple(notes))


def _hierarchy(motion: SourceMotion, rig: Rig, notes: list[str]) -> list[_Joint]:
    """Joints in depth-first order, as they are nested in the file."""
    tree = motion.tree
    at = motion.rest_frames[:, :3, 3]
    names = _names(tree.names, notes)
    roots = np.flatnonzero(tree.parents < 0).tolist()
    joints: list[_Joint] = []
    if len(roots) > 1:
        common = next(name for name in ("root", *(f"root{n}" for n in range(len(names) + 1))) if name not in names)
        joints.append(_Joint(common, -1, -1, 0, np.zeros(3), None))
        notes.append(f"BVH holds one hierarchy: {len(roots)} roots are attached to '{common}', at the origin")
    waiting = [(root, len(joints) - 1) for root in reversed(roots)]
    while waiting:
        source, parent = waiting.pop()
        depth = joints[parent].depth + 1 if parent >= 0 else 0
        above = joints[parent].source if parent >= 0 else -1
        offset = np.zeros(3) if parent < 0 else at[source] - (at[above] if above >= 0 else 0.0)
        kids = tree.children[source]
        joints.append(
            _Joint(names[source], source, parent, depth, offset, None if kids else _end(motion, rig, source, at))
        )
        waiting.extend((kid, len(joints) - 1) for kid in reversed(kids))
    return joints


def _names(names: tuple[str, ...], notes: list[str]) -> list[str]:
    """Unique names without characters that BVH readers split at; changes are noted."""
    out: list[str] = []
    for j, name in enumerate(names):
        plain = "_".join(name.replace("{", "(").replace("}", ")").split()) or f"joint{j}"
        unique, n = plain, 1
        while unique in out:
            n += 1
            unique = f"{plain}_{n}"
        out.append(unique)
    changed = [f"'{old}' → {new}" for old, new in zip(names, out, strict=True) if old != new]
    if changed:
        notes.append(f"names changed for BVH: {first_few(changed, 6)}")
    return out


def _end(motion: SourceMotion, rig: Rig, source: int, at: NDArray[np.float64]) -> NDArray[np.float64]:
    """Offset of a leaf's end site: to a tip added in recognition, or a continuation of the bone before."""
    if source in rig.sources:
        tips = [c for c in rig.skeleton.children[rig.sources.index(source)] if rig.sources[c] < 0]
        if tips:
            return np.asarray(rig.skeleton.rest[tips[0]] - at[source])
    parent = int(motion.tree.parents[source])
    bone = at[source] - at[parent] if parent >= 0 else np.zeros(3)
    size = float(np.linalg.norm(np.ptp(at, axis=0))) or 1.0
    return bone if np.linalg.norm(bone) > 1e-6 * size else np.array([0.0, _STUB * size, 0.0])


def _moving(motion: SourceMotion, joints: list[_Joint]) -> NDArray[np.bool_]:
    """Mask of joints that need position channels: roots, and joints whose position relative to their parent changes."""
    offsets = np.array([joint.offset for joint in joints])
    size = float(np.linalg.norm(np.ptp(motion.rest_frames[:, :3, 3], axis=0))) or 1.0
    moving = np.array([joint.parent < 0 for joint in joints])
    for block in motion.blocks():
        places, _ = _local(motion, joints, block)
        moving |= (np.linalg.norm(places - offsets, axis=-1) > _CONSTANT * size).any(axis=0)
    return moving


def _local(
    motion: SourceMotion, joints: list[_Joint], frames: slice
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Positions [m] and rotations relative to the parent, in axes of the rest pose, shapes (f, B, 3) and (f, B, 4)."""
    count = frames.stop - frames.start
    world = np.zeros((count, len(joints), 4))
    world[..., 3] = 1.0
    at = np.zeros((count, len(joints), 3))
    own = [b for b, joint in enumerate(joints) if joint.source >= 0]
    sources = [joints[b].source for b in own]
    world[:, own], at[:, own] = motion.rotations(frames)[:, sources], motion.positions(frames)[:, sources]
    hang = [b for b, joint in enumerate(joints) if joint.parent >= 0]
    parents = [joints[b].parent for b in hang]
    back = conjugate(world[:, parents])
    places, turns = at.copy(), world.copy()
    places[:, hang] = rotate(back, at[:, hang] - at[:, parents])
    turns[:, hang] = multiply(back, world[:, hang])
    return places, turns


def _write_hierarchy(file: TextIO, joints: list[_Joint], moving: NDArray[np.bool_]) -> None:
    file.write("HIERARCHY\n")
    depth = 0
    for joint, moves in zip(joints, moving, strict=True):
        for level in range(depth - 1, joint.depth - 1, -1):
            file.write("\t" * level + "}\n")
        indent = "\t" * joint.depth
        channels = f"6 {_POSITION} {_ROTATION}" if moves else f"3 {_ROTATION}"
        file.write(f"{indent}{'JOINT' if joint.parent >= 0 else 'ROOT'} {joint.name}\n{indent}{{\n")
        file.write(f"{indent}\tOFFSET {_numbers(joint.offset)}\n{indent}\tCHANNELS {channels}\n")
        if joint.end is not None:
            file.write(f"{indent}\tEnd Site\n{indent}\t{{\n{indent}\t\tOFFSET {_numbers(joint.end)}\n{indent}\t}}\n")
        depth = joint.depth + 1
    for level in range(depth - 1, -1, -1):
        file.write("\t" * level + "}\n")


def _write_frames(file: TextIO, motion: SourceMotion, joints: list[_Joint], moving: NDArray[np.bool_]) -> None:
    """Write the frames block by block; positions to 1e-8 m, angles to 1e-6 degrees."""
    line = " ".join("%.8f %.8f %.8f %.6f %.6f %.6f" if moves else "%.6f %.6f %.6f" for moves in moving) + "\n"
    keep = np.concatenate([[moves] * 3 + [True] * 3 for moves in moving])
    euler = ContinuousEuler(len(joints))
    for block in motion.blocks():
        places, turns = _local(motion, joints, block)
        matrices = Rotation.from_quat(turns.reshape(-1, 4)).as_matrix().reshape(*turns.shape[:2], 3, 3)
        rows = np.concatenate([places, np.degrees(euler(matrices))], axis=-1).reshape(len(places), -1)[:, keep]
        # + 0.0 turns -0.0 into 0.0
        file.writelines(line % tuple(row) for row in (np.round(rows, 9) + 0.0).tolist())


def _numbers(vector: NDArray[np.float64]) -> str:
    return " ".join(f"{x:.8f}" for x in vector + 0.0)
