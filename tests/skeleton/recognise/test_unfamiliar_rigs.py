"""Rigs of other makes in code: words of other languages, bodies counted through, six fingers, hair, and no hand."""

from __future__ import annotations

import numpy as np

from tests.skeleton.recognise.test_digits import DIGITS, hand
from warpjld.skeleton.recognise.by_name import roles_by_name
from warpjld.skeleton.recognise.canonical import Canonical, canonical_skeleton
from warpjld.skeleton.recognise.recognise import recognise
from warpjld.skeleton.recognise.tree import SourceTree

GERMAN = {
    "thumb": "Daumen",
    "index": "Zeigefinger",
    "middle": "Mittelfinger",
    "ring": "Ringfinger",
    "pinky": "Kleinerfinger",
}
# joint → parent, place [m]; the left side is mirrored
TRUNK = {
    "torso_joint_1": (None, (0.0, 0.95, 0.0)),
    "torso_joint_2": ("torso_joint_1", (0.0, 1.1, 0.0)),
    "torso_joint_3": ("torso_joint_2", (0.0, 1.3, 0.0)),
    "neck_joint_1": ("torso_joint_3", (0.0, 1.45, 0.0)),
    "neck_joint_2": ("neck_joint_1", (0.0, 1.55, 0.02)),
}
SIDED = {
    "arm_joint_{s}_1": ("torso_joint_3", (0.18, 1.4, 0.0)),
    "arm_joint_{s}_2": ("arm_joint_{s}_1", (0.45, 1.33, -0.01)),
    "arm_joint_{s}_3": ("arm_joint_{s}_2", (0.69, 1.26, 0.0)),
    "leg_joint_{s}_1": ("torso_joint_1", (0.09, 0.9, 0.0)),
    "leg_joint_{s}_2": ("leg_joint_{s}_1", (0.1, 0.49, 0.01)),
    "leg_joint_{s}_3": ("leg_joint_{s}_2", (0.11, 0.08, -0.02)),
    "leg_joint_{s}_5": ("leg_joint_{s}_3", (0.11, 0.02, 0.1)),
}


def made(joints: dict[str, tuple[str | None, tuple[float, float, float]]]) -> SourceTree:
    names = list(joints)
    frames = np.tile(np.eye(4), (len(names), 1, 1))
    frames[:, :3, 3] = [place for _, place in joints.values()]
    return SourceTree(tuple(names), np.array([-1 if p is None else names.index(p) for p, _ in joints.values()]), frames)


def body(**more: tuple[str | None, tuple[float, float, float]]) -> SourceTree:
    sided = {
        name.format(s=s): (parent.format(s=s), (x * place[0], *place[1:]))
        for s, x in (("L", 1.0), ("R", -1.0))
        for name, (parent, place) in SIDED.items()
    }
    return made(TRUNK | sided | more)


def even(tree: SourceTree) -> np.ndarray:
    return np.full(len(tree), 1.0 / len(tree))


def test_a_body_counted_through_has_elbows_wrists_pelvis_and_head() -> None:
    tree = body()
    roles = recognise(tree, even(tree))
    want = {"pelvis": "torso_joint_1", "spine1": "torso_joint_2", "spine2": "torso_joint_3", "neck1": "neck_joint_1"}
    want |= {"head": "neck_joint_2"}
    for s, side in (("L", "left"), ("R", "right")):
        parts = {"shoulder": "arm_joint_{s}_1", "elbow": "arm_joint_{s}_2", "wrist": "arm_joint_{s}_3"}
        parts |= {"hip": "leg_joint_{s}_1", "knee": "leg_joint_{s}_2", "ankle": "leg_joint_{s}_3"}
        want |= {f"{side}.{part}": name.format(s=s) for part, name in parts.items()}
    found = {name: tree.names[j] for name, j in roles.body.items()}
    assert {name: found.get(name) for name in want} == want
    assert "spine3" not in found
    assert not roles.suspicious


def test_a_body_without_fingers_and_names_is_no_hand() -> None:
    named = body(
        clavicle_l=("torso_joint_3", (0.03, 1.4, 0.0)),
        clavicle_r=("torso_joint_3", (-0.03, 1.4, 0.0)),
        top=("neck_joint_2", (0.0, 1.74, 0.02)),
    )
    parents = named.parents.copy()
    for s in "lr":
        parents[named.names.index(f"arm_joint_{s.upper()}_1")] = named.names.index(f"clavicle_{s}")
    tree = SourceTree(tuple(f"Bone.{n:03d}" for n in range(len(named))), parents, named.frames)
    for shares in (None, even(tree)):
        assert not recognise(tree, shares).hands


def test_a_hand_in_german_is_whole() -> None:
    one = hand("tips", [1.0] * 40, "numbers")
    names = []
    for joint, name in enumerate(one.tree.names):
        part = next((p for p, j in one.want.items() if j == joint), None)
        digit = (part or "").partition(".")[0]
        number = {"base": 1, "knuckle2": 2, "knuckle3": 3, "tip": 4}.get((part or "").partition(".")[2])
        names.append(f"{GERMAN[digit]}_{number}_L" if digit in GERMAN else f"Handgelenk_L{'' if part else name}")
    tree = SourceTree(tuple(names), one.tree.parents, one.tree.frames)
    roles = recognise(tree, one.shares)
    assert [h.side for h in roles.hands] == ["left"]
    assert roles.hands[0].joints == one.want
    assert any("names tell ring only" in note for note in roles.notes)
    assert not roles.suspicious


def with_chain(tree: SourceTree, parent: str, places: list[np.ndarray]) -> SourceTree:
    """``tree`` with a chain of joints called more0, more1, …"""
    first = len(tree)
    frames = np.tile(np.eye(4), (len(places), 1, 1))
    frames[:, :3, 3] = places
    return SourceTree(
        (*tree.names, *(f"more{k}" for k in range(len(places)))),
        np.array([*tree.parents, tree.names.index(parent), *range(first, first + len(places) - 1)]),
        np.concatenate([tree.frames, frames]),
    )


def kept(tree: SourceTree) -> set[str]:
    return set(in_a_box(tree).skeleton.names)


def in_a_box(tree: SourceTree) -> Canonical:
    box = np.array([[x, y, z] for x in (-2.0, 2.0) for y in (-2.0, 2.0) for z in (-2.0, 2.0)])
    faces = np.array([[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6]])
    faces = np.concatenate([faces, [[0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]]).astype(np.int32)
    return canonical_skeleton(tree, box, faces, shares=even(tree))


def test_a_sixth_finger_keeps_its_joints() -> None:
    one = hand("tips", [1.0] * 40, "numbers")
    pinky = [one.tree.positions[one.want[f"pinky.{j}"]] for j in ("base", "knuckle2", "knuckle3", "tip")]
    tree = with_chain(one.tree, "wrist", [np.add(p, (0.025, 0.0, 0.0)) for p in pinky])
    names = kept(tree)
    assert {"more0", "more1", "more2", "more3"} <= names
    assert sum(name.startswith(("left.", "right.")) for name in names) == 25
    assert len(DIGITS) == 5


def test_a_sixth_finger_on_a_metacarpal_keeps_its_joints() -> None:
    one = hand("metacarpals", [1.0] * 40, "numbers")
    pinky = [one.tree.positions[one.want[f"pinky.{j}"]] for j in ("base", "knuckle2", "knuckle3")]
    above = one.tree.names[one.want["pinky.carpometacarpal"]]
    assert {"more0", "more1", "more2"} <= kept(with_chain(one.tree, above, [np.add(p, (0.025, 0, 0)) for p in pinky]))


def test_a_jaw_without_skin_is_not_the_top_of_the_head() -> None:
    """What ends a bone without skin is the head's top only where it lies far enough above the head."""
    for place, is_top in (((0.0, 1.56, 0.05), False), ((0.0, 1.72, 0.03), True)):
        tree = body(more=("neck_joint_2", place))
        shares = even(tree)
        shares[tree.names.index("more")] = 0.0
        assert (recognise(tree, shares).body.get("head.top") == tree.names.index("more")) is is_top


def test_toes_and_spine_of_a_body_without_a_hierarchy() -> None:
    """Joints of one toe share its number; a spine's numbers may count downwards."""
    joints = {"root": (None, (0.0, 0.95, 0.0))}
    joints |= {f"spine0{n}": ("root", (0.0, 1.5 - 0.1 * n, 0.0)) for n in (1, 2, 3)}
    for s, x in (("L", 1.0), ("R", -1.0)):
        leg = {"upperleg": (0.1, 0.9, 0.0), "lowerleg": (0.1, 0.5, 0.0), "foot": (0.1, 0.08, 0.0)}
        leg |= {f"toe{n}-{k}": (0.06 + 0.02 * n, 0.02, 0.1 + 0.03 * k) for k in (2, 1) for n in (1, 2, 3)}
        joints |= {f"{name}.{s}": ("root", (x * a, b, c)) for name, (a, b, c) in leg.items()}
    flat = made({name: (None, place) for name, (_, place) in joints.items()})
    found = {name: flat.names[j] for name, j in roles_by_name(flat).body.items()}
    assert {n: found.get(f"left.toe{n}.base") for n in (1, 2, 3, 4)} == {n: f"toe{n}-1.L" for n in (1, 2, 3)} | {
        4: None
    }
    assert found["left.toe2.knuckle2"] == "toe2-2.L"
    assert [found[f"spine{n}"] for n in (1, 2, 3)] == ["spine03", "spine02", "spine01"]


def test_two_actors_in_a_file_are_told() -> None:
    one = hand("tips", [1.0] * 40, "ends").tree
    frames = one.frames.copy()
    frames[:, 0, 3] += 0.5
    both = SourceTree(
        tuple(f"{actor}_left_{name}" for actor in "AB" for name in one.names),
        np.concatenate([one.parents, np.where(one.parents < 0, -1, one.parents + len(one))]),
        np.concatenate([one.frames, frames]),
    )
    found = in_a_box(both)
    assert any("several actors in one file: that of 'A_left_wrist'" in doubt for doubt in found.suspicious)
    hand_of = {
        both.names[j][0]
        for name, j in zip(found.skeleton.names, found.sources, strict=True)
        if name[:5] == "left." and j >= 0
    }
    assert hand_of == {"A"}
    # but a left and a right hand, or hands whose names tell no side, are one actor's
    one_actor = SourceTree(
        tuple(n.replace("B_left", "A_right").replace("left_", "") for n in both.names), both.parents, both.frames
    )
    assert not any("several actors" in doubt for doubt in recognise(one_actor, even(both)).suspicious)


def test_hair_keeps_its_joints_and_a_jaw_does_not() -> None:
    hair = [np.array([0.0, 1.6 - 0.15 * k, -0.1]) for k in range(3)]
    assert {"more0", "more1", "more2"} <= kept(with_chain(body(), "neck_joint_2", hair))
    jaw = [np.array([0.0, 1.53 - 0.02 * k, 0.06 + 0.02 * k]) for k in range(3)]
    assert not {"more0", "more1", "more2"} & kept(with_chain(body(), "neck_joint_2", jaw))


def test_of_an_insects_legs_nothing_is_told_that_holds_for_a_body() -> None:
    legs = {}
    for s, x in (("L", 1.0), ("R", -1.0)):
        for row in range(3):
            for k, (out, high) in enumerate(((0.1, 0.3), (0.25, 0.4), (0.4, 0.2))):
                above = f"leg{row}_{k - 1}_{s}" if k else "trunk"
                legs[f"leg{row}_{k}_{s}"] = (above, (x * out, high, 0.15 * (row - 1)))
    tree = made({"trunk": (None, (0.0, 0.3, 0.0)), "head": ("trunk", (0.0, 0.32, 0.25))} | legs)
    roles = recognise(tree, even(tree))
    assert not roles.body
    assert not roles.suspicious
    assert len(roles.notes) == 1
