"""What of a body's skin may touch what: a forearm the upper arm in the crease, a foot never the face (R127, R140)."""

from __future__ import annotations

import numpy as np

from warpjld.fem import box_hexes
from warpjld.fem.hand.labels import creases, excluded_pairs, fringes, joined_pairs

BONES = [
    ("left.elbow", "left.shoulder"),
    ("left.wrist", "left.elbow"),
    ("left.shoulder", "left.clavicle"),
    ("head.top", "head"),
    ("left.toe1.tip", "left.ball"),
]
JOINTS, PARENTS = [bone[0] for bone in BONES], [bone[1] for bone in BONES]


def test_neighbours_belong_together_and_fold() -> None:
    joined, folds = joined_pairs(JOINTS, JOINTS, PARENTS), creases(JOINTS, JOINTS, PARENTS)
    assert joined[0, 1]
    assert folds[0, 1]  # upper arm and forearm
    assert joined[0, 2]
    assert not folds[0, 2]  # upper arm and shoulder
    assert not joined[1, 2]
    assert not joined[0, 3]
    assert (joined == joined.T).all()
    assert (folds == folds.T).all()


def test_a_foot_does_not_reach_the_face() -> None:
    """Five strips of skin side by side, far enough from one another at rest."""
    mesh = box_hexes((0.5, 0.1, 0.1), (5, 1, 1))
    faces = mesh.boundary()
    label = faces[:, 0].astype(np.int32)
    joined, folds = joined_pairs(JOINTS, JOINTS, PARENTS), creases(JOINTS, JOINTS, PARENTS)
    never = excluded_pairs(mesh, faces, label, JOINTS, 0.0, joined, folds)
    assert never[3, 4]  # head and foot
    assert never[4, 3]
    assert not never[0, 1]  # the crease
    assert never[0, 2]  # what is joined otherwise
    assert not never[0, 4]  # a foot and an arm
    factor = fringes(mesh, faces, label, JOINTS, 0.1, folds)
    assert (factor[label > 1] == 1.0).all()
    crease = (label < 2) & (np.abs(mesh.nodes[mesh.quads(faces)].mean(axis=1)[:, 0] - 0.1) < 1e-9)
    assert not crease.any()  # no face lies in the border itself
    assert factor[label == 0].min() == 1.0  # an element of 0.1 m is wider than the transition
    assert fringes(mesh, faces, label, JOINTS, 1.0, folds)[label < 2].max() < 1.0
