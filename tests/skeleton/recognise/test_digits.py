"""Hands whose fingers have four joints: one decision for the whole hand, whatever the proportions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from warpjld.skeleton.recognise.flesh import JointFlesh
from warpjld.skeleton.recognise.recognise import recognise
from warpjld.skeleton.recognise.tree import SourceTree

DIGITS = ("thumb", "index", "middle", "ring", "pinky")
WITH = ("carpometacarpal", "base", "knuckle2", "knuckle3", "tip")
# a hand of 19 cm: from the wrist to each finger's carpometacarpal, base, … [m]; across the palm 2 cm a finger
REACH = {
    "thumb": (0.03, 0.07, 0.1, 0.125),
    "index": (0.035, 0.095, 0.137, 0.162, 0.18),
    "middle": (0.034, 0.093, 0.139, 0.168, 0.188),
    "ring": (0.033, 0.087, 0.13, 0.157, 0.175),
    "pinky": (0.035, 0.081, 0.114, 0.134, 0.15),
}
factors = st.lists(st.floats(0.9, 1.1), min_size=40, max_size=40)


@dataclass
class Made:
    tree: SourceTree
    shares: np.ndarray
    want: dict[str, int]


def hand(kind: str, scale: list[float], names: str, twists: bool = False) -> Made:
    """A left hand of four joints a finger: ``tips`` (base to tip), ``metacarpals`` (to the third knuckle) or
    ``metacarpals and ends`` (five, the last without flesh); the thumb has base to third knuckle, and what ends it.

    Args:
        kind: As above.
        scale: Factors of the bones' lengths, one after another.
        names: ``numbers`` (Finger_00, …), ``bones`` (bone_001) or ``ends`` (Blender's, ``f_index.01.L_end``).
        twists: Whether a joint without flesh lies in the middle of every bone.
    """
    word, places, parents, shares = ["wrist" if names != "bones" else "bone_000"], [np.zeros(3)], [-1], [1.0]
    want = {"wrist": 0}
    factor = iter(scale)
    for d, digit in enumerate(DIGITS):
        parts = WITH[1:] if digit == "thumb" or kind == "tips" else WITH
        reach = REACH[digit][-len(parts) :]
        parts = parts[:-1] if kind == "metacarpals" else parts
        at, before, above = np.zeros(3), 0.0, 0
        for k, (part, far) in enumerate(zip(parts, reach, strict=False)):
            spread = 1.0 if part != "carpometacarpal" else 0.4
            sideways = spread * np.array([0.02 * (d - 2.5), -0.01 if digit == "thumb" else 0.0, 0.0])
            place = np.array([0.0, 0.0, before]) if k else np.zeros(3)
            length = (far - before) * next(factor)
            place = at + np.array([0, 0, length]) if k else np.array([0, 0, length]) + sideways
            if k == 1 and parts[0] == "carpometacarpal":
                place = np.array([sideways[0], sideways[1], place[2]])
            if twists and k:
                word.append(f"twist_{len(word)}" if names != "bones" else f"bone_{len(word):03d}")
                parents.append(above)
                places.append((at + place) / 2)
                shares.append(0.0)
                above = len(word) - 1
            last = k == len(parts) - 1 and kind != "metacarpals"
            number = f"Finger_{d}{k}" if not (names == "ends" and last) else f"Finger_{d}{k - 1}_end"
            word.append(number if names != "bones" else f"bone_{len(word):03d}")
            parents.append(above)
            places.append(place)
            shares.append(0.0 if last else 0.5)
            above = len(word) - 1
            want[f"{digit}.{part}"] = above
            at, before = place, far
    frames = np.tile(np.eye(4), (len(word), 1, 1))
    frames[:, :3, 3] = places
    return Made(SourceTree(tuple(word), np.array(parents), frames), np.array(shares) / sum(shares), want)


@pytest.mark.parametrize("twists", [False, True])
@pytest.mark.parametrize("names", ["numbers", "bones", "ends"])
@pytest.mark.parametrize("kind", ["tips", "metacarpals", "metacarpals and ends"])
@settings(max_examples=15, derandomize=True, deadline=None)
@given(scale=factors)
def test_every_digit_is_decided_alike_and_rightly(kind, names, twists, scale):
    made = hand(kind, scale, names, twists)
    roles = recognise(made.tree, made.shares)
    assert len(roles.hands) == 1
    assert roles.hands[0].joints == made.want


@pytest.mark.parametrize("kind", ["tips", "metacarpals"])
@settings(max_examples=15, derandomize=True, deadline=None)
@given(scale=factors)
def test_without_a_skin_lengths_decide(kind, scale):
    made = hand(kind, scale, "numbers")
    found = recognise(made.tree).hands[0].joints
    assert found == made.want


def test_a_short_palm_is_no_row_of_metacarpals_where_ends_own_no_flesh():
    """First joints lie 1.24 to 1.31 first bones from the wrist: a border of 1.3 parted one hand's fingers."""
    made = hand("tips", [1.0] * 40, "numbers")
    frames = made.tree.frames.copy()
    for digit, ratio in zip(("index", "middle", "ring", "pinky"), (1.31, 1.28, 1.24, 1.3), strict=True):
        first, second = made.want[f"{digit}.base"], made.want[f"{digit}.knuckle2"]
        bone = np.linalg.norm(frames[second, :3, 3] - frames[first, :3, 3])
        move = np.array([0, 0, np.sqrt((ratio * bone) ** 2 - frames[first, 0, 3] ** 2) - frames[first, 2, 3]])
        for part in ("base", "knuckle2", "knuckle3", "tip"):
            frames[made.want[f"{digit}.{part}"], :3, 3] += move
    tree = SourceTree(made.tree.names, made.tree.parents, frames)
    assert recognise(tree, made.shares).hands[0].joints == made.want


def test_ends_of_a_thumb_are_no_knuckles():
    """Two joints with flesh and two ends: the file has no third knuckle, whatever the count says."""
    made = hand("tips", [1.0] * 40, "numbers")
    shares = made.shares.copy()
    names = list(made.tree.names)
    third, tip = made.want["thumb.knuckle3"], made.want["thumb.tip"]
    names[third], names[tip] = "Finger_01_end", "Finger_01_end_end"
    shares[third] = 0.0
    found = recognise(SourceTree(tuple(names), made.tree.parents, made.tree.frames), shares).hands[0].joints
    assert "thumb.knuckle3" not in found
    assert found["thumb.tip"] == third
    assert tip not in found.values()


def test_bare_joints_of_a_flat_tree_are_not_dead():
    made = hand("tips", [1.0] * 40, "numbers")
    flat = SourceTree(made.tree.names, np.full(len(made.tree), -1), made.tree.frames)
    assert not JointFlesh(flat, made.shares).dead.any()
