"""A body without hierarchy: its trunk is one chain, its limbs hang where anatomy has them."""

from __future__ import annotations

import numpy as np
import pytest

from warpjld.skeleton.recognise.layout import lay_out
from warpjld.skeleton.recognise.recognise import recognise
from warpjld.skeleton.recognise.tree import SourceTree

PLACES = {
    "pelvis": (0.0, 1.0, 0.0),
    "spine_01": (0.0, 1.1, 0.0),
    "spine_02": (0.0, 1.2, 0.0),
    "spine_03": (0.0, 1.3, 0.0),
    "neck_01": (0.0, 1.5, 0.0),
    "head": (0.0, 1.6, 0.0),
    "clavicle_l": (0.03, 1.45, 0.0),
    "upperarm_l": (0.18, 1.45, 0.0),
    "lowerarm_l": (0.45, 1.45, -0.01),
    "hand_l": (0.7, 1.45, 0.0),
    "thigh_l": (0.1, 0.95, 0.0),
    "calf_l": (0.1, 0.5, 0.01),
    "foot_l": (0.1, 0.08, 0.0),
    "ball_l": (0.1, 0.02, 0.13),
}
PARENTS = {
    "spine1": "pelvis",
    "spine2": "spine1",
    "spine3": "spine2",
    "neck1": "spine3",
    "head": "neck1",
    "left.clavicle": "spine3",
    "left.shoulder": "left.clavicle",
    "left.elbow": "left.shoulder",
    "left.wrist": "left.elbow",
    "left.hip": "pelvis",
    "left.knee": "left.hip",
    "left.ankle": "left.knee",
    "left.ball": "left.ankle",
}


@pytest.mark.parametrize("top", [None, "root", "pelvis"])
@pytest.mark.parametrize("backwards", [False, True])
def test_trunk_and_limbs_are_chains(top: str | None, backwards: bool) -> None:
    places = dict(PLACES)
    for name, (x, y, z) in PLACES.items():
        if name.endswith("_l"):
            places[f"{name[:-1]}r"] = (-x, y, z)
    names = sorted(places, reverse=backwards)
    if top is not None:
        names = [top, *(name for name in names if name != top)]
    frames = np.tile(np.eye(4), (len(names), 1, 1))
    frames[:, :3, 3] = [places.get(name, (0.0, 0.0, 0.0)) for name in names]
    parents = np.full(len(names), -1)
    if top is not None:
        parents[1:] = 0
    tree = SourceTree(tuple(names), parents, frames)
    layout = lay_out(tree, recognise(tree), {})
    found = {n: layout.names[p] for n, p in zip(layout.names, layout.parents, strict=True) if p >= 0}
    both = PARENTS | {k.replace("left", "right"): v.replace("left", "right") for k, v in PARENTS.items()}
    assert {name: found.get(name) for name in both} == both
