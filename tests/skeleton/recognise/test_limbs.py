"""Arms and legs settled by geometry, doubts told, and what is no body at all."""

from __future__ import annotations

import numpy as np
import pytest

from warpjld.skeleton.recognise.recognise import recognise
from warpjld.skeleton.recognise.tree import SourceTree

SIDES = (("L", 1.0), ("R", -1.0))
# a body of 1.6 m: joint → its parent and place on the left [m], Y up, Z forward
TRUNK = {
    "Hips": (None, (0, 0.9, 0)),
    "Spine": ("Hips", (0, 1.05, -0.01)),
    "Chest": ("Spine", (0, 1.2, -0.02)),
    "Neck": ("Chest", (0, 1.4, 0)),
    "Head": ("Neck", (0, 1.5, 0.02)),
}
ARM = (
    ("Shoulder", "Chest", (0.03, 1.35, 0)),
    ("Arm", "Shoulder", (0.17, 1.38, -0.02)),
    ("ForeArm", "Arm", (0.45, 1.38, -0.03)),
    ("Hand", "ForeArm", (0.7, 1.38, -0.02)),
)
LEG = (
    ("UpLeg", "Hips", (0.09, 0.88, 0)),
    ("Leg", "UpLeg", (0.1, 0.48, 0.01)),
    ("Foot", "Leg", (0.1, 0.08, -0.03)),
    ("Toe", "Foot", (0.1, 0.02, 0.1)),
)


def body(words: dict[str, str] | None = None, move: dict[str, tuple[float, float, float]] | None = None) -> SourceTree:
    """The body, joints renamed (``{"UpLeg": "Leg"}``), left out where the new name is empty, or moved (``L Leg``)."""
    words, move = words or {}, move or {}
    rows = [(name, above, place, name) for name, (above, place) in TRUNK.items()]
    for side, sign in SIDES:
        for part, above, (x, y, z) in (*ARM, *LEG):
            up = above if above in TRUNK else f"{side} {above}"
            rows.append((f"{side} {part}", up, (sign * x, y, z), part))
    rows = [row for row in rows if words.get(row[3], "x")]
    keys = [row[0] for row in rows]
    above_of = {row[0]: row[1] for row in rows} | {
        f"{s} {p}": (a if a in TRUNK else f"{s} {a}") for s, _ in SIDES for p, a, _ in (*ARM, *LEG)
    }
    parents = []
    for key in keys:
        up = above_of[key]
        while up is not None and up not in keys:
            up = above_of[up]
        parents.append(-1 if up is None else keys.index(up))
    names = [key.replace(part, words.get(part, part)) for key, _, _, part in rows]
    frames = np.tile(np.eye(4), (len(rows), 1, 1))
    frames[:, :3, 3] = [move.get(key, place) for key, _, place, _ in rows]
    return SourceTree(tuple(names), np.array(parents), frames)


def parts(tree: SourceTree) -> dict[str, str]:
    return {name: tree.names[joint] for name, joint in recognise(tree).body.items()}


LEGS = ("hip", "knee", "ankle", "ball")


@pytest.mark.parametrize(
    ("thigh", "shin", "foot"),
    [
        ("Leg", "Shin", "Foot"),
        ("Leg", "Knee", "Ankle"),
        ("Hip", "Leg", "Foot"),
        ("Thigh", "Leg", "Foot"),
        ("Thigh", "Calf", "Ankle"),
        ("Leg1", "Leg2", "Foot"),
        ("UpperLeg", "LowerLeg", "Ankle"),
        ("Hueftgelenk", "Leg", "Foot"),
        ("x1", "x2", "Foot"),
        ("Thigh", "x2", "x3"),
        ("x1", "Shin", "x3"),
    ],
)
def test_a_leg_is_where_its_chain_says(thigh, shin, foot):
    words = {"UpLeg": thigh, "Leg": shin, "Foot": foot}
    tree = body(words)
    found = parts(tree)
    for side, long in (("L", "left"), ("R", "right")):
        assert [found.get(f"{long}.{part}") for part in LEGS] == [
            f"{side} {thigh}",
            f"{side} {shin}",
            f"{side} {foot}",
            f"{side} Toe",
        ]
    assert recognise(tree).suspicious == []


@pytest.mark.parametrize(
    ("shoulder", "arm", "forearm"),
    [
        ("Shoulder", "UpperArm", "Arm"),
        ("Clavicle", "Shoulder", "Elbow"),
        ("Collar", "Arm1", "Arm2"),
        ("x0", "x1", "x2"),
        ("Shoulder", "ShldrBend", "ForearmBend"),
    ],
)
def test_an_arm_is_where_its_chain_says(shoulder, arm, forearm):
    words = {"Shoulder": shoulder, "Arm": arm, "ForeArm": forearm}
    found = parts(body(words))
    for side, long in (("L", "left"), ("R", "right")):
        assert [found.get(f"{long}.{part}") for part in ("clavicle", "shoulder", "elbow", "wrist")] == [
            f"{side} {shoulder}",
            f"{side} {arm}",
            f"{side} {forearm}",
            f"{side} Hand",
        ]


def test_trunk_without_words_lies_between_limbs():
    found = parts(body({"Hips": "a", "Spine": "b", "Chest": "c"}))
    assert (found["pelvis"], found["spine1"], found["spine2"]) == ("a", "b", "c")


def test_a_leg_without_a_knee_is_told():
    roles = recognise(body({"Leg": ""}))
    assert len(roles.suspicious) == 2
    assert all("no knee found" in line and "--map" in line for line in roles.suspicious)


def test_legs_of_unequal_length_are_told():
    roles = recognise(body(move={"L Foot": (0.1, 0.25, -0.03)}))
    assert [line for line in roles.suspicious if "from knee to ankle one side is" in line and "--map" in line]


def chain(rows: list[tuple[str, str | None, tuple[float, float, float]]]) -> SourceTree:
    names = [row[0] for row in rows]
    frames = np.tile(np.eye(4), (len(rows), 1, 1))
    frames[:, :3, 3] = [row[2] for row in rows]
    return SourceTree(tuple(names), np.array([-1 if a is None else names.index(a) for _, a, _ in rows]), frames)


def fox(hands: bool = True) -> SourceTree:
    """On four legs, Z forward, in the words of a man."""
    rows: list[tuple[str, str | None, tuple[float, float, float]]] = [
        ("Root", None, (0, 0.5, -0.3)),
        ("Hip", "Root", (0, 0.5, -0.3)),
        ("Spine01", "Hip", (0, 0.52, -0.1)),
        ("Spine02", "Spine01", (0, 0.52, 0.1)),
        ("Neck", "Spine02", (0, 0.55, 0.3)),
        ("Head", "Neck", (0, 0.65, 0.45)),
        ("Tail01", "Hip", (0, 0.5, -0.4)),
        ("Tail02", "Tail01", (0, 0.5, -0.6)),
    ]
    for side, x in (("Left", 0.08), ("Right", -0.08)):
        front = ("UpperArm", "ForeArm", "Hand") if hands else ("FrontLeg01", "FrontLeg02", "FrontFoot01")
        rows += [
            (f"{side}{front[0]}", "Spine02", (x, 0.45, 0.2)),
            (f"{side}{front[1]}", f"{side}{front[0]}", (x, 0.25, 0.18)),
            (f"{side}{front[2]}", f"{side}{front[1]}", (x, 0.05, 0.2)),
            (f"{side}Leg01", "Hip", (x, 0.45, -0.3)),
            (f"{side}Leg02", f"{side}Leg01", (x, 0.25, -0.33)),
            (f"{side}Foot01", f"{side}Leg02", (x, 0.08, -0.36)),
            (f"{side}Foot02", f"{side}Foot01", (x, 0.02, -0.3)),
        ]
    return chain(rows)


def car() -> SourceTree:
    rows: list[tuple[str, str | None, tuple[float, float, float]]] = [
        ("Root", None, (0, 0, 0)),
        ("Body", "Root", (0, 0.5, 0)),
        ("Headlight_L", "Body", (0.5, 0.5, 2)),
        ("ring_gear", "Body", (0, 0.4, -1)),
        ("ring_gear_2", "ring_gear", (0, 0.4, -1.1)),
        ("Middle_Axle", "Body", (0, 0.3, 0)),
        ("small_wheel", "Body", (0.3, 0.9, 0.5)),
        ("thumb_screw", "Body", (0.3, 0.9, 0.6)),
        ("index_plate", "Body", (0, 0.9, 0.6)),
    ]
    for end, z in (("Front", 1.5), ("Back", -1.5)):
        for side, x in (("L", 0.8), ("R", -0.8)):
            rows += [
                (f"{end}_ControlArm_{side}", "Body", (0.5 * x, 0.3, z)),
                (f"{end}_Wheel_{side}", f"{end}_ControlArm_{side}", (x, 0.3, z)),
            ]
    return chain(rows)


def plane() -> SourceTree:
    """Five rows of cards around a middle, three a row."""
    rows: list[tuple[str, str | None, tuple[float, float, float]]] = [("root", None, (0, 0, 0))]
    for k in range(5):
        turn = 2 * np.pi * k / 5
        for n in range(1, 4):
            place = (n * float(np.cos(turn)), 0.0, n * float(np.sin(turn)))
            rows.append((f"plane{n}.{k}", f"plane{n - 1}.{k}" if n > 1 else "root", place))
    return chain(rows)


def skirt() -> SourceTree:
    """Five chains of three that hang from a ring."""
    rows: list[tuple[str, str | None, tuple[float, float, float]]] = [("waist", None, (0, 1, 0))]
    for k in range(5):
        x, z = 0.15 * float(np.cos(2 * np.pi * k / 5)), 0.15 * float(np.sin(2 * np.pi * k / 5))
        for n in range(3):
            above = "waist" if n == 0 else f"cloth_{k}_{n - 1}"
            rows.append((f"cloth_{k}_{n}", above, (x * (1 + 0.1 * n), 0.95 - 0.2 * n, z * (1 + 0.1 * n))))
    return chain(rows)


PLANES = [(f"plane{n}", f"plane{n - 1}" if n > 1 else None, (0.0, 0.0, 0.1 * n)) for n in (1, 2, 3)]


@pytest.mark.parametrize(
    "tree",
    [fox(), fox(hands=False), car(), plane(), skirt(), chain(PLANES)],
    ids=["fox", "fox with front legs", "car", "planes in a star", "skirt", "plane1 to 3"],
)
def test_what_is_neither_hand_nor_body_stays_what_it_is(tree):
    roles = recognise(tree)
    assert roles.hands == []
    assert roles.body == {}
    assert roles.suspicious == []
