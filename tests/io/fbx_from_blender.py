"""Run by a Python that has `bpy`: import a GLB, animate its bones, write it as FBX and as GLB again.

usage: fbx_from_blender.py FILE.glb OUT.fbx OUT.glb
"""

from __future__ import annotations

import random
import sys

import bpy
from mathutils import Quaternion, Vector

FRAMES, RATE = 8, 24


def main() -> None:
    source, fbx, glb = sys.argv[1:4]
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_scene.gltf(filepath=source)
    scene = bpy.context.scene
    scene.render.fps, scene.render.fps_base = RATE, 1.0
    scene.frame_start, scene.frame_end = 1, FRAMES
    for thing in list(scene.objects):  # Blender's importer adds a shape to draw bones with
        if thing.type == "MESH" and not thing.vertex_groups:
            bpy.data.objects.remove(thing)
    (armature,) = [thing for thing in scene.objects if thing.type == "ARMATURE"]
    if armature.animation_data:
        armature.animation_data_clear()
    for action in list(bpy.data.actions):
        bpy.data.actions.remove(action)
    random.seed(3)
    for bone in armature.pose.bones:
        bone.rotation_mode = "QUATERNION"
        axis = Vector([random.uniform(-1.0, 1.0) for _ in range(3)]).normalized()
        angle = random.uniform(0.2, 0.6)
        for frame in range(FRAMES):
            bone.rotation_quaternion = Quaternion(axis, angle * frame / (FRAMES - 1))
            bone.keyframe_insert("rotation_quaternion", frame=1 + frame)
    scene.frame_set(1)  # as bound: the rest of a glTF file is the pose that it shows
    bpy.ops.export_scene.gltf(filepath=glb, export_force_sampling=True, export_frame_range=True)
    scene.frame_set(FRAMES // 2)  # nodes show another pose than the one that is bound
    bpy.ops.export_scene.fbx(filepath=fbx, bake_anim_simplify_factor=0.0)


main()
