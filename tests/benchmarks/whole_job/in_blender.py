"""Run by a Python that has `bpy`: a skinned GLB follows a BVH, and its evaluated vertices become a PC2 point cache.

usage: in_blender.py RIG.glb MOTION.bvh OUT.pc2

Bones follow by Copy Rotation constraints from those that the two skeletons have in common, as one would set it up by
hand; the mesh is skinned by its painted weights.
"""

from __future__ import annotations

import struct
import sys

import bpy
import numpy as np

_FOLLOWS = {
    "spine05": "LowerBack",
    "spine03": "Spine",
    "spine01": "Spine1",
    "neck01": "Neck",
    "head": "Head",
    **{
        f"{ours}.{side[0]}": f"{side}{theirs}"
        for side in ("Left", "Right")
        for ours, theirs in {
            "upperleg01": "UpLeg",
            "lowerleg01": "Leg",
            "foot": "Foot",
            "clavicle": "Shoulder",
            "upperarm01": "Arm",
            "lowerarm01": "ForeArm",
            "wrist": "Hand",
        }.items()
    },
}


def main() -> None:
    rig_path, motion_path, out = sys.argv[1:4]
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_scene.gltf(filepath=rig_path)
    (rig,) = [thing for thing in bpy.data.objects if thing.type == "ARMATURE"]
    (skin,) = [thing for thing in bpy.data.objects if thing.type == "MESH" and thing.vertex_groups]
    bpy.ops.import_anim.bvh(filepath=motion_path, update_scene_fps=True, update_scene_duration=True)
    (motion,) = [thing for thing in bpy.data.objects if thing.type == "ARMATURE" and thing is not rig]
    for ours, theirs in _FOLLOWS.items():
        constraint = rig.pose.bones[ours].constraints.new("COPY_ROTATION")
        constraint.target, constraint.subtarget = motion, theirs
    scene = bpy.context.scene
    frames = range(scene.frame_start, scene.frame_end + 1)
    with open(out, "wb") as file:
        file.write(struct.pack("<12siiffi", b"POINTCACHE2\0", 1, len(skin.data.vertices), 0.0, 1.0, len(frames)))
        for frame in frames:
            scene.frame_set(frame)
            mesh = skin.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
            places = np.empty(3 * len(mesh.vertices), dtype=np.float32)
            mesh.vertices.foreach_get("co", places)
            file.write(places.data)


main()
