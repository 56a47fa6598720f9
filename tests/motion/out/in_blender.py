"""Run by a Python that has `bpy`: open motion files, write where the heads of their bones are.

usage: in_blender.py OUT.json RATE FRAME,FRAME,… FILE …
For every file the names of its bones, and for every frame their heads in Blender's world axes.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import bpy


def opened(path: Path, rate: float) -> tuple[bpy.types.Object, float, float]:
    """The armature of a file, the scene's frame that shows its frame 0, and the scene's frames from one to the next."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene.render
    scene.fps, scene.fps_base = round(rate), 1.0
    first, step = 0.0, 1.0
    if path.suffix == ".bvh":
        bpy.ops.import_anim.bvh(filepath=str(path), frame_start=1)
        first = 1.0
    else:
        bpy.ops.import_scene.gltf(filepath=str(path))
        step = scene.fps / rate  # keys stand at their seconds times the scene's whole rate
    (armature,) = [thing for thing in bpy.context.scene.objects if thing.type == "ARMATURE"]
    return armature, first, step


def heads(armature: bpy.types.Object, at: float) -> list[list[float]]:
    bpy.context.scene.frame_set(int(at), subframe=at - int(at))
    posed = armature.evaluated_get(bpy.context.evaluated_depsgraph_get())
    return [list(posed.matrix_world @ bone.head) for bone in posed.pose.bones]


def main() -> None:
    out, rate = Path(sys.argv[1]), float(sys.argv[2])
    frames = [int(word) for word in sys.argv[3].split(",")]
    shown = {}
    for file in sys.argv[4:]:
        armature, first, step = opened(Path(file), rate)
        shown[Path(file).suffix] = {
            "names": [bone.name for bone in armature.pose.bones],
            "heads": [heads(armature, first + frame * step) for frame in frames],
        }
    out.write_text(json.dumps(shown), "utf-8")


main()
