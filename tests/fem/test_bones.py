"""Bones in meshes of a regular grid: against a mesh whose lines follow the bone."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray

from warpjld.fem import Body, Fung, HexMesh, box_hexes, prescribe
from warpjld.fem.contact import Pair, press
from warpjld.fem.contact.obstacles.solids import Plane
from warpjld.fem.load.loads import volumes
from warpjld.fem.mesh.bones import Bone, claimed, fitted
from warpjld.fem.mesh.envelope import Envelope
from warpjld.fem.mesh.fit import fit_mesh
from warpjld.fem.mesh.hexmesh import elements_of

RADIUS, LENGTH = 7e-3, 0.04
"""Of a cylinder of flesh along z [m]."""
AXIS, THICK = np.array([0.5e-3, 2.5e-3]), 3.1e-3
"""Where the bone lies in its section, and its radius [m]: 4 mm of flesh under it, 1.2 mm above."""
FLESH = Fung(34e3, 3.0, 0.48)
DOWN = (0.8e-3, 1.6e-3, 2.4e-3)
"""How far a plate is pressed into it [m]."""


def forces(mesh: HexMesh, bone: NDArray[np.integer], skin: NDArray[np.int32]) -> NDArray[np.float64]:
    """Force of the plate on a slice of the cylinder over its thickness [N/m]; all displacements lie in its section."""
    rest = np.setdiff1d(np.arange(len(mesh.nodes)), bone)
    held = prescribe(mesh, bone, x=0.0, y=0.0, z=0.0) + prescribe(mesh, rest, z=0.0)
    plate = Plane((0.0, -RADIUS, 0.0), (0.0, 1.0, 0.0), motion=lambda way: ((0.0, way, 0.0), (0.0, 0.0, 0.0, 1.0)))
    pressed = press(
        Body(replace(mesh, faces={**mesh.faces, "skin": skin}), FLESH),
        held,
        [Pair("skin", plate)],
        times=list(DOWN),
        check=False,
    )
    thickness = float(np.ptp(mesh.nodes[:, 2]))
    return np.array([instant.touches[0].normal_force for instant in pressed.instants]) / thickness


@lru_cache
def reference(size: float = 0.7e-3) -> NDArray[np.float64]:
    """From a mesh in rings around the bone."""
    around, layers = round(2.0 * np.pi * RADIUS / size), round((RADIUS - THICK) / size)
    angle = 2.0 * np.pi * np.arange(around) / around - 0.5 * np.pi
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    out = np.linspace(0.0, 1.0, layers + 1)[:, None, None]
    section = (1.0 - out) * (AXIS + THICK * circle) + out * RADIUS * circle
    nodes = np.stack([np.concatenate([section, np.full((*section.shape[:2], 1), z)], axis=2) for z in (0.0, size)], 2)
    number = np.arange(nodes[..., 0].size, dtype=np.int32).reshape(nodes.shape[:3])
    elements = elements_of(np.concatenate([number, number[:, :1]], axis=1))
    mesh = HexMesh(nodes.reshape(-1, 3), elements, np.zeros(len(elements), np.int32))
    faces = mesh.boundary()
    outer = np.isin(mesh.quads(faces), number[-1]).all(axis=1)
    return forces(mesh, number[0].ravel(), faces[outer])


@lru_cache
def found(size: float, *, fit: bool) -> NDArray[np.float64]:
    return forces(*slice_of(size, fit=fit))


@lru_cache
def slice_of(size: float, *, fit: bool) -> tuple[HexMesh, NDArray[np.int64], NDArray[np.int32]]:
    """The middle of a cylinder that is meshed as any other surface: mesh, bone's nodes, faces of the skin."""
    round_ = trimesh.creation.cylinder(RADIUS, LENGTH, sections=64)
    # more vertices along it, as surfaces of hands have
    vertices, faces = trimesh.remesh.subdivide_to_size(round_.vertices, round_.faces, 4e-3)
    mesh = fit_mesh(Envelope(vertices, faces), size).mesh
    start = np.array([*AXIS, -0.5 * LENGTH])
    along = np.array([0.0, 0.0, LENGTH])
    bone = Bone(start, along, np.zeros((2, 3)), np.full(2, THICK), 0.1, 0.9)
    bony = claimed(mesh, [bone]) == 0
    if fit:
        mesh = fitted(mesh, {0: mesh.elements[bony]}, {0: bone}, size)
    faces_ = mesh.boundary()
    assert mesh.lattice is not None
    level = mesh.lattice[mesh.elements, 2].min(axis=1)
    middle = (mesh.lattice[:, 2].max() + mesh.lattice[:, 2].min()) // 2
    kept = np.abs(level - middle + 0.5) < 1.0
    used, corners = np.unique(mesh.elements[kept], return_inverse=True)
    row = np.cumsum(kept) - 1
    mine = kept[faces_[:, 0]]
    part = HexMesh(mesh.nodes[used], corners.reshape(-1, 8).astype(np.int32), np.zeros(int(kept.sum()), np.int32))
    held = np.flatnonzero(np.isin(used, mesh.elements[kept & bony]))
    return part, held, np.stack([row[faces_[mine, 0]], faces_[mine, 1]], axis=1).astype(np.int32)


@pytest.mark.parametrize(
    ("size", "bound"), [(3e-3, 0.06), pytest.param(2.2e-3, 0.04, marks=pytest.mark.slow), (1.5e-3, 0.02)]
)
def test_forces_are_those_of_a_mesh_that_follows_the_bone(size: float, bound: float) -> None:
    """Within a bound at a third of the flesh's depth, where they grow fastest, and within 10 % all the way."""
    np.testing.assert_allclose(reference(), reference(1e-3), rtol=3e-3)
    wrong = found(size, fit=True) / reference() - 1.0
    assert abs(wrong[-1]) < bound
    assert np.abs(wrong).max() < 0.1


def test_stairs_are_what_made_forces_wrong() -> None:
    wrong = {fit: found(1.5e-3, fit=fit)[-1] / reference()[-1] - 1.0 for fit in (False, True)}
    assert abs(wrong[False]) > 0.2
    assert abs(wrong[True]) < 0.1 * abs(wrong[False])


@pytest.mark.parametrize("size", [3e-3, 1.5e-3])
def test_a_bone_keeps_its_section_and_elements_their_shape(size: float) -> None:
    before, _, _ = slice_of(size, fit=False)
    mesh, held, skin = slice_of(size, fit=True)
    assert mesh.scaled_jacobian().min() >= 0.2
    outer = np.unique(mesh.quads(skin))
    np.testing.assert_array_equal(mesh.nodes[outer], before.nodes[outer])
    assert not np.isin(outer, held).any()
    bone = np.isin(mesh.elements, held).all(axis=1)
    section = float(volumes(mesh)[bone].sum()) / float(np.ptp(mesh.nodes[:, 2]))
    assert section == pytest.approx(np.pi * THICK**2, rel=0.06)


def test_ends_of_a_bone_lie_where_they_are_said_to() -> None:
    mesh = box_hexes((0.01, 0.01, 0.04), (8, 8, 20), origin=(-5e-3, -5e-3, 0.0))
    bone = Bone(np.zeros(3), np.array([0.0, 0.0, 0.04]), np.zeros((2, 3)), np.array([3e-3, 2e-3]), 0.27, 0.78)
    bony = claimed(mesh, [bone]) == 0
    made = fitted(mesh, {0: mesh.elements[bony]}, {0: bone}, 1.6e-3)
    assert made.scaled_jacobian().min() >= 0.2
    shares, off, radius = bone.around(made.nodes[np.unique(mesh.elements[bony])])
    assert shares.min() == pytest.approx(0.27, abs=0.01)
    assert shares.max() == pytest.approx(0.78, abs=0.01)
    assert (np.linalg.norm(off, axis=1) / radius).max() < 1.15


def test_where_elements_are_too_large_a_bone_takes_those_along_its_axis() -> None:
    mesh = box_hexes((0.012, 0.012, 0.04), (4, 4, 10), origin=(-6e-3, -6e-3, 0.0))
    thin = Bone(np.array([1e-3, 1e-3, 0.0]), np.array([0.0, 0.0, 0.04]), np.zeros((2, 3)), np.full(2, 6e-4), 0.2, 0.8)
    owner = claimed(mesh, [thin])
    assert (owner == 0).sum() == 6
    middles = mesh.nodes[mesh.elements[owner == 0]].mean(axis=1)
    np.testing.assert_allclose(middles[:, :2], 1.5e-3)
    # none where all elements are of the outermost layer, unless it may take those
    plate = box_hexes((0.012, 0.004, 0.04), (4, 1, 10), origin=(-6e-3, -2e-3, 0.0))
    wide = Bone(np.zeros(3), np.array([0.0, 0.0, 0.04]), np.zeros((2, 3)), np.full(2, 2e-3), 0.2, 0.8)
    assert (claimed(plate, [wide]) == -1).all()
    assert (claimed(plate, [wide], bare=[0]) == 0).sum() == 12
