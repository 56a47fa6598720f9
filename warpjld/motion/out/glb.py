"""Writer of binary glTF with animated joints: the rig's own file with an added animation, or a new file.

For a rig that was read from glTF, the file is kept unchanged with its meshes, materials, skins and nodes; the new
animation is put before its own ones, since programs play the first. For any other rig a new file is made: the surface,
a skin and the joints in metres with Y up. All joints have rotation channels; translation channels are written only for
joints that move relative to their parent; scale stays as at rest. Time starts at 0.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.motion.out.baked_skin import BakedSkin
from warpjld.motion.out.glb_file import GlbFile
from warpjld.motion.out.gltf_new import new_document
from warpjld.motion.out.gltf_own import own_document
from warpjld.motion.out.local_motion import local_motion
from warpjld.motion.out.node_tree import NodeTree
from warpjld.motion.out.source_motion import SourceMotion, source_motion
from warpjld.motion.out.write import Timing, WrittenMotion
from warpjld.rig import Rig
from warpjld.skeleton import Poses

__all__ = ["animate", "write_glb"]

_CONSTANT = 1e-7  # largest translation relative to the parent that counts as constant, per size of the joints
_SHEARED = 1e-3  # smallest shear that is reported, per scale of the joint


def write_glb(path: Path, rig: Rig, poses: Poses, timing: Timing) -> WrittenMotion:
    """Write a motion of a rig's own joints as binary glTF; a :class:`~warpjld.motion.out.write.MotionWriter`."""
    motion = source_motion(rig, poses)
    notes = list(motion.notes)
    warnings: list[str] = []
    file, nodes = own_document(rig, motion, notes, warnings) or new_document(rig, motion, notes)
    animate(file, nodes, motion, timing, warnings)
    if timing.start_frame:
        notes.append(f"time starts at 0, which is frame {timing.start_frame}")
    file.write(path)
    return WrittenMotion(tuple(notes), tuple(warnings))


def animate(
    file: GlbFile,
    nodes: NodeTree,
    motion: SourceMotion,
    timing: Timing,
    warnings: list[str],
    baked: BakedSkin | None = None,
) -> None:
    """Add an animation of the joints, and of baked shapes, before those of the file."""
    count, frames = len(nodes.joints), len(motion)
    at = nodes.joints
    given = np.isin(np.arange(len(nodes.parents)), at)
    moved = np.flatnonzero(nodes.under(motion.owner >= 0)).tolist()
    # the keys of a joint are contiguous in the file; rotations are not copied, as they take most of the memory
    rotations = np.empty((len(moved), frames, 4), np.float32)
    translations: dict[int, NDArray[np.float32]] = {}
    strays, sheared = np.zeros(count), np.zeros(count)
    last = np.zeros((len(moved), 1, 4), np.float32)
    for block in motion.blocks():
        worlds = np.zeros((block.stop - block.start, len(given), 4, 4))
        worlds[:, at] = nodes.worlds(block)
        local = local_motion(worlds, nodes.parents, nodes.rest, nodes.scales, given)
        turns = local.rotations[:, at[moved]].swapaxes(0, 1).astype(np.float32)
        rotations[:, block] = _continuous(np.concatenate([last, turns], axis=1))[:, 1:]
        last = rotations[:, block.stop - 1 : block.stop]
        away = np.linalg.norm(local.translations[:, at] - nodes.rest[at, :3, 3], axis=-1).max(axis=0)
        strays = np.maximum(strays, away * nodes.reach)
        sheared = np.maximum(sheared, local.sheared[at])
        for joint in (j for j in moved if strays[j] > _CONSTANT * nodes.size):
            if joint not in translations:
                translations[joint] = np.empty((frames, 3), np.float32)
                translations[joint][: block.start] = nodes.rest[at[joint], :3, 3]
            translations[joint][block] = local.translations[:, at[joint]]
    times = file.add((np.arange(frames) / timing.rate).astype("<f4"), "SCALAR", bounds=True)
    samplers: list[dict[str, Any]] = []
    channels: list[dict[str, Any]] = []

    def channel(joint: int, path: str, values: NDArray[np.float32], kind: str) -> None:
        samplers.append({"input": times, "interpolation": "LINEAR", "output": file.add(values, kind)})
        target = {"node": int(nodes.numbers[at[joint]]), "path": path}
        channels.append({"sampler": len(samplers) - 1, "target": target})

    for turns, joint in zip(rotations, moved, strict=True):
        nodes.make_animatable(joint)
        channel(joint, "rotation", turns, "VEC4")
        if joint in translations:
            channel(joint, "translation", translations[joint], "VEC3")
    if baked is not None and baked.names:
        shown = file.add(baked.over_time.astype("<f4").reshape(-1), "SCALAR")
        samplers.append({"input": times, "interpolation": "LINEAR", "output": shown})
        mesh = next(n for n, node in enumerate(nodes.records) if "mesh" in node)
        channels.append({"sampler": len(samplers) - 1, "target": {"node": mesh, "path": "weights"}})
    file.content.setdefault("animations", []).insert(
        0, {"name": timing.name, "samplers": samplers, "channels": channels}
    )
    bent = [motion.tree.names[j] for j in moved if sheared[j] > _SHEARED]
    if bent:
        warnings.append(
            f"{len(bent)} joints are below one scaled by different factors ({', '.join(bent[:4])}): glTF cannot hold "
            f"the shear of their turns, up to {100 * sheared.max():.1f} % of their scale; their positions are exact"
        )


def _continuous(rotations: NDArray[np.float32]) -> NDArray[np.float32]:
    """Quaternions (N, F, 4) with such signs that consecutive frames interpolate the short way."""
    far = (rotations[:, 1:] * rotations[:, :-1]).sum(-1) < 0.0
    sign = np.where(np.logical_xor.accumulate(far, axis=1), np.float32(-1.0), np.float32(1.0))
    rotations[:, 1:] *= sign[..., None]
    return rotations
