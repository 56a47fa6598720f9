"""Pieces without flesh are rigid to the joint that owns them; everything else is left to be flesh."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

from tests.covering.tube import SEGMENT, tube, tube_skeleton
from warpjld.covering.kept import bind_kept
from warpjld.covering.quality import unique_edges
from warpjld.geometry.surface import Part, Surface, weld_surface
from warpjld.io import load_rig
from warpjld.io.rigid_parts import rigid_parts
from warpjld.rig import Skin
from warpjld.skeleton import CHANNELS, poses_from_angles

MIDDLE = 1.5 * SEGMENT  # half-way along the second of the tube's bones
EYE = trimesh.creation.icosphere(subdivisions=1, radius=0.002)


def together(*pieces: tuple[str, np.ndarray, np.ndarray]) -> Surface:
    """The tube and other meshes beside it, each a part of its own."""
    body = tube(rings=31, around=16)
    vertices, faces, parts = [body.vertices], [body.faces], [Part("body", slice(0, len(body.vertices)), slice(0, 0))]
    count = len(body.vertices)
    for name, v, f in pieces:
        vertices.append(v)
        faces.append(f + count)
        parts.append(Part(name, slice(count, count + len(v)), slice(0, 0)))
        count += len(v)
    return weld_surface(np.concatenate(vertices), np.concatenate(faces), parts=tuple(parts))


def eye(name: str = "eye", at: tuple[float, float, float] = (0.004, 0.004, -MIDDLE)) -> tuple:
    return name, EYE.vertices + at, EYE.faces


def of_part(surface: Surface, number: int) -> np.ndarray:
    return np.unique(surface.weld[surface.parts[number].vertices])


def test_a_closed_small_piece_is_rigid_to_the_nearest_bone() -> None:
    surface = together(eye("left eye"), eye("right eye", (-0.004, 0.004, -MIDDLE)), eye("button", (0.0, 0.009, -0.01)))
    rigid, notes = rigid_parts(surface, tube_skeleton(), None, None)
    assert rigid is not None
    assert set(rigid[of_part(surface, 0)]) == {-1}
    assert set(rigid[np.concatenate([of_part(surface, 1), of_part(surface, 2)])]) == {1}
    assert set(rigid[of_part(surface, 3)]) == {0}
    assert sorted(notes) == [
        "1 separate piece without flesh, rigid to joint 'tube.start': button",
        "2 separate pieces without flesh, rigid to joint 'tube.joint': left eye, right eye",
    ]


def shirt() -> tuple:
    """An open shell around both bones."""
    around = trimesh.creation.cylinder(radius=0.01, height=1.6 * SEGMENT, sections=16)
    sides = np.abs(around.face_normals[:, 2]) < 0.5
    return "shirt", around.vertices - [0, 0, SEGMENT], around.faces[sides]


def half_eye() -> tuple:
    name, v, f = eye()
    used, faces = np.unique(f[EYE.triangles_center[:, 2] > 0.0], return_inverse=True)
    return name, v[used], faces.reshape(-1, 3)


def box(extents: list[float], at: list[float]) -> tuple:
    mesh = trimesh.creation.box(extents).subdivide()
    return "box", mesh.vertices + at, mesh.faces


@pytest.mark.parametrize(
    "piece",
    [
        shirt(),
        half_eye(),
        box([0.03, 0.004, 0.03], [0.02, 0.0, -SEGMENT]),  # larger than a bone
        box([0.004, 0.004, 1.1 * SEGMENT], [0.0, 0.0, -MIDDLE]),  # a limb within a limb: it holds a bone
    ],
    ids=["shirt", "open", "large", "limb"],
)
def test_what_is_not_painted_and_may_be_flesh_stays(piece: tuple) -> None:
    rigid, notes = rigid_parts(together(piece), tube_skeleton(), None, None)
    assert rigid is None
    assert notes == ()


def painted(surface: Surface, part: int, shares: list[float]) -> Skin:
    """All of the surface on joints 0 and 1 half and half, one part by other shares."""
    weights = np.full((len(surface.vertices), 2), 0.5)
    weights[of_part(surface, part)] = shares
    return Skin(np.tile(np.array([[0, 1]], np.int32), (len(weights), 1)), weights)


@pytest.mark.parametrize(("share", "joint"), [(1.0, 0), (0.95, 0), (0.85, -1), (0.5, -1), (0.0, 1)])
@pytest.mark.parametrize("piece", [eye(), half_eye(), box([0.03, 0.004, 0.03], [0.02, 0.0, -SEGMENT])])
def test_what_is_painted_to_one_joint_goes_with_it(piece: tuple, share: float, joint: int) -> None:
    surface = together(piece)
    rigid, notes = rigid_parts(surface, tube_skeleton(), painted(surface, 1, [share, 1.0 - share]), None)
    assert (rigid is None) == (joint < 0)
    if rigid is not None:
        assert set(rigid[of_part(surface, 1)]) == {joint}
        assert set(rigid[of_part(surface, 0)]) == {-1}
        assert len(notes) == 1


def test_a_painted_limb_that_holds_its_bone_is_flesh() -> None:
    surface = together(box([0.004, 0.004, 1.1 * SEGMENT], [0.0, 0.0, -MIDDLE]))
    assert rigid_parts(surface, tube_skeleton(), painted(surface, 1, [0.0, 1.0]), None)[0] is None


def test_a_body_cut_along_its_materials_is_one_piece() -> None:
    whole = tube(rings=31, around=16)
    behind = whole.vertices[whole.faces].mean(axis=1)[:, 2] < -1.6 * SEGMENT
    used, faces = np.unique(whole.faces[behind], return_inverse=True)
    front_used, front = np.unique(whole.faces[~behind], return_inverse=True)
    vertices = np.concatenate([whole.vertices[front_used], whole.vertices[used]])
    count = len(front_used)
    parts = (Part("front", slice(0, count), slice(0, 0)), Part("tip", slice(count, len(vertices)), slice(0, 0)))
    surface = weld_surface(vertices, np.concatenate([front.reshape(-1, 3), faces.reshape(-1, 3) + count]), parts=parts)
    assert rigid_parts(surface, tube_skeleton(), painted(surface, 1, [0.0, 1.0]), None)[0] is None


def test_what_the_file_says_is_rigid_stays() -> None:
    surface = together(eye(), box([0.03, 0.004, 0.03], [0.02, 0.0, -SEGMENT]))
    given = np.full(len(surface.vertices), -1, dtype=np.int32)
    given[of_part(surface, 2)] = 2
    rigid, notes = rigid_parts(surface, tube_skeleton(), None, given)
    assert rigid is not None
    assert set(rigid[of_part(surface, 2)]) == {2}
    assert set(rigid[of_part(surface, 1)]) == {1}
    assert len(notes) == 1  # the reader has told of its own


@pytest.mark.parametrize("domains", ["geometry", pytest.param("skin", marks=pytest.mark.slow)])
def test_eyes_of_a_body_turn_with_the_head(data: Path, domains: str) -> None:
    rig = load_rig(data / "body_anny" / "body_104joints.glb")
    assert rig.rigid is not None
    head = rig.skeleton.names.index("head")
    assert set(rig.rigid[rig.rigid >= 0]) == {head}
    assert any("rigid to joint 'head'" in note for note in rig.notes)
    angles = np.zeros((1, len(rig.skeleton), len(CHANNELS)))
    angles[0, head, CHANNELS.index("flexion")] = np.radians(50.0)
    moved = bind_kept(rig, domains=domains)[0].deform(poses_from_angles(rig.skeleton, angles))[0]  # type: ignore[arg-type]
    edges = unique_edges(rig.surface.faces)
    edges = edges[(rig.rigid[edges] >= 0).all(axis=1)]
    before, after = (np.linalg.norm(v[edges[:, 1]] - v[edges[:, 0]], axis=1) for v in (rig.surface.vertices, moved))
    assert np.abs(after - before).max() < 1e-6
