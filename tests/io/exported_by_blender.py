"""Run by a Python that has `bpy`: import a glTF rig, give it two animations, write it as every job says.

usage: exported_by_blender.py RIG.glb JOBS.json

A job is ``{"out": file, "operator": "export_scene.fbx", "options": {…}, "frame": shown when it is written,
"fps": 24, "fps_base": 1}``. What could not be written is printed, a line each.
"""

from __future__ import annotations

import json
import random
import sys

import bpy
from mathutils import Quaternion, Vector

FRAMES = 8


def animate(armature: bpy.types.Object, name: str, seed: int, widest: float) -> bpy.types.Action:
    """An action that turns every bone and moves the topmost ones."""
    action = bpy.data.actions.new(name)
    action.use_fake_user = True
    armature.animation_data_create().action = action
    rng = random.Random(seed)
    size = max(armature.dimensions) / (sum(armature.matrix_world.to_scale()) / 3.0)
    for bone in armature.pose.bones:
        bone.rotation_mode = "QUATERNION"
        axis = Vector([rng.uniform(-1.0, 1.0) for _ in range(3)]).normalized()
        angle = rng.uniform(0.2, widest)
        step = Vector([rng.uniform(-0.05, 0.05) for _ in range(3)]) * size
        for frame in range(FRAMES):
            share = frame / (FRAMES - 1)
            bone.rotation_quaternion = Quaternion(axis, angle * share)
            bone.keyframe_insert("rotation_quaternion", frame=1 + frame)
            if bone.parent is None:
                bone.location = step * share
                bone.keyframe_insert("location", frame=1 + frame)
    return action


def main() -> None:
    source, jobs = sys.argv[1:3]
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_scene.gltf(filepath=source)
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = 1, FRAMES
    for thing in list(scene.objects):  # Blender's importer adds a shape to draw bones with
        if thing.type == "MESH" and not thing.vertex_groups:
            bpy.data.objects.remove(thing)
    (armature,) = [thing for thing in scene.objects if thing.type == "ARMATURE"]
    armature.animation_data_clear()
    for action in list(bpy.data.actions):
        bpy.data.actions.remove(action)
    animate(armature, "Second", 5, 0.9)
    first = animate(armature, "First", 3, 0.6)
    armature.animation_data.action = first
    with open(jobs, encoding="utf-8") as file:
        told = json.load(file)
    for job in told:
        scene.render.fps, scene.render.fps_base = job.get("fps", 24), job.get("fps_base", 1.0)
        scene.frame_set(job.get("frame", 1))
        group, _, operator = job["operator"].partition(".")
        try:
            getattr(getattr(bpy.ops, group), operator)(filepath=job["out"], **job["options"])
        except Exception as error:
            print(f"FAILED {job['out']}: {error}")


main()
