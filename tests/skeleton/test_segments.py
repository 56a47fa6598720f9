"""Segments of a body by their names in anatomy."""

from __future__ import annotations

import pytest

from warpjld.errors import InputError
from warpjld.rig import Rig
from warpjld.skeleton.segments import segment_joints


def test_segments_of_the_body(figure: Rig) -> None:
    skeleton = figure.skeleton

    def names(segment: str) -> set[str]:
        return {skeleton.names[joint] for joint in segment_joints(skeleton, segment)}

    assert names("left.upper_arm") == {"left.shoulder"}
    assert names("left.forearm") == {"left.elbow", "left.forearm_twist"}
    assert names("shin") == {"left.knee", "right.knee"}
    assert names("right.foot") == {"right.ankle", "right.ball"}
    assert names("head") == {"head"}
    assert {"pelvis", "spine1", "spine4", "sternum"} <= names("trunk")
    assert len(names("right.hand")) >= 17
    assert names("left.hip") == {"left.hip"}  # a joint's own name
    every = [
        joint
        for word in ("upper_arm", "forearm", "hand", "thigh", "shin", "foot", "trunk", "neck", "head")
        for joint in segment_joints(skeleton, word)
    ]
    assert len(every) == len(set(every)) == sum(bool(kids) for kids in skeleton.children)


def test_a_hand_has_a_forearm_and_no_shin(hands: dict[str, Rig]) -> None:
    skeleton = hands["left"].skeleton
    assert segment_joints(skeleton, "left.forearm") == [skeleton.names.index("left.forearm")]
    with pytest.raises(InputError, match=r"no segment 'left\.shin'"):
        segment_joints(skeleton, "left.shin")
    with pytest.raises(InputError, match=r"did you mean left\.forearm"):
        segment_joints(skeleton, "left.foream")
