"""Rigs as Blender exports them, by format and option, against its plainest GLB of the same scene.

Wants a Python with `bpy`, named by WARPJLD_BPY_PYTHON.
"""

from __future__ import annotations

import json
import os
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from warpjld.errors import InputError
from warpjld.io import load_rig
from warpjld.motion import load_motion
from warpjld.motion.load import LoadedMotion
from warpjld.rig import Rig

pytest.importorskip("ufbx")
pytest.importorskip("pxr")

DATA = Path(__file__).resolve().parents[3] / "shared" / "data"
FILES = (
    "hand_webxr_generic/left.glb",
    "hand_anny/right.glb",
    "hand_godot_low/Hand_low_L.gltf",
    "body_mesh2motion_mannequin/human-male.glb",
    "body_anny/body_lowpoly_163joints.glb",
)
PLACE, MOVED, TURN = 1e-6, 5e-6, 1e-5
"""Of a body's 2 m: rests, and places down chains of joints whose keys are single floats."""
LEFT_OUT = 1.2e-4
FRAMES = 8
PLAIN = {"bake_anim_simplify_factor": 0.0, "bake_anim_use_all_actions": False, "bake_anim_use_nla_strips": False}
GLB = {"export_force_sampling": True, "export_frame_range": True, "export_all_influences": True}

Job = dict[str, Any]
FBX: dict[str, Job] = {
    "plain": {},
    "a hundredth": {"global_scale": 0.01},
    "no unit": {"apply_unit_scale": False},
    "all of the scale": {"apply_scale_options": "FBX_SCALE_ALL"},
    "scale of units": {"apply_scale_options": "FBX_SCALE_UNITS"},
    "Z up": {"axis_forward": "Y", "axis_up": "Z"},
    "X up": {"axis_forward": "Y", "axis_up": "X"},
    "facing X": {"axis_forward": "X", "axis_up": "Y"},
    "baked axes": {"bake_space_transform": True, "axis_forward": "Y", "axis_up": "Z"},
    "no leaves": {"add_leaf_bones": False},
    "bones along X": {"primary_bone_axis": "X", "secondary_bone_axis": "Y"},
    "armature a bone": {"armature_nodetype": "LIMBNODE"},
    "two stacks": {"bake_anim_use_all_actions": True},
}
USD: dict[str, Job] = {
    "plain": {},
    "text": {},
    "package": {},
    "no root": {"root_prim_path": ""},
    "Y up": {"convert_orientation": True},
    "instances": {"use_instancing": True},
    "inches": {"convert_scene_units": "INCHES"},
    "matrices": {"xform_op_mode": "MAT"},
}
SUFFIX = {"text": ".usda", "package": ".usdz"}


def jobs(folder: Path) -> list[Job]:
    out: list[Job] = []

    def job(name: str, operator: str, options: Job, **more: object) -> None:
        out.append({"out": str(folder / name), "operator": operator, "options": options, **more})

    job("plain.glb", "export_scene.gltf", {**GLB, "export_animation_mode": "ACTIONS"})
    for name, options in FBX.items():
        job(f"{name}.fbx", "export_scene.fbx", {**PLAIN, **options}, frame=4)
    for base in (24, 30, 60):
        job(f"{base} of broadcasts.fbx", "export_scene.fbx", PLAIN, frame=4, fps=base, fps_base=1.001)
    for name, options in USD.items():
        job(f"{name}{SUFFIX.get(name, '.usdc')}", "wm.usd_export", {"export_animation": True, **options}, frame=4)
    for name, more in (("flat", {"export_hierarchy_flatten_bones": True}), ("not at rest", {})):
        shown = {"export_rest_position_armature": name == "flat"}
        job(f"{name}.glb", "export_scene.gltf", {**GLB, **more, **shown}, frame=4)
    job("draco.glb", "export_scene.gltf", {**GLB, "export_draco_mesh_compression_enable": True})
    bvh = {"frame_start": 1, "frame_end": FRAMES}
    job("metres.bvh", "export_anim.bvh", bvh)
    job("centimetres.bvh", "export_anim.bvh", {**bvh, "global_scale": 100.0, "rotate_mode": "XYZ"})
    return out


def similarity(a: NDArray[np.float64], b: NDArray[np.float64]) -> tuple[float, Rotation, NDArray[np.float64]]:
    """Scale, turn and move that bring places on others best."""
    middles = a.mean(axis=0), b.mean(axis=0)
    left, _, right = np.linalg.svd((b - middles[1]).T @ (a - middles[0]))
    turn = Rotation.from_matrix(left @ np.diag([1.0, 1.0, np.linalg.det(left @ right)]) @ right)
    scale = float(np.linalg.norm(b - middles[1]) / np.linalg.norm(a - middles[0]))
    return scale, turn, middles[1] - scale * turn.apply(middles[0])


def skinned(rig: Rig, motion: LoadedMotion, frame: int) -> NDArray[np.float64]:
    """Vertices by the painted weights."""
    assert rig.skin is not None
    turn = Rotation.from_quat(motion.poses.rotations[frame]).as_matrix()[rig.skin.joints]
    offset = rig.surface.vertices[:, None] - rig.skeleton.rest[rig.skin.joints]
    moved = np.einsum("vkij,vkj->vki", turn, offset) + motion.poses.positions[frame][rig.skin.joints]
    return np.asarray((rig.skin.weights[..., None] * moved).sum(axis=1))


def by_joint(rig: Rig) -> NDArray[np.float64]:
    """Painted weights, shape (V, J)."""
    assert rig.skin is not None
    out = np.zeros((len(rig.surface.vertices), len(rig.skeleton)))
    np.add.at(out, (np.arange(len(out))[:, None], rig.skin.joints), rig.skin.weights)
    return out


def compare(path: Path, rig: Rig, plain: Rig, wanted: LoadedMotion, animation: str | None) -> None:
    order = [rig.skeleton.names.index(name) for name in plain.skeleton.names]
    assert len(order) == len(rig.skeleton)
    both = zip(plain.sources, (rig.sources[j] for j in order), strict=True)
    own = np.array([j for j, (a, b) in enumerate(both) if a >= 0 and b >= 0])  # a flat file does not say what a tip is
    assert len(own) >= 0.9 * sum(source >= 0 for source in plain.sources)
    rest = rig.skeleton.rest[order]
    scale, turn, move = similarity(rest[own], plain.skeleton.rest[own])
    assert np.abs(turn.as_matrix() - np.round(turn.as_matrix())).max() < TURN  # axes, and nothing between
    np.testing.assert_allclose((scale * turn.apply(rest) + move)[own], plain.skeleton.rest[own], atol=PLACE)
    vertices = scale * turn.apply(rig.surface.vertices) + move
    apart, near = cKDTree(vertices).query(plain.surface.vertices)
    assert len(vertices) == len(plain.surface.vertices)
    assert apart.max() < PLACE
    read = load_motion(path, rig, animation=animation)
    assert len(read.poses) == FRAMES
    places = scale * turn.apply(read.poses.positions[:, order].reshape(-1, 3)) + move
    np.testing.assert_allclose(places.reshape(FRAMES, -1, 3)[:, own], wanted.poses.positions[:, own], atol=MOVED)
    turns = turn * Rotation.from_quat(read.poses.rotations[:, order][:, own].reshape(-1, 4)) * turn.inv()
    expected = Rotation.from_quat(wanted.poses.rotations[:, own].reshape(-1, 4))
    assert (turns * expected.inv()).magnitude().max() < TURN
    if rig.skin is not None and plain.skin is not None:
        # weights up to 1e-4, which its glTF leaves out, Blender writes to FBX and USD: motions are compared by one skin
        np.testing.assert_allclose(by_joint(rig)[near][:, order], by_joint(plain), atol=LEFT_OUT)
        skin = replace(plain.skin, joints=np.array(order)[plain.skin.joints])
        alike = replace(rig, skin=skin, surface=replace(rig.surface, vertices=rig.surface.vertices[near]))
        flesh = scale * turn.apply(skinned(alike, read, FRAMES - 1)) + move
        np.testing.assert_allclose(flesh, skinned(plain, wanted, FRAMES - 1), atol=2.0 * MOVED)


@pytest.mark.slow
@pytest.mark.parametrize("file", FILES)
def test_whatever_blender_exports_is_the_same_rig(tmp_path: Path, file: str) -> None:
    python = os.environ.get("WARPJLD_BPY_PYTHON")
    if not python:
        pytest.skip("WARPJLD_BPY_PYTHON does not name a Python that has bpy")
    if not (DATA / file).exists():
        pytest.skip(f"no {DATA / file}")
    told = tmp_path / "jobs.json"
    told.write_text(json.dumps(jobs(tmp_path)), "utf-8")
    script = Path(__file__).with_name("exported_by_blender.py")
    done = subprocess.run([python, script, DATA / file, told], capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "FAILED" not in done.stdout, done.stdout
    plain = load_rig(tmp_path / "plain.glb")
    wanted = {name: load_motion(tmp_path / "plain.glb", plain, animation=name) for name in ("First", "Second")}
    with pytest.raises(InputError, match="draco"):
        load_rig(tmp_path / "draco.glb")
    wrong = []
    for job in jobs(tmp_path):
        path = Path(job["out"])
        if path.name in ("plain.glb", "draco.glb") or (path.name == "flat.glb" and file.startswith("body")):
            continue  # not yet: what a hierarchy alone tells, toes, halves of limbs and leaves of bodies' bones
        try:
            rig = plain if path.suffix == ".bvh" else load_rig(path)
            compare(path, rig, plain, wanted["First"], "First" if path.stem == "two stacks" else None)
            if path.stem == "two stacks":
                compare(path, rig, plain, wanted["Second"], "Second")
        except (AssertionError, InputError, ValueError) as error:
            wrong.append(f"{path.name}: {error}")
    assert not wrong, "\n".join(wrong)
