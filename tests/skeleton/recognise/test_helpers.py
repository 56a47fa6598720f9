"""Joints without flesh get no segments: a rig with helpers among its joints is the rig without them."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from warpjld.covering import bind
from warpjld.io.assemble import assemble_rig
from warpjld.io.gltf.skin import read_gltf_rig
from warpjld.io.source import SourceRig
from warpjld.rig import Rig
from warpjld.skeleton import poses_from_angles
from warpjld.skeleton.recognise.canonical import canonical_skeleton
from warpjld.skeleton.recognise.recognise import recognise
from warpjld.skeleton.recognise.tree import SourceTree

HAND, GODOT, BODY = (
    "hand_webxr_generic/left.glb",
    "hand_godot_low/Hand_low_R.gltf",
    "body_mesh2motion_mannequin/human-male.glb",
)
SUFFIXES = {
    "helper": ("_helper",),
    "null": ("_null",),
    "end": ("_end",),
    "twist": ("_twist",),
    "nub": ("Nub",),
    "socket": ("_socket",),
    "of all kinds": ("_helper", "_null", "_end", "_twist"),
}


@cache
def read(path: Path) -> tuple[SourceRig, Rig]:
    source = read_gltf_rig(path)
    return source, assemble_rig(source)


def in_a_hierarchy(source: SourceRig, rig: Rig) -> SourceRig:
    """A flat file's joints, each on the one it moves with."""
    parents = np.full(len(source.tree), -1)
    for j, joint in enumerate(rig.sources):
        above = int(rig.skeleton.parents[j])
        if joint >= 0 and above >= 0:
            parents[joint] = rig.sources[above]
    return replace(source, tree=replace(source.tree, parents=parents))


def with_helpers(source: SourceRig, rig: Rig, where: str, suffixes: tuple[str, ...]) -> SourceRig:
    """A joint without weights for each bone of a rig: between its joints, beside the far one, at the near one, off."""
    tree = source.tree
    names, parents, frames = list(tree.names), tree.parents.copy().tolist(), list(tree.frames)
    flat = tree.flat
    for n, (joint, above) in enumerate(zip(rig.sources, rig.skeleton.parents, strict=True)):
        near = rig.sources[above] if above >= 0 else -1
        if joint < 0 or near < 0:
            continue
        frame = tree.frames[near].copy()
        share = 0.0 if where == "coincident" else 0.5
        frame[:3, 3] = (1 - share) * tree.positions[near] + share * tree.positions[joint]
        frame[:3, 3] += [0.01, 0.02, 0.0] if where == "aside" else 0.0
        names.append(tree.names[near] + suffixes[n % len(suffixes)])
        frames.append(frame)
        parents.append(-1 if flat else near)
        if not flat and where in ("between", "coincident"):
            parents[joint] = len(names) - 1
    return replace(source, tree=SourceTree(tuple(names), np.array(parents), np.array(frames)))


def proposed(source: SourceRig) -> dict[str, str]:
    from warpjld.skeleton.recognise.flesh import flesh_shares

    shares = flesh_shares(len(source.tree), source.joints, source.weights)
    roles = recognise(source.tree, shares)
    out = {name: source.tree.names[joint] for name, joint in roles.body.items()}
    for hand in roles.hands:
        out |= {f"{hand.side}.{name}": source.tree.names[joint] for name, joint in hand.joints.items()}
    assert roles.suspicious == []
    return out


@pytest.mark.parametrize("where", ["between", "beside", "coincident", "aside"])
@pytest.mark.parametrize("kind", SUFFIXES)
@pytest.mark.parametrize("name", [HAND, GODOT, BODY])
def test_helpers_are_nothing(data, name, kind, where):
    source, rig = read(data / name)
    assert proposed(with_helpers(source, rig, where, SUFFIXES[kind])) == proposed(source)
    if source.tree.flat:
        chained = in_a_hierarchy(source, rig)
        assert proposed(with_helpers(chained, rig, where, SUFFIXES[kind])) == proposed(source)


@pytest.mark.parametrize("where", ["between", "beside", "coincident", "aside"])
def test_helpers_without_words_are_nothing_either(data, where):
    source, rig = read(data / HAND)
    chained = in_a_hierarchy(source, rig)
    more = with_helpers(chained, rig, where, ("_x",))
    tree = more.tree
    numbers = tuple(f"bone_{j:03d}" for j in range(len(tree)))
    found = proposed(replace(more, tree=replace(tree, names=numbers)))
    told = dict(zip(numbers, tree.names, strict=True))
    assert {name.partition(".")[2]: told[joint] for name, joint in found.items()} == {
        name.partition(".")[2]: joint for name, joint in proposed(source).items()
    }


def stretch(rig: Rig) -> float:
    """Longest edge per its rest length, 99.9 % of the edges counted, with the fingers curled."""
    angles = np.zeros((1, len(rig.skeleton), 4))
    for digit in ("index", "middle", "ring", "pinky"):
        angles[0, rig.skeleton.index(f"{digit}.base"), 0] = np.radians(60)
        angles[0, rig.skeleton.index(f"{digit}.knuckle2"), 0] = np.radians(70)
    moved = bind(rig.skeleton, rig.surface).deform(poses_from_angles(rig.skeleton, angles))[0]
    edges = rig.surface.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    before, after = (
        np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1) for points in (rig.surface.vertices, moved)
    )
    return float(np.quantile(after / before, 0.999))


def test_fingers_curl_as_without_helpers(data):
    source, rig = read(data / HAND)
    plain = stretch(rig)
    for chained in (source, in_a_hierarchy(source, rig)):
        more = assemble_rig(with_helpers(chained, rig, "between", SUFFIXES["of all kinds"]))
        assert more.skeleton.names == rig.skeleton.names
        np.testing.assert_allclose(more.skeleton.rest, rig.skeleton.rest, atol=1e-12)
        assert stretch(more) == pytest.approx(plain, rel=1e-3)
    assert plain < 1.7


def chain(names: list[str], parents: list[int], places: list[tuple[float, float, float]]) -> SourceTree:
    frames = np.tile(np.eye(4), (len(names), 1, 1))
    frames[:, :3, 3] = places
    return SourceTree(tuple(names), np.array(parents), frames)


@pytest.fixture(scope="module")
def tube() -> tuple[np.ndarray, np.ndarray]:
    trimesh = pytest.importorskip("trimesh")
    mesh = trimesh.creation.cylinder(0.01, segment=[[0, 0, -0.01], [0, 0, 0.1]])
    return np.array(mesh.vertices), np.array(mesh.faces, dtype=np.int32)


def test_a_tail_keeps_its_joints_and_its_end_and_loses_helpers(tube):
    tree = chain(
        ["Root", "Tail1", "Tail_Helper", "Tail2", "Tail_IK", "Tail3", "Tail3_end", "Prop", "Prop_end"],
        [-1, 0, 1, 2, 0, 3, 5, 3, 7],
        [
            *((0, 0, -0.3), (0, 0, 0), (0, 0.003, 0.02), (0, 0, 0.03), (0, 0.2, 0.1), (0, 0, 0.06), (0, 0, 0.09)),
            *((0.1, 0, 0.03), (0.2, 0, 0.03)),
        ],
    )
    shares = np.array([0, 0.4, 0, 0.4, 0, 0.2, 0, 0, 0])
    found = canonical_skeleton(tree, *tube, shares=shares)
    assert found.skeleton.names == ("tail1", "tail2", "tail3", "tail3_end")
    assert [found.skeleton.names[j] for j in found.owner] == [
        *("tail1", "tail1", "tail1", "tail2", "tail1", "tail3", "tail3_end", "tail2", "tail2"),
    ]


def test_nothing_is_left_out_where_no_skin_tells(tube):
    tree = chain(["A", "B_null", "C_end"], [-1, 0, 1], [(0, 0, 0), (0, 0, 0.04), (0, 0, 0.08)])
    assert canonical_skeleton(tree, *tube).skeleton.names == ("a", "b_null", "c_end")


def test_the_end_of_a_digit_of_a_hand_that_is_not_whole_is_its_tip(tube):
    names = [f"left.index.{joint}" for joint in ("base", "knuckle2", "knuckle3")]
    finger = chain(names, [-1, 0, 1], [(0.0, 0.0, z) for z in (0.0, 0.04, 0.07)])
    assert "left.index.tip" in canonical_skeleton(finger, *tube).skeleton.names
