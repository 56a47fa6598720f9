"""Run by a Python that has `bpy`: move a glTF rig and write it as USD and GLB, or show where a USD file's bones are.

usage: in_blender.py export RIG.glb OUT.usdc OUT.glb
       in_blender.py heads MOTION.usdc RATE FRAME,FRAME,… OUT.json
"""

from __future__ import annotations

import json
import sys

import bpy


def armature() -> bpy.types.Object:
    (found,) = [thing for thing in bpy.context.scene.objects if thing.type == "ARMATURE"]
    return found


def export(rig: str, usd: str, glb: str) -> None:
    bpy.ops.import_scene.gltf(filepath=rig)
    scene = bpy.context.scene
    scene.render.fps, scene.frame_start, scene.frame_end = 30, 1, 5
    for n, bone in enumerate(armature().pose.bones):
        bone.rotation_mode = "QUATERNION"
        for frame, turn in ((1, (1, 0, 0, 0)), (5, (0.97, 0.1 * (n % 3 - 1), 0.15, 0.05))):
            bone.rotation_quaternion = turn
            bone.keyframe_insert("rotation_quaternion", frame=frame)
    bpy.ops.wm.usd_export(filepath=usd, export_animation=True, export_armatures=True)
    bpy.ops.export_scene.gltf(filepath=glb, export_force_sampling=True, export_frame_range=True)


def heads(usd: str, rate: str, frames: str, out: str) -> None:
    scene = bpy.context.scene
    scene.render.fps, scene.render.fps_base = round(float(rate)), 1.0
    bpy.ops.wm.usd_import(filepath=usd)
    shown = []
    for frame in map(int, frames.split(",")):
        scene.frame_set(frame)
        posed = armature().evaluated_get(bpy.context.evaluated_depsgraph_get())
        shown.append([list(posed.matrix_world @ bone.head) for bone in posed.pose.bones])
    names = [bone.name for bone in armature().pose.bones]
    with open(out, "w", encoding="utf-8") as file:
        json.dump({"names": names, "heads": shown}, file)


bpy.ops.wm.read_factory_settings(use_empty=True)
{"export": export, "heads": heads}[sys.argv[1]](*sys.argv[2:])
