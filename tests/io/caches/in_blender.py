"""Run by a Python that has `bpy`: load a folder of caches, write the vertices that Blender shows.

usage: in_blender.py FOLDER START FRAMES RATE OUT.npz
For every format an array (frames, W, 3) in Blender's world axes, at the scene frames START … START + FRAMES - 1.
"""

from __future__ import annotations

import sys
from pathlib import Path

import bpy
import numpy as np


def empty_scene(start: int, frames: int, rate: float) -> None:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.fps, scene.render.fps_base = round(rate), 1.0
    scene.frame_start, scene.frame_end = start, start + frames - 1


def the_mesh() -> bpy.types.Object:
    (mesh,) = [thing for thing in bpy.context.scene.objects if thing.type == "MESH"]
    return mesh


def shown(frame: int, subframe: float = 0.0) -> np.ndarray:
    bpy.context.scene.frame_set(frame, subframe=subframe)
    evaluated = the_mesh().evaluated_get(bpy.context.evaluated_depsgraph_get())
    mesh = evaluated.to_mesh()
    local = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", local)
    world = np.array(evaluated.matrix_world)
    evaluated.to_mesh_clear()
    return local.reshape(-1, 3) @ world[:3, :3].T + world[:3, 3]


def texture() -> tuple[np.ndarray, np.ndarray]:
    """Texture coordinates of every corner, and its vertex."""
    mesh = the_mesh().data
    corners = np.array([item.vector for item in mesh.uv_layers[0].uv], np.float32)
    return corners, np.array([loop.vertex_index for loop in mesh.loops])


def volume(frame: int) -> np.ndarray:
    """Volume that the mesh encloses: positive where Blender takes its faces to look outwards."""
    bpy.context.scene.frame_set(frame)
    mesh = the_mesh().evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
    mesh.calc_loop_triangles()
    middle = sum((vertex.co for vertex in mesh.vertices), start=mesh.vertices[0].co * 0.0) / len(mesh.vertices)
    corners = [[mesh.vertices[v].co - middle for v in triangle.vertices] for triangle in mesh.loop_triangles]
    return np.array(sum(a.dot(b.cross(c)) for a, b, c in corners) / 6.0)


def point_cache(folder: Path, suffix: str, start: int) -> None:
    bpy.ops.wm.obj_import(filepath=str(folder / f"{suffix}.rest.obj"))
    cache = the_mesh().modifiers.new("cache", "MESH_CACHE")
    cache.cache_format = suffix.upper()
    cache.filepath = str(folder / f"{suffix}.{suffix}")
    cache.frame_start = start
    cache.interpolation = "NONE"


def main() -> None:
    folder, out = Path(sys.argv[1]), Path(sys.argv[5])
    start, frames, rate = int(sys.argv[2]), int(sys.argv[3]), float(sys.argv[4])
    numbers = range(start, start + frames)
    results: dict[str, np.ndarray] = {}
    for suffix in ("usdc", "usda"):
        empty_scene(start, frames, rate)
        bpy.ops.wm.usd_import(filepath=str(folder / f"{suffix}.{suffix}"))
        results[suffix] = np.stack([shown(number) for number in numbers])
    for suffix in ("pc2", "mdd"):
        empty_scene(start, frames, rate)
        point_cache(folder, suffix, start)
        results[suffix] = np.stack([shown(number) for number in numbers])
    pictures = []
    for number in numbers:
        empty_scene(start, frames, rate)
        bpy.ops.wm.obj_import(filepath=str(folder / f"obj.{number:04d}.obj"))
        pictures.append(shown(number))
    results["obj"] = np.stack(pictures)
    empty_scene(start, frames, rate)
    bpy.ops.wm.alembic_import(filepath=str(folder / "abc.abc"), as_background_job=False, set_frame_range=False)
    results["abc"] = np.stack([shown(number) for number in numbers])
    results["abc_outside"] = volume(start)
    results["abc_uv"], results["abc_corner"] = texture()
    empty_scene(start, frames, rate)
    bpy.ops.import_scene.gltf(filepath=str(folder / "glb.glb"))
    # its time starts at zero, and Blender counts that as frame 0
    results["glb"] = np.stack([shown(number - start) for number in numbers])
    results["glb_uv"], results["glb_corner"] = texture()
    np.savez(out, **results)


main()
