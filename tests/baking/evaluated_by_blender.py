"""Run by a Python that has `bpy`: the vertices that Blender evaluates of a GLB's skinned mesh, frame after frame.

usage: evaluated_by_blender.py FILE.glb RATE FRAMES OUT.npy

Blender turns Y up to Z up; the array is turned back, shape (F, N, 3).
"""

from __future__ import annotations

import sys

import bpy
import numpy as np


def main() -> None:
    path, rate, frames, out = sys.argv[1:5]
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.fps, scene.render.fps_base = int(rate), 1.0
    bpy.ops.import_scene.gltf(filepath=path)
    (thing,) = [t for t in scene.objects if t.type == "MESH" and t.vertex_groups]
    places = []
    for frame in range(int(frames)):
        scene.frame_set(frame)
        shown = thing.evaluated_get(bpy.context.evaluated_depsgraph_get())
        mesh = shown.to_mesh()
        local = np.empty(3 * len(mesh.vertices))
        mesh.vertices.foreach_get("co", local)
        world = np.array(shown.matrix_world)
        at = local.reshape(-1, 3) @ world[:3, :3].T + world[:3, 3]
        places.append(np.column_stack([at[:, 0], at[:, 2], -at[:, 1]]))
        shown.to_mesh_clear()
    np.save(out, np.array(places))


main()
