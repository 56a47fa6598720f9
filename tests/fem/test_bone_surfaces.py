"""Bones with the shape that a file gives them (R105)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from warpjld.errors import InputError
from warpjld.fem.bone_surfaces import BoneSurface, bones_of_segments, read_bones
from warpjld.fem.flesh import flesh_of
from warpjld.fem.load.loads import volumes
from warpjld.geometry.surface import weld_surface
from warpjld.rig import Rig
from warpjld.skeleton import poses_from_angles
from warpjld.skeleton.tree import Skeleton

SIZES = {"middle": (0.03, 0.012, 0.012), "tip": (0.026, 0.008, 0.016)}  # of the bones [m]


def limb() -> Rig:
    """A block of flesh 0.1 m long with two segments along x, and a hinge at its middle."""
    block = trimesh.creation.box((0.1, 0.032, 0.032))
    block = block.subdivide().subdivide()
    skeleton = Skeleton(
        ("root", "middle", "tip"),
        np.array([-1, 0, 1], np.int32),
        np.array([[-0.05, 0, 0], [0, 0, 0], [0.05, 0, 0]]),
        np.tile([0.0, 0.0, 1.0], (3, 1)),
        np.tile([-2.0, 2.0], (3, 4, 1)),
    )
    return Rig("limb", skeleton, weld_surface(np.asarray(block.vertices), np.asarray(block.faces)))


def bones() -> dict[str, trimesh.Trimesh]:
    middles = {"middle": (-0.025, 0.0, 0.0), "tip": (0.025, 0.0, 0.0)}
    return {
        name: trimesh.creation.box(size, trimesh.transformations.translation_matrix(middles[name]))
        for name, size in SIZES.items()
    }


def written(folder: Path, names: dict[str, str]) -> Path:
    """An OBJ file of the bones, a group for each."""
    lines, count = [], 0
    for name, mesh in bones().items():
        lines.append(f"o {names[name]}")
        lines += [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in mesh.vertices]
        lines += [f"f {a} {b} {c}" for a, b, c in mesh.faces + count + 1]
        count += len(mesh.vertices)
    path = folder / "bones.obj"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


@pytest.mark.parametrize("names", [{"middle": "middle", "tip": "tip"}, {"middle": "humerus", "tip": "ulna"}])
def test_bones_are_where_the_file_has_them_and_move_rigidly(tmp_path: Path, names: dict[str, str]) -> None:
    rig, spacing = limb(), 0.004
    flesh = flesh_of(rig, spacing, bones=read_bones(written(tmp_path, names), rig))
    assert flesh.names == ("bone.middle", "bone.tip")
    size = volumes(flesh.mesh)
    for name, extent in SIZES.items():
        own = np.isin(flesh.mesh.elements, flesh.mesh.node_sets[f"bone.{name}"]).all(axis=1)
        middles = flesh.mesh.nodes[flesh.mesh.elements[own]].mean(axis=1) - bones()[name].centroid
        assert (np.abs(middles) <= 0.5 * np.array(extent) + 1e-6).all()
        assert size[own].sum() == pytest.approx(np.prod(extent), rel=0.35)  # whole elements
    angles = np.zeros((1, 3, 4))
    angles[0, 1, 0] = 0.5
    held = flesh.held(poses_from_angles(rig.skeleton, angles))
    nodes = flesh.mesh.node_sets["bone.tip"]
    moved = held.values[np.isin(held.degrees // 3, nodes)].reshape(-1, 3) + flesh.mesh.nodes[nodes]
    turned = Rotation.from_rotvec([0.0, 0.0, 0.5]).apply(flesh.mesh.nodes[nodes])
    np.testing.assert_allclose(np.linalg.norm(moved, axis=1), np.linalg.norm(turned, axis=1), atol=1e-9)
    assert min(np.abs(moved - turned).max(), np.abs(moved * [1, -1, 1] - turned * [1, 1, 1]).max()) < 1e-9


def test_bones_that_are_none_of_this_rig() -> None:
    rig = limb()
    mesh = bones()["tip"]
    far = BoneSurface("ulna", np.asarray(mesh.vertices) * 1000.0, np.asarray(mesh.faces, np.int32))
    with pytest.raises(InputError, match=r"'ulna' lies .* from the nearest segment"):
        bones_of_segments(rig, [far])
    near = BoneSurface("ulna", np.asarray(mesh.vertices), np.asarray(mesh.faces, np.int32))
    with pytest.raises(InputError, match="'ulna' and 'radius' both lie along tip"):
        bones_of_segments(rig, [near, BoneSurface("radius", near.vertices, near.faces)])
