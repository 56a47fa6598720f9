"""Content of an FBX file in its own units and axes, for a process of its own: see :mod:`warpjld.runtime.separate`.

ufbx's Python binding (0.0.5) has a reference counting error: it keeps each element of a scene in a table and returns
the table's own reference, so that garbage collection frees elements twice. Here each element gets an additional
reference, nothing is ever freed, and the process ends after the call without cleaning up.
"""

from __future__ import annotations

import ctypes
import gc
import os
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError

__all__ = ["FBX_ARRAYS", "FBX_FRAMES", "leave_fbx"]

FBX_ARRAYS, FBX_FRAMES = "content.npz", "worlds"
"""Files that are left: arrays by name, and the transforms of an animation, (F, N, 4, 4) float64."""
Array = NDArray[Any]
KEPT: list[Any] = []
_TOGETHER = 500
"""Frames that one process evaluates: 15 KB remain of each where a scene has 25 joints."""
_TOO_MUCH = 2  # exit code of a process without memory
TRANSFORM = ("Lcl Translation", "Lcl Rotation", "Lcl Scaling")


def taken(element: Any) -> Any:
    """An element of the scene with an additional reference, which is never released."""
    if element is not None:
        ctypes.pythonapi.Py_IncRef(ctypes.py_object(element))
        KEPT.append(element)
    return element


def elements(several: Any) -> list[Any]:
    return [taken(several[i]) for i in range(len(several))]


def array(several: Any, dtype: Any) -> Array:
    return np.array(several, dtype=dtype) if len(several) else np.zeros(0, dtype)


def matrix(columns: Any) -> Array:
    out = np.eye(4)
    out[:3] = np.array(columns).T
    return out


def load(path: Path) -> Any:
    """The scene of a file; None if ufbx is there, but cannot be imported."""
    try:
        import ufbx
    except ImportError:
        return None
    try:
        return ufbx.load_file(
            str(path),
            file_format=ufbx.FileFormat.FBX,
            ignore_embedded=True,
            # invalid indices are reported by their user, not moved to another vertex silently
            index_error_handling=ufbx.IndexErrorHandling.NO_INDEX,
        )
    except (ufbx.UfbxError, RuntimeError, ValueError) as error:
        text = " ".join(str(error).split())
        if text.startswith("Out of memory"):
            raise MemoryError(text) from None
        raise InputError(f"cannot be read as FBX: {text}", path=path) from None


def bind_poses(scene: Any) -> dict[int, Array]:
    out: dict[int, Array] = {}
    for pose in elements(scene.poses):
        if pose.is_bind_pose:
            bones = pose.bone_poses
            for i in range(len(bones)):
                node = taken(bones[i].bone_node)
                if node is not None:
                    out.setdefault(node.typed_id, matrix(bones[i].bone_to_world))
    return out


def kind(node: Any) -> str:
    import ufbx

    kinds = ufbx.ElementType
    names = {kinds.BONE: "bone", kinds.EMPTY: "null", kinds.UNKNOWN: "null", kinds.MESH: "mesh", kinds.LOD_GROUP: "lod"}
    return names.get(node.attrib_type, "other")


def blend_offsets(mesh: Any, count: int) -> Array:
    """Sum of the blend shapes at their weights in the file."""
    out = np.zeros((count, 3))
    for deformer in elements(mesh.blend_deformers):
        for channel in elements(deformer.channels):
            keys = channel.keyframes
            for i in range(len(keys)):
                weight = keys[i].effective_weight
                if weight:
                    shape = taken(keys[i].shape)
                    index = array(shape.offset_vertices, np.int64)
                    known = index < count
                    np.add.at(out, index[known], weight * array(shape.position_offsets, np.float64)[known])
    return out


def mesh_arrays(mesh: Any, node: Any, number: dict[int, int], notes: list[str]) -> dict[str, Array]:
    """Arrays of one mesh at a node: see :class:`~warpjld.io.fbx.scene.FbxMesh`."""
    points = array(mesh.vertices, np.float64)
    faces = mesh.faces
    spans = np.array([tuple(faces[i]) for i in range(len(faces))], dtype=np.int64).reshape(-1, 2)
    # polygons need not be contiguous
    corner = np.concatenate([np.zeros(0, np.int64), *(np.arange(a, a + n) for a, n in spans)])
    out = {
        "points": points + blend_offsets(mesh, len(points)),
        "counts": spans[:, 1],
        "corners": array(mesh.vertex_indices, np.int64)[corner],
        "shown": matrix(node.geometry_to_world),
    }
    if mesh.vertex_uv.exists:
        values = np.vstack([array(mesh.vertex_uv.values, np.float32).reshape(-1, 2), np.zeros((1, 2), np.float32)])
        index = array(mesh.vertex_uv.indices, np.int64)[corner]
        missing = index >= len(values) - 1
        if missing.any():
            notes.append(f"mesh '{node.name}': {int(missing.sum())} corners have no texture coordinates: 0, 0")
        out["uv"] = values[np.where(missing, len(values) - 1, index)]
    skins = elements(mesh.skin_deformers)
    if len(skins) > 1:
        notes.append(f"mesh '{node.name}' has {len(skins)} skins: the first is read")
    if skins and skins[0].skinning_method.name in ("DUAL_QUATERNION", "BLENDED_DQ_LINEAR"):
        notes.append(f"mesh '{node.name}': its skin blends dual quaternions: of it the weights are read")
    clusters = [(c, taken(c.bone_node)) for c in (elements(skins[0].clusters) if skins else ())]
    if any(bone is None for _, bone in clusters):
        notes.append(f"mesh '{node.name}': clusters without a bone are left out")
    clusters = [(c, bone) for c, bone in clusters if bone is not None]
    if clusters:
        out["nodes"] = np.array([number[bone.typed_id] for _, bone in clusters])
        out["binds"] = np.array([matrix(c.bind_to_world) for c, _ in clusters])
        out["inverses"] = np.array([matrix(c.geometry_to_bone) for c, _ in clusters])
        vertices = [array(c.vertices, np.int64) for c, _ in clusters]
        out["cluster"] = np.repeat(np.arange(len(clusters)), [len(v) for v in vertices])
        out["vertex"] = np.concatenate(vertices)
        out["weight"] = np.concatenate([array(c.weights, np.float64) for c, _ in clusters])
    return out


def texture_file(mesh: Any) -> str:
    """File of the base colour texture of a mesh with one material, as the file names it; "" without one."""
    materials = elements(mesh.materials)
    if len(materials) != 1:
        return ""
    maps = [materials[0].pbr.base_color, materials[0].fbx.diffuse_color]
    KEPT.extend(maps)
    for texture in (taken(one.texture) for one in maps):
        if texture is not None:
            return str(texture.relative_filename or texture.filename)
    return ""


def stacks(scene: Any, number: dict[int, int]) -> list[dict[str, Any]]:
    """Name, time span and moved nodes of every animation stack; the span is that of the keys if it states none."""
    out: list[dict[str, Any]] = []
    for stack in elements(scene.anim_stacks):
        moved, curved, times, shapes = set(), set(), [], False
        for layer in elements(stack.layers):
            props = layer.anim_props
            for i in range(len(props)):
                element = taken(props[i].element)
                if type(element).__name__ == "BlendChannel" and props[i].prop_name == "DeformPercent":
                    shapes = shapes or any(varies(c) for c in elements(taken(props[i].anim_value).curves))
                if type(element).__name__ != "Node" or props[i].prop_name not in TRANSFORM:
                    continue
                curves: Any = taken(props[i].anim_value).curves
                moved.add(number[element.typed_id])
                for curve in elements(curves):
                    keys: Any = () if curve is None else curve.keyframes
                    if len(keys):
                        times += [keys[0].time, keys[len(keys) - 1].time]
                    if len(keys) > 1:
                        curved.add(number[element.typed_id])
        begin, end = stack.time_begin, stack.time_end
        if not end > begin and times:
            begin, end = min(times), max(times)
        found = {"moved": sorted(moved), "curved": sorted(curved), "shapes": shapes}
        name, count = stack.name, 1
        while name in [other["name"] for other in out]:  # as warpjld.io.unique_names
            count += 1
            name = f"{stack.name}#{count}"
        out.append({"name": name, "begin": begin, "end": end, **found})
    return out


def varies(curve: Any) -> bool:
    """Whether a curve (or None) has keys of different values."""
    keys: Any = () if curve is None else curve.keyframes
    return len({keys[i].value for i in range(len(keys))}) > 1


def sample(scene: Any, stack: int, times: Array, out: Path) -> None:
    """Write node-to-world transforms per frame, evaluated by ufbx, shape (F, N, 4, 4), as raw float64.

    What the binding leaves behind for each frame ends with a process of its own for every few hundred of them, where
    processes can be forked.
    """
    anim = taken(taken(scene.anim_stacks[stack]).anim)
    out.touch()
    for start in range(0, len(times), _TOGETHER):
        some = times[start : start + _TOGETHER]
        if hasattr(os, "fork") and len(times) > _TOGETHER:
            forked(partial(evaluate, scene, anim, some, out))
        else:
            evaluate(scene, anim, some, out)


def evaluate(scene: Any, anim: Any, times: Array, out: Path) -> None:
    """Append transforms at some times to the file."""
    world = np.tile(np.eye(4), (len(scene.nodes), 1, 1))
    with out.open("ab") as file:
        for time in times:
            shown = scene.evaluate(anim, float(time))
            KEPT.append(shown)
            nodes = shown.nodes
            for n in range(len(nodes)):
                world[n, :3] = np.array(taken(nodes[n]).node_to_world).T
            shown.free()  # frees its memory; the Python objects of its nodes remain
            file.write(world.tobytes())


def forked(call: Callable[[], None]) -> None:
    """Call in a copy of this process, which then ends.

    Raises:
        MemoryError: It needs more than this process may use.
        RuntimeError: It raises, or crashes.
    """
    child = os.fork()
    if child == 0:
        code = 1
        try:
            call()
            code = 0
        except MemoryError:
            code = _TOO_MUCH
        finally:
            os._exit(code)
    _, status = os.waitpid(child, 0)
    code = os.waitstatus_to_exitcode(status)
    if code == _TOO_MUCH:
        raise MemoryError
    if code:
        raise RuntimeError(f"ufbx cannot evaluate the animation: its process ends with code {code}")


def leave_fbx(folder: Path, path: Path, animated: bool, name: str, rate: float) -> dict[str, Any]:
    """Write the arrays of a file to the folder, and return the rest.

    Args:
        folder: The folder.
        path: The file.
        animated: Whether to read an animation.
        name: Its name; empty for the first that moves anything.
        rate: Frames a second; 0 for the file's own.

    Raises:
        InputError: ufbx cannot read the file, or the animation is too long.
    """
    gc.disable()  # it would free elements in use
    scene = load(path)
    if scene is None:
        return {"missing": True}
    KEPT.append(scene)
    nodes = elements(scene.nodes)
    number = {node.typed_id: n for n, node in enumerate(nodes)}
    above = [taken(node.parent) for node in nodes]
    parents = [-1 if parent is None else number[parent.typed_id] for parent in above]
    poses = bind_poses(scene)
    notes: list[str] = []
    nothing = np.full((4, 4), np.nan)
    arrays = {
        "shown": np.array([matrix(node.node_to_world) for node in nodes]),
        "pose": np.array([poses.get(node.typed_id, nothing) for node in nodes]),
    }
    meshes: list[dict[str, Any]] = []
    for n, node in enumerate(nodes):
        mesh = taken(node.mesh)
        if mesh is not None and len(mesh.vertices):
            arrays |= {f"{len(meshes)}.{k}": v for k, v in mesh_arrays(mesh, node, number, notes).items()}
            meshes.append({"name": node.name or mesh.name, "node": n, "texture": texture_file(mesh)})
    settings = scene.settings
    told: dict[str, Any] = {
        "names": [node.name for node in nodes],
        "parents": parents,
        "kinds": [kind(node) for node in nodes],
        "axes": [int(axis) for axis in settings.axes],
        "unit": settings.unit_meters,
        "rate": settings.frames_per_second,
        "meshes": meshes,
        "stacks": stacks(scene, number),
        "notes": notes,
    }
    chosen = choose(told["stacks"], name) if animated else None
    if chosen is not None:
        stack = told["stacks"][chosen]
        rate_ = rate or stated_rate(settings.frames_per_second)
        rate_ = rate_ if np.isfinite(rate_) and rate_ > 0.0 else 30.0
        count = (stack["end"] - stack["begin"]) * rate_
        if not 0.0 <= count < 1e6:
            raise InputError(f"animation '{stack['name']}' would have {count:.3g} frames: at most 1000000", path=path)
        # as warpjld.motion.frame_times: rounding (23.976, float32) must not lose the last frame
        slack = min(0.01 + 2e-5 * count, 0.4)
        times = np.minimum(stack["begin"] + np.arange(int(np.floor(count + slack)) + 1) / rate_, stack["end"])
        sample(scene, chosen, times, folder / FBX_FRAMES)
        told |= {"chosen": stack["name"], "rate": rate_}
    np.savez(folder / FBX_ARRAYS, **arrays)  # type: ignore[arg-type]
    return told


def stated_rate(rate: float) -> float:
    """Exact frame rate of a rounded one: 23.976 as float32 is 24000/1001, and likewise for other NTSC rates."""
    broadcast = round(rate * 1.001) / 1.001
    nearest = min((float(round(rate)), broadcast), key=lambda nice: abs(nice - rate))
    return nearest if abs(nearest - rate) <= 2e-5 * rate else rate


def choose(several: list[dict[str, Any]], name: str) -> int | None:
    """Index of the stack of this name, or of the first that moves something; None if there is none.

    Differences in case, and the object's name that Blender puts before an action's, are ignored if this is unambiguous.
    """
    if name:
        for plain in (str, str.lower, lambda full: full.rpartition("|")[2].lower()):
            found = [i for i, stack in enumerate(several) if plain(stack["name"]) == plain(name)]
            if len(found) == 1:
                return found[0]
        return None
    for wanted in ("curved", "moved"):
        for i, stack in enumerate(several):
            if stack[wanted]:
                return i
    return None
