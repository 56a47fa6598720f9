"""Canonical skeletons of trees that are neither a whole hand nor a body."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
import trimesh

from warpjld.errors import InputError
from warpjld.hand.kept import kept_hand
from warpjld.rig import Rig
from warpjld.skeleton import hand_joint_names
from warpjld.skeleton.recognise.canonical import canonical_skeleton
from warpjld.skeleton.recognise.tree import SourceTree


@cache
def coarse(side: str) -> Rig:
    return kept_hand(side, resolution=1500)


def tree(names: list[str], parents: list[int], places: np.ndarray) -> SourceTree:
    frames = np.tile(np.eye(4), (len(names), 1, 1))
    frames[:, :3, 3] = places
    return SourceTree(tuple(names), np.array(parents), frames)


@pytest.fixture(scope="module")
def tube() -> tuple[np.ndarray, np.ndarray]:
    mesh = trimesh.creation.cylinder(0.01, segment=[[0, 0, -0.01], [0, 0, 0.1]])
    return np.array(mesh.vertices), np.array(mesh.faces, dtype=np.int32)


def test_a_single_finger_keeps_its_joints(tube):
    names = ["left.index.base", "left.index.knuckle2", "left.index.knuckle3", "left.index.tip"]
    places = np.array([[0, 0, 0], [0, 0, 0.04], [0, 0.004, 0.07], [0, 0.012, 0.09]])
    found = canonical_skeleton(tree(names, [-1, 0, 1, 2], places), *tube)
    assert found.skeleton.names == tuple(names)
    assert found.skeleton.palms == ()
    np.testing.assert_allclose(found.skeleton.axes[2], [-1, 0, 0], atol=1e-9)  # the plane of its rest bend


def test_a_tail_keeps_its_names_in_lower_case(tube):
    found = canonical_skeleton(
        tree([f"Tail{k}" for k in range(5)], [-1, 0, 1, 2, 3], np.outer(np.arange(5), [0, 0, 0.02])), *tube
    )
    assert found.skeleton.names == (*(f"tail{k}" for k in range(5)), "tail4.end")
    np.testing.assert_array_equal(found.owner, np.arange(5))


def test_doubled_names_are_told_apart(tube):
    found = canonical_skeleton(tree(["a", "A", "b"], [-1, 0, 1], np.outer(np.arange(3), [0, 0, 0.03])), *tube)
    assert found.skeleton.names == ("a#1", "a#2", "b", "b.end")


def built(side: str, keep=lambda name: True) -> tuple[SourceTree, np.ndarray, np.ndarray]:
    rig = coarse(side)
    s = rig.skeleton
    kept = [j for j, n in enumerate(s.names) if not n.endswith("forearm") and keep(n)]
    names = [s.names[j] for j in kept]
    above = [next((kept.index(int(p)) for p in _up(s.parents, j) if p in kept), -1) for j in kept]
    return tree(names, above, s.rest[kept]), rig.surface.vertices, rig.surface.faces


def _up(parents: np.ndarray, joint: int) -> list[int]:
    out = []
    while (joint := int(parents[joint])) >= 0:
        out.append(joint)
    return out


def test_two_hands_in_one_file_are_two_roots():
    left, right = built("left"), built("right")
    apart = np.array([0.3, 0.0, 0.0])
    count = len(left[0])
    both = tree(
        [*left[0].names, *right[0].names],
        [*left[0].parents, *(p if p < 0 else p + count for p in right[0].parents)],
        np.vstack([left[0].positions - apart, right[0].positions + apart]),
    )
    vertices = np.vstack([left[1] - apart, right[1] + apart])
    faces = np.vstack([left[2], right[2] + len(left[1])])
    for names in (both.names, tuple(f"bone{j}" for j in range(len(both)))):
        found = canonical_skeleton(SourceTree(names, both.parents, both.frames), vertices, faces)
        assert sorted(found.skeleton.names) == sorted((*hand_joint_names("left"), *hand_joint_names("right")))
        assert (found.skeleton.parents < 0).sum() == 2
        assert len(found.skeleton.palms) == 2


def test_a_mano_like_hand_is_completed():
    """Sixteen joints: no carpal ends, no tips."""
    source, vertices, faces = built("right", keep=lambda n: "carpometacarpal" not in n and not n.endswith(".tip"))
    assert len(source) == 16
    found = canonical_skeleton(source, vertices, faces)
    whole = coarse("right").skeleton
    assert found.skeleton.names == hand_joint_names("right")
    for j, name in enumerate(found.skeleton.names):
        error = np.linalg.norm(found.skeleton.rest[j] - whole.rest[whole.index(name)])
        if name.endswith(".tip"):
            assert error < 6e-3, name  # where on the pad the centre is, is a matter of a few millimetres
        elif name.endswith("carpometacarpal"):
            assert error < 16e-3, name
        else:
            assert error < 1e-12, name
    assert sum("no tip joints" in note or "no carpal ends" in note for note in found.notes) == 2


@pytest.mark.parametrize("beyond", [1.5, 0.3])
def test_fingertips_outside_the_surface_or_at_the_skin_are_brought_in(beyond):
    source, vertices, faces = built("left")
    frames = source.frames.copy()
    tips = [j for j, n in enumerate(source.names) if n.endswith(".tip")]
    above = source.parents[tips]
    frames[tips, :3, 3] += beyond * (frames[tips, :3, 3] - frames[above, :3, 3])
    found = canonical_skeleton(SourceTree(source.names, source.parents, frames), vertices, faces)
    for j in tips:
        k = found.skeleton.names.index(source.names[j])
        assert np.linalg.norm(found.skeleton.rest[k] - source.positions[j]) < 6e-3
    assert any("outside the surface" in note for note in found.notes)


def test_a_hand_that_could_be_either_asks_for_its_side(tube):
    """Flat and straight, all in one plane, without a side in its names."""
    names, parents, places = ["wrist"], [-1], [np.zeros(3)]
    for d, digit in enumerate(("thumb", "index", "middle", "ring", "pinky")):
        for k in range(3):
            parents.append(0 if k == 0 else len(names) - 1)
            names.append(f"{digit}{k + 1}")
            places.append(np.array([0.02 * d, 0.0, 0.08 + 0.03 * k]))
    flat = tree(names, parents, np.array(places))
    with pytest.raises(InputError, match="give its side"):
        canonical_skeleton(flat, *tube)
    assert canonical_skeleton(flat, *tube, side="right").skeleton.names[0] == "right.wrist"
