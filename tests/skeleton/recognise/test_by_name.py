"""Names of the common conventions, on a hand and a body laid out here."""

from __future__ import annotations

import numpy as np
import pytest

from warpjld.skeleton.recognise.by_name import roles_by_name
from warpjld.skeleton.recognise.names import read_name
from warpjld.skeleton.recognise.tree import SourceTree

DIGITS = ("thumb", "index", "middle", "ring", "pinky")
JOINTS = ("carpometacarpal", "base", "knuckle2", "knuckle3", "tip")


# convention: names of a finger's joints, carpometacarpal to tip, then of the thumb's, then the wrist, then the side;
# {d} is the digit in the convention's words, {n} its number from the thumb, None what the convention leaves out
_ = None
CONVENTIONS = {
    "WebXR": (
        (
            "{d}-finger-metacarpal",
            "{d}-finger-phalanx-proximal",
            "{d}-finger-phalanx-intermediate",
            "{d}-finger-phalanx-distal",
            "{d}-finger-tip",
        ),
        (_, "thumb-metacarpal", "thumb-phalanx-proximal", "thumb-phalanx-distal", "thumb-tip"),
        "wrist",
        None,
    ),
    "SMPL-X": ((_, "left_{d}1", "left_{d}2", "left_{d}3", _),) * 2 + ("left_wrist", "left"),
    "MakeHuman": (
        ("metacarpal{n}.L", "finger{n1}-1.L", "finger{n1}-2.L", "finger{n1}-3.L", _),
        (_, "finger1-1.L", "finger1-2.L", "finger1-3.L", _),
        "wrist.L",
        "left",
    ),
    "Mixamo": ((_, *(f"mixamorig:LeftHand{{D}}{k}" for k in (1, 2, 3, 4))),) * 2 + ("mixamorig:LeftHand", "left"),
    "Leap": (
        ("L_{d}_meta", "L_{d}_a", "L_{d}_b", "L_{d}_c", "L_{d}_end"),
        (_, "L_thumb_meta", "L_thumb_a", "L_thumb_b", "L_thumb_end"),
        "L_Wrist",
        "left",
    ),
    "Godot and VRM 1": (
        (_, "Left{L}Proximal", "Left{L}Intermediate", "Left{L}Distal", _),
        (_, "LeftThumbMetacarpal", "LeftThumbProximal", "LeftThumbDistal", _),
        "LeftHand",
        "left",
    ),
    "VRM 0": ((_, "J_Bip_L_{L}1", "J_Bip_L_{L}2", "J_Bip_L_{L}3", _),) * 2 + ("J_Bip_L_Hand", "left"),
    "OpenXR": (
        ("{L}_Metacarpal_L", "{L}_Proximal_L", "{L}_Intermediate_L", "{L}_Distal_L", "{L}_Tip_L"),
        (_, "Thumb_Metacarpal_L", "Thumb_Proximal_L", "Thumb_Distal_L", "Thumb_Tip_L"),
        "Wrist_L",
        "left",
    ),
    "Unreal": (
        ("{d}_metacarpal_l", "{d}_01_l", "{d}_02_l", "{d}_03_l", _),
        (_, "thumb_01_l", "thumb_02_l", "thumb_03_l", _),
        "hand_l",
        "left",
    ),
    "Rigify": (
        ("palm.0{n}.L", "f_{d}.01.L", "f_{d}.02.L", "f_{d}.03.L", _),
        (_, "thumb.01.L", "thumb.02.L", "thumb.03.L", _),
        "hand.L",
        "left",
    ),
    "Biped": ((_, "Bip01 L Finger{n}", "Bip01 L Finger{n}1", "Bip01 L Finger{n}2", _),) * 2 + ("Bip01 L Hand", "left"),
    "canonical": (
        ("left.{d}.carpometacarpal", "left.{d}.base", "left.{d}.knuckle2", "left.{d}.knuckle3", "left.{d}.tip"),
        (_, "left.thumb.base", "left.thumb.knuckle2", "left.thumb.knuckle3", "left.thumb.tip"),
        "left.wrist",
        "left",
    ),
}


def names_of(convention: str, digit: str) -> list[str | None]:
    """The convention's names of one digit's five joints."""
    finger, thumb, _, _ = CONVENTIONS[convention]
    little = "Little" if digit == "pinky" else digit.title()
    n = DIGITS.index(digit)
    words = {"d": digit, "D": digit.title(), "L": little, "n": n, "n1": n + 1}
    return [pattern and pattern.format(**words) for pattern in (thumb if digit == "thumb" else finger)]


def hand_tree(convention: str, flat: bool = False) -> SourceTree:
    """A left hand in the names of a convention."""
    names, parents, places = [CONVENTIONS[convention][2]], [-1], [np.zeros(3)]
    for d, digit in enumerate(DIGITS):
        reach = np.array([0.03, 0.09, 0.13, 0.155, 0.175]) if d else np.array([0.02, 0.03, 0.07, 0.10, 0.125])
        above = 0
        for k, word in enumerate(names_of(convention, digit)):
            if word is not None:
                names.append(word)
                parents.append(-1 if flat else above)
                places.append(np.array([0.025 * d - 0.05, 0.0, reach[k]]))
                above = len(names) - 1
    frames = np.tile(np.eye(4), (len(names), 1, 1))
    frames[:, :3, 3] = places
    return SourceTree(tuple(names), np.array(parents), frames)


@pytest.mark.parametrize("convention", CONVENTIONS)
def test_every_joint_of_a_hand_is_found_under_its_name(convention):
    tree = hand_tree(convention)
    roles = roles_by_name(tree)
    assert [hand.side for hand in roles.hands] == [CONVENTIONS[convention][3]]
    found = {name: tree.names[j] for name, j in roles.hands[0].joints.items()}
    want = {"wrist": tree.names[0]}
    for digit in DIGITS:
        for joint, word in zip(JOINTS, names_of(convention, digit), strict=True):
            if word is not None:
                want[f"{digit}.{joint}"] = word
    assert found == want


@pytest.mark.parametrize("convention", ["WebXR", "Leap", "OpenXR", "canonical"])
def test_word_names_need_no_hierarchy_and_no_order(convention):
    tree = hand_tree(convention, flat=True)
    order = np.random.default_rng(1).permutation(len(tree))
    shuffled = SourceTree(tuple(tree.names[i] for i in order), tree.parents[order], tree.frames[order])
    expected = roles_by_name(hand_tree(convention)).hands[0].joints
    got = roles_by_name(shuffled).hands[0].joints
    assert {n: shuffled.names[j] for n, j in got.items()} == {n: tree.names[j] for n, j in expected.items()}


# pelvis, spine, neck and head; one arm; one leg; what {s} stands for on the left and on the right
LIMBS = {
    "Mixamo": (
        "Hips Spine Spine1 Spine2 Neck Head",
        "{s}Shoulder {s}Arm {s}ForeArm {s}Hand",
        "{s}UpLeg {s}Leg {s}Foot {s}ToeBase",
        ("Left", "Right"),
    ),
    "SMPL-X": (
        "pelvis spine1 spine2 spine3 neck head",
        "{s}_collar {s}_shoulder {s}_elbow {s}_wrist",
        "{s}_hip {s}_knee {s}_ankle {s}_foot",
        ("left", "right"),
    ),
    "Godot": (
        "Hips Spine Chest UpperChest Neck Head",
        "{s}Shoulder {s}UpperArm {s}LowerArm {s}Hand",
        "{s}UpperLeg {s}LowerLeg {s}Foot {s}Toes",
        ("Left", "Right"),
    ),
    "Unreal": (
        "pelvis spine_01 spine_02 spine_03 neck_01 head",
        "clavicle_{s} upperarm_{s} lowerarm_{s} hand_{s}",
        "thigh_{s} calf_{s} foot_{s} ball_{s}",
        ("l", "r"),
    ),
    "Rigify": (
        "DEF-pelvis DEF-spine.001 DEF-spine.002 DEF-chest DEF-neck DEF-head",
        "DEF-clavicle.{s} DEF-upper_arm.{s} DEF-forearm.{s} DEF-hand.{s}",
        "DEF-thigh.{s} DEF-shin.{s} DEF-foot.{s} DEF-toe.{s}",
        ("L", "R"),
    ),
}


@pytest.mark.parametrize("convention", LIMBS)
def test_every_joint_of_a_body_is_found_under_its_name(convention):
    trunk, arm, leg, (left, right) = LIMBS[convention]
    pelvis, *spine, neck, head = trunk.split()
    names, parents = [pelvis], [-1]

    def chain(words: str, above: int) -> int:
        for word in words.split():
            names.append(word)
            parents.append(above)
            above = len(names) - 1
        return above

    chest = chain(" ".join(spine), 0)
    chain(f"{neck} {head}", chest)
    for side in (left, right):
        chain(arm.format(s=side), chest)
        chain(leg.format(s=side), 0)
    frames = np.tile(np.eye(4), (len(names), 1, 1))
    frames[:, :3, 3] = np.random.default_rng(0).random((len(names), 3))
    body = {k: names[v] for k, v in roles_by_name(SourceTree(tuple(names), np.array(parents), frames)).body.items()}
    want = {"pelvis": pelvis, "neck1": neck, "head": head}
    want |= {f"spine{n}": word for n, word in enumerate(spine, start=1)}
    for side, word in (("left", left), ("right", right)):
        parts = ("clavicle", "shoulder", "elbow", "wrist", "hip", "knee", "ankle", "ball")
        for part, name in zip(parts, (arm + " " + leg).format(s=word).split(), strict=True):
            want[f"{side}.{part}"] = name
    assert body == want


@pytest.mark.parametrize("name", ["upperarm_twist_01_l", "LeftForeArmRoll", "foot_ik_l", "b_r_forearm_stub"])
def test_helpers_are_not_joints_of_limbs(name):
    assert read_name(name).kind == "helper"


@pytest.mark.parametrize("name", ["bone_001", "Cube", "joint12", "spring", "string3", "Object_7"])
def test_other_names_mean_nothing(name):
    meaning = read_name(name)
    assert meaning.kind is None
    assert meaning.side is None
